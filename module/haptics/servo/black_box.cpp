#include "module/haptics/servo/black_box.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cstdio>
#include <fstream>

#include "module/haptics/servo/tick_fields.h"

namespace palpate {
namespace {

/// Appends to a line of the table.
struct Cells {
  std::string& line;
  void add(const char* text) {
    if (!line.empty()) line += ',';
    line += text;
  }
  template <class... Values>
  void print(const char* format, Values... values) {
    char text[64];
    std::snprintf(text, sizeof text, format, values...);
    add(text);
  }
  void operator()(const char*, const char*, double v) { print("%.9g", v); }
  void operator()(const char*, const char*, const glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) print("%.9g", v[axis]);
  }
  void operator()(const char*, const char*, int64_t v) { print("%lld", static_cast<long long>(v)); }
  void operator()(const char*, const char*, int v) { print("%d", v); }
  void operator()(const char*, const char*, uint32_t v) { print("%u", v); }
  void operator()(const char*, const char*, uint8_t v) { print("%d", int(v)); }
  void operator()(const char*, const char*, bool v) { print("%d", int(v)); }
  void operator()(const char*, const char*, Cause v) { add(word(v)); }
  void operator()(const char*, const char*, DeviceFault v) { print("%d", int(v)); }
};

/// The names of the columns.
struct Names {
  std::string& line;
  void add(const std::string& name, const char* unit) {
    if (!line.empty()) line += ',';
    line += name;
    if (*unit) line += std::string(" (") + unit + ")";
  }
  template <class Value>
  void operator()(const char* name, const char* unit, const Value&) {
    add(name, unit);
  }
  void operator()(const char* name, const char* unit, const glm::dvec3&) {
    for (const char* axis : {"_x", "_y", "_z"}) add(std::string(name) + axis, unit);
  }
};

std::string header() {
  std::string line = "tick";
  const TickInput input;
  const TickOutput output;
  visit_input(input, Names{line});
  visit_output(output, Names{line});
  visit_torque(output, Names{line});
  return line + ",poses (volume x y z in m),events (kind index value)";
}

std::string poses_and_events(const TickInput& input) {
  char text[128];
  std::string line = ",";
  for (int k = 0; k < input.pose_count; ++k) {
    const PoseUpdate& pose = input.poses[size_t(k)];
    const glm::dvec3 at = pose.transform.translation_m;
    std::snprintf(text, sizeof text, "%s%d %.9g %.9g %.9g", k ? "; " : "", pose.volume, at.x, at.y,
                  at.z);
    line += text;
  }
  line += ',';
  for (int k = 0; k < input.event_count; ++k) {
    const ControlEvent& event = input.events[size_t(k)];
    std::snprintf(text, sizeof text, "%s%d %d %.9g", k ? "; " : "", int(event.kind), event.index,
                  event.value);
    line += text;
  }
  return line;
}

/// A name that is not there yet: the time of day and the cause.
std::filesystem::path new_file(const std::filesystem::path& folder, const std::string& why) {
  using namespace std::chrono;
  const auto now = floor<seconds>(system_clock::now());
  const year_month_day date(floor<days>(now));
  const hh_mm_ss time(now - floor<days>(now));
  char stamp[64];
  std::snprintf(stamp, sizeof stamp, "%04d%02u%02uT%02d%02d%02dZ", int(date.year()),
                unsigned(date.month()), unsigned(date.day()), int(time.hours().count()),
                int(time.minutes().count()), int(time.seconds().count()));
  const std::string name = std::string("palpate-") + stamp + "-" + why;
  std::filesystem::path path = folder / (name + ".csv");
  std::error_code ignored;
  for (int n = 2; std::filesystem::exists(path, ignored); ++n)
    path = folder / (name + "-" + std::to_string(n) + ".csv");
  return path;
}

}  // namespace

bool is_trip(Cause cause, DeviceFault fault) noexcept {
  switch (cause) {
    case Cause::kDevice:
      return fault != DeviceFault::kNoHand;
    case Cause::kNotFinite:
    case Cause::kLate:
    case Cause::kClock:
    case Cause::kTooFast:
    case Cause::kOscillation:
    case Cause::kShaking:
    case Cause::kEnergy:
    case Cause::kField:
      return true;
    default:
      return false;
  }
}

BlackBox::BlackBox(BlackBoxOptions options)
    : options_(std::move(options)), ticks_(size_t(options_.ticks)) {
  assert(options_.ticks > options_.ticks_after && options_.ticks_after > 0);
}

void BlackBox::hear(const TickInput& input, const TickOutput& output) noexcept {
  ticks_[next_] = {input, output};
  next_ = (next_ + 1) % ticks_.size();
  count_ = std::min(count_ + 1, ticks_.size());
  // The cause of a device stays until the hand is free; its fault may be over before.
  if (output.fault != DeviceFault::kNone) last_fault_ = output.fault;
  const bool tripped = is_trip(output.cause, last_fault_);
  if (tripped && !was_tripped_ && ticks_to_go_ == 0) {
    ticks_to_go_ = options_.ticks_after + 1;
    cause_ = output.cause;
  }
  was_tripped_ = tripped;
  if (ticks_to_go_ == 0 || --ticks_to_go_ > 0) return;
  if (last_file_ns_ && input.now_ns - *last_file_ns_ < options_.least_gap_ns) {
    ++skipped_;
  } else {
    last_file_ns_ = input.now_ns;
    // The memory may be full: then there is no file, and the process goes on.
    try {
      write(word(cause_), int(count_) - 1 - options_.ticks_after);
    } catch (...) {
      ++skipped_;
    }
  }
  next_ = count_ = 0;
}

void BlackBox::write_last(const std::string& why) {
  if (count_ > 0) write(why, int(count_) - 1);
}

void BlackBox::write(const std::string& why, int trip) {
  // What goes wrong with it shows when the file is opened.
  std::error_code ignored;
  std::filesystem::create_directories(options_.folder, ignored);
  const std::filesystem::path path = new_file(options_.folder, why);
  std::ofstream file(path);
  file << header() << '\n';
  const size_t size = ticks_.size(), oldest = (next_ + size - count_) % size;
  for (size_t k = 0; k < count_; ++k) {
    const HeardTick& tick = ticks_[(oldest + k) % size];
    std::string line = std::to_string(int(k) - trip);
    visit_input(tick.input, Cells{line});
    visit_output(tick.output, Cells{line});
    visit_torque(tick.output, Cells{line});
    file << line << poses_and_events(tick.input) << '\n';
  }
  file.close();
  if (file) {
    files_.push_back(path);
  } else {
    trouble_ = "The last ticks could not be written to " + path.string() +
               ": choose a folder that exists, is writable and has room.";
  }
}

}  // namespace palpate
