#include "tests/xr/runtime/remote.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

struct Row {
  double time_s = 0.0;
  XrPosef pose = identity();
};

XrPosef read_pose(std::istream& words) {
  XrPosef pose = identity();
  words >> pose.position.x >> pose.position.y >> pose.position.z;
  XrQuaternionf q{};
  if (words >> q.x >> q.y >> q.z >> q.w) pose.orientation = q;
  return pose;
}

/// Between a and b: linear for positions, the normalised mean for rotations, which is enough
/// between rows that are close.
XrPosef between(const XrPosef& a, const XrPosef& b, float t) {
  const auto mix = [t](float from, float to) { return from + t * (to - from); };
  XrPosef pose;
  pose.position = {mix(a.position.x, b.position.x), mix(a.position.y, b.position.y),
                   mix(a.position.z, b.position.z)};
  const XrQuaternionf& p = a.orientation;
  XrQuaternionf q = b.orientation;
  if (p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  pose.orientation = {mix(p.x, q.x), mix(p.y, q.y), mix(p.z, q.z), mix(p.w, q.w)};
  return compose(identity(), pose);
}

PoseScript rows_of(const std::string& file, int64_t offset_ns) {
  std::vector<Row> rows;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    Row row;
    words >> row.time_s;
    row.pose = read_pose(words);
    rows.push_back(row);
  }
  if (rows.empty()) rows.emplace_back();
  return [rows, offset_ns](XrTime time) {
    const double t = double(time + offset_ns) * 1e-9;
    const auto after = std::upper_bound(rows.begin(), rows.end(), t,
                                        [](double at, const Row& row) { return at < row.time_s; });
    if (after == rows.begin()) return rows.front().pose;
    if (after == rows.end()) return rows.back().pose;
    const Row& before = *(after - 1);
    const double share = (t - before.time_s) / (after->time_s - before.time_s);
    return between(before.pose, after->pose, float(share));
  };
}

PoseScript glide(const XrPosef& from, XrVector3f by, XrTime start, double seconds) {
  return [=](XrTime time) {
    const double share = std::clamp(double(time - start) * 1e-9 / seconds, 0.0, 1.0);
    XrPosef pose = from;
    pose.position.x += float(share) * by.x;
    pose.position.y += float(share) * by.y;
    pose.position.z += float(share) * by.z;
    return pose;
  };
}

void write_pictures(const std::string& file, const std::vector<Picture>& pictures) {
  if (pictures.empty() || pictures[0].light.empty()) return;
  // Above the k-th of these, light is written as the byte k + 1 at least.
  static const std::array<float, 255> steps = [] {
    std::array<float, 255> between{};
    for (size_t k = 0; k < between.size(); ++k)
      between[k] = float(linear_of_srgb((double(k) + 0.5) / 255.0));
    return between;
  }();
  const uint32_t width = pictures[0].width, height = pictures[0].height;
  std::string bytes;
  bytes.reserve(size_t(3) * width * height * pictures.size());
  for (uint32_t y = 0; y < height; ++y)
    for (const Picture& picture : pictures)
      for (uint32_t x = 0; x < width; ++x) {
        const std::array<float, 4>& pixel = picture.light[size_t(y) * width + x];
        for (size_t c = 0; c < 3; ++c) {
          const auto above = std::upper_bound(steps.begin(), steps.end(), pixel[c]);
          bytes += char(uint8_t(above - steps.begin()));
        }
      }
  std::ofstream stream(file, std::ios::binary);
  stream << "P6\n" << pictures.size() * width << " " << height << "\n255\n" << bytes;
}

/// Distances along the eyes' axes, m; infinite where there is nothing.
void write_depths(const std::string& file, const std::vector<Picture>& pictures) {
  std::ofstream stream(file, std::ios::binary);
  for (const Picture& picture : pictures)
    for (const float d : picture.depth) {
      // near and far: the distances of depth 0 and 1; reversed, with an infinite far plane.
      const float at_m = picture.far_m / d;
      stream.write(reinterpret_cast<const char*>(&at_m), sizeof at_m);
    }
}

/// Written as a whole or not at all, so that a waiting reader never reads a part.
void tell(const std::string& file, World& world) {
  std::vector<Picture> pictures = world.pictures();
  if (pictures.size() == 4) {
    write_pictures(file + ".focus.ppm", {pictures.begin() + 2, pictures.end()});
    pictures.resize(2);
  }
  write_pictures(file + ".ppm", pictures);
  write_depths(file + ".depth", pictures);
  std::vector<Picture> hanging;
  for (const Quad& quad : world.quads()) hanging.push_back(quad.picture);
  write_pictures(file + ".panel.ppm", hanging);
  const std::string making = file + ".making";
  {
    std::ofstream stream(making);
    stream << "frames " << world.frames() << "\nstate " << int(world.state()) << "\nlayers "
           << world.ended.layers << "\nquads " << world.hanging.size() << "\ndepth "
           << world.ended.depth << "\nhaptics " << world.vibrations.size() << "\nviolations "
           << world.wrong.size() << "\n";
    if (!world.vibrations.empty())
      stream << "amplitude " << world.vibrations.back().amplitude << "\n";
    if (!pictures.empty()) stream << "width " << pictures[0].width << "\n";
    for (const std::string& what : world.wrong) stream << what << "\n";
  }
  std::rename(making.c_str(), file.c_str());
}

void obey(const std::string& line, World& world) {
  std::istringstream words(line);
  std::string command, what;
  int side = 0;
  words >> command;
  if (command == "input") {
    float value = 0;
    words >> what >> value;
    world.set_input(what, value);
  } else if (command == "tap") {
    words >> what;
    world.taps.insert(what);
  } else if (command == "hand") {
    words >> side;
    const XrPosef pose = read_pose(words);
    world.script_hand(side, [pose](XrTime) { return pose; });
  } else if (command == "no-hand") {
    words >> side;
    world.script_hand(side, nullptr);
  } else if (command == "fingers") {
    XrPosef from = identity();
    XrVector3f by{};
    float gap = 0;
    double seconds = 1.0;
    words >> side >> from.position.x >> from.position.y >> from.position.z >> gap;
    if (words >> by.x >> by.y >> by.z) words >> seconds;
    world.script_fingers(side, [way = glide(from, by, world.time, seconds), gap](XrTime time) {
      SeenFingers seen;
      seen.index_tip = seen.thumb_tip = way(time).position;
      seen.thumb_tip.y -= gap + 2.0F * seen.radius;
      return seen;
    });
  } else if (command == "no-fingers") {
    words >> side;
    world.script_fingers(side, nullptr);
  } else if (command == "glide") {
    XrVector3f by{};
    double seconds = 1.0;
    words >> side >> by.x >> by.y >> by.z >> seconds;
    world.script_hand(side, glide(world.hands[side](world.time), by, world.time, seconds));
  } else if (command == "path") {
    words >> side >> what;
    world.script_hand(side, rows_of(what, world.monotonic_of(0)));
  } else if (command == "head") {
    const XrPosef pose = read_pose(words);
    world.script_head([pose](XrTime) { return pose; });
  } else if (command == "view") {
    words >> world.setup().view_width >> world.setup().view_height;
  } else if (command == "focus") {
    words >> world.setup().focus_width >> world.setup().focus_height;
  } else if (command == "profile") {
    words >> world.setup().profile;
  } else if (command == "rate") {
    std::vector<float>& offered = world.setup().rates_hz;
    offered.clear();
    for (float hz = 0.0F; words >> hz;) offered.push_back(hz);
    world.change_rate(offered.front());
  } else if (command == "without") {
    words >> what;
    std::erase(world.setup().extensions, what);
  } else if (command == "headset") {
    words >> what;
    world.setup().headset_on = what == "on";
  } else if (command == "runtime") {
    words >> what;
    world.setup().runtime_up = what == "up";
  } else if (command == "lose") {
    words >> what;
    what == "session" ? world.lose_session() : world.lose_instance();
  } else if (command == "pictures") {
    world.setup().keep_pictures = true;
  } else if (command == "recentre") {
    const XrPosef pose = read_pose(words);
    world.recentre(XR_REFERENCE_SPACE_TYPE_STAGE, world.time, pose, true);
  } else if (command == "exit") {
    world.exit_by_person();
  } else if (command == "tell") {
    words >> what;
    tell(what, world);
  } else {
    world.violation("the remote said: " + line);
  }
}

}  // namespace

Remote::Remote() {
  // Opened for writing too, so that reading never reaches the end of the file.
  if (const char* path = std::getenv("PALPATE_FAKE_XR_REMOTE"))
    fifo_ = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
}

Remote::~Remote() {
  if (fifo_ >= 0) close(fifo_);
}

void Remote::listen(World& world) {
  if (fifo_ < 0) return;
  char buffer[4096];
  for (ssize_t got = 0; (got = read(fifo_, buffer, sizeof buffer)) > 0;)
    unread_.append(buffer, size_t(got));
  for (size_t end = 0; (end = unread_.find('\n')) != std::string::npos;) {
    const std::string line = unread_.substr(0, end);
    unread_.erase(0, end + 1);
    obey(line, world);
  }
}

}  // namespace palpate::test::fake
