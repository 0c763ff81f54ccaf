#include "integration/web/live_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "compute/volume/parallel.h"
#include "integration/web/web_page.h"
#include "module/scene/data_box.h"
#include "module/view/parameters.h"
#include "module/view/resident_volume.h"

namespace palpate::web {
namespace {

using nlohmann::json;
using view_shaders::kMostLevels;
using view_shaders::kTable;
static_assert(std::endian::native == std::endian::little, "parts are sent as they are");

constexpr double kMostFrameVoxelsLive = 8e6;  // of one frame: 64 MB where it is drawn

json numbers(glm::dvec3 v) {
  return {v.x, v.y, v.z};
}

/// index = linear * x + offset, as a matrix of columns.
json affine(const glm::dmat3& linear, glm::dvec3 offset) {
  glm::dmat4 m(linear);
  m[3] = glm::dvec4(offset, 1.0);
  return std::vector<double>(glm::value_ptr(m), glm::value_ptr(m) + 16);
}

Grid grid_of_place(const GridPlace& place) {
  const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
  Grid grid;
  grid.size = place.size;
  grid.origin_mm = lps_from_volume(volume_from_index * -place.offset);
  for (int a = 0; a < 3; ++a) {
    const glm::dvec3 axis = lps_from_volume(volume_from_index[a]);
    grid.spacing_mm[a] = glm::length(axis);
    grid.direction[a] = axis / grid.spacing_mm[a];
  }
  return grid;
}

/// The mean of each sample and its neighbours along the three axes, see HostFrames::Frame.
std::vector<float> smoothed(const view::HostFrames::Frame& frame, glm::ivec3 size, float lowest) {
  const float side = float(frame.side), middle = 1.0F - 2.0F * side;
  std::vector<float> from(frame.values.begin(), frame.values.end()), to(from.size());
  for (float& value : from)
    if (!std::isfinite(value)) value = lowest;
  const std::array<size_t, 3> step = {1, size_t(size.x), size_t(size.x) * size_t(size.y)};
  for (int axis = 0; axis < 3; ++axis) {
    parallel_ranges(size.z, 6.0 * size.x * size.y, [&](int begin, int end) {
      for (int k = begin; k < end; ++k)
        for (int j = 0; j < size.y; ++j)
          for (int i = 0; i < size.x; ++i) {
            const size_t at = size_t(i) + step[1] * size_t(j) + step[2] * size_t(k);
            const int along = glm::ivec3(i, j, k)[axis];
            const size_t before = along > 0 ? at - step[size_t(axis)] : at;
            const size_t after = along + 1 < size[axis] ? at + step[size_t(axis)] : at;
            to[at] = middle * from[at] + side * (from[before] + from[after]);
          }
    });
    from.swap(to);
  }
  return from;
}

std::string halves(const std::vector<float>& values) {
  std::string bytes(2 * values.size(), '\0');
  parallel_ranges(int(values.size()), 10.0, [&](int begin, int end) {
    for (size_t n = size_t(begin); n < size_t(end); ++n) {
      const uint16_t half = glm::packHalf1x16(values[n]);
      std::memcpy(bytes.data() + 2 * n, &half, 2);
    }
  });
  return bytes;
}

/// Where the samples of a field lie, every `stride`-th of them.
struct FieldPlace {
  GridPlace place;
  int stride = 1;
  glm::ivec3 size() const { return (place.size + stride - 1) / stride; }
  double bytes() const {
    const glm::dvec3 s(size());
    return 6.0 * s.x * s.y * s.z;
  }
};

/// `u_m`(sample number) in voxels of the frames, as halves.
template <class Read>
std::string field_part(const FieldPlace& of, const glm::dmat3& voxel_from_m, const Read& u_m) {
  const glm::ivec3 size = of.size();
  std::vector<float> values(3 * size_t(size.x) * size_t(size.y) * size_t(size.z));
  parallel_ranges(size.z, 50.0 * size.x * size.y, [&](int begin, int end) {
    size_t to = 3 * size_t(begin) * size_t(size.x) * size_t(size.y);
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) {
          const glm::ivec3 at = of.stride * glm::ivec3(i, j, k);
          const size_t sample =
              size_t(at.x) +
              size_t(of.place.size.x) * (size_t(at.y) + size_t(of.place.size.y) * size_t(at.z));
          const glm::dvec3 u = voxel_from_m * u_m(sample);
          for (int a = 0; a < 3; ++a) values[to++] = float(u[a]);
        }
  });
  return halves(values);
}

/// u at one time from the summands, shape (summands, nz, ny, nx).
glm::dvec3 sum_at(const SequenceMap::Samples& samples, const TimeWeights& time, size_t count,
                  size_t sample) {
  glm::vec3 u(0.0F);
  for (size_t n = 0; n < size_t(time.count); ++n)
    u += time.weight[n] * samples.u_m[size_t(time.term[n]) * count + sample];
  return glm::dvec3(u);
}

}  // namespace

template <class Make>
uint64_t LiveScene::part_of(const PartSource& source, Make make) {
  const auto known = numbers_.find(source);
  const uint64_t number = known != numbers_.end() ? known->second : ++last_;
  if (known == numbers_.end()) parts_.emplace(number, std::make_shared<const std::string>(make()));
  used_.emplace(source, number);
  return number;
}

json LiveScene::pack_frames(const MovingVolume& volume, view::ResidentFrames& frames) {
  view::HostFrames host = view::host_frames(volume);
  const Grid grid = grid_of_place(host.place);
  // Maybe coarser than they are.
  const double most = std::min(kMostVoxels, kMostFrameVoxelsLive * double(host.frames.size()));
  const std::vector<Grid> coarser = page_grids(grid, host.frames.size(), most);
  frames.place = coarser.empty() ? host.place : GridPlace(coarser.back());
  frames.spacing_mm = coarser.empty() ? host.spacing_mm : coarser.back().spacing_mm;
  frames.lowest = host.lowest;
  frames.highest = host.highest;
  json parts = json::array();
  for (size_t k = 0; k < host.frames.size(); ++k) {
    const PartSource source{volume.frames[k], 0, host.lowest, host.highest};
    parts.push_back(part_of(source, [&] {
      Volume values;
      values.grid = grid;
      values.values = smoothed(host.frames[k], host.place.size, float(host.lowest));
      values = reduced(std::move(values), coarser);
      const float low = float(host.lowest), scale = 1.0F / float(host.highest - host.lowest);
      for (float& value : values.values) value = (value - low) * scale;
      return halves(values.values);
    }));
  }
  return parts;
}

json LiveScene::pack_motion(const MovingVolume& volume, const view::ResidentFrames& frames) {
  json parts = json::array();
  FieldPlace of;
  const glm::dmat3 voxel_from_m = frames.place.index_from_volume;
  const size_t count = volume.times.times_s.size();
  if (volume.whole) {
    const SequenceMap& map = *volume.whole;
    of.place = map.place();
    const double fine_bytes = 8.0 * of.bytes() * 2.0 * double(count);
    const SequenceMap::Samples samples = map.samples(fine_bytes <= kMostFieldBytes ? 2 : 1);
    of.place = samples.place;
    while (of.bytes() * 2.0 * double(count) > kMostFieldBytes) ++of.stride;
    const size_t all = samples.u_m.size() / map.basis().summands();
    for (size_t n = 0; n < 2 * count; ++n) {
      const TimeWeights time = map.basis().at(int(n / 2), 0.5 * double(n % 2));
      parts.push_back(part_of({volume.whole, n, 0.0, frames.spacing_mm.x}, [&] {
        return field_part(of, voxel_from_m,
                          [&](size_t sample) { return sum_at(samples, time, all, sample); });
      }));
    }
  } else if (!volume.motions.empty()) {
    const auto& steps = volume.motions.front().steps;
    for (const auto& step : steps)
      if (step) of.place = step->place();
    while (of.bytes() * double(steps.size()) > kMostFieldBytes) ++of.stride;
    for (const auto& step : steps) {
      if (!step || step->place().size != of.place.size) {
        parts.push_back(nullptr);
        continue;
      }
      parts.push_back(part_of({step, 0, 0.0, frames.spacing_mm.x}, [&] {
        return field_part(of, voxel_from_m,
                          [&](size_t sample) { return glm::dvec3(step->samples()[sample]); });
      }));
    }
  }
  if (of.place.size.x == 0) return nullptr;
  const glm::dmat3 linear = of.place.index_from_volume * glm::inverse(voxel_from_m);
  const double per = 1.0 / of.stride;
  return {
      {"parts", parts},
      {"size", {of.size().x, of.size().y, of.size().z}},
      {"from_voxel", affine(per * linear, per * (of.place.offset - linear * frames.place.offset))}};
}

uint64_t LiveScene::pack_look(const Look& look, const view::ResidentFrames& frames) {
  return part_of({scene_, 1, 0.0, 0.0}, [&] {
    std::vector<glm::vec4> colours(2 * size_t(kTable));
    std::vector<uint32_t> next(static_cast<size_t>(kTable));
    std::vector<float> levels(size_t(kTable) * size_t(kMostLevels));
    view::fill_table(look, frames.lowest, frames.highest, colours, next, levels);
    for (const uint32_t entry : next) colours.emplace_back(float(entry), 0.0F, 0.0F, 0.0F);
    return std::string(reinterpret_cast<const char*>(colours.data()),
                       colours.size() * sizeof(glm::vec4));
  });
}

void LiveScene::pack(const ViewScene& shown, const SceneSnapshot& snapshot) {
  const ViewVolume& drawn = shown.volumes.front();
  const MovingVolume& volume = *drawn.data;
  for (size_t v = 0; v < scene_->volumes.size() && volume_ < 0; ++v)
    if (scene_->volumes[v].data == drawn.data) volume_ = int(v);

  view::ResidentFrames frames;
  const json frame_parts = pack_frames(volume, frames);
  const json motion = pack_motion(volume, frames);
  const uint64_t look = pack_look(drawn.look, frames);
  // What the renderer's own functions make of the look.
  const Eye eye;
  const auto parameters = view::volume_parameters_of(shown, drawn, {&eye, 1}, {1, 1}, frames, 1.0);

  const std::string& source = scene_->volumes[size_t(volume_)].spec.source;
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  json corners;
  for (const glm::dvec3 corner : picture_.corners(snapshot)) {
    corners.push_back(numbers(corner));
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  }
  const DataBox box = box_of(*volume.frames.front());
  json axes, sides;  // sides: before and after the box, axis by axis
  for (int a = 0; a < 3; ++a) {
    axes.push_back(numbers(box.axes[a]));
    sides.push_back(side_of(-box.axes[a]));
    sides.push_back(side_of(box.axes[a]));
  }
  const auto of_vec4 = [](glm::vec4 v) { return json{v.x, v.y, v.z, v.w}; };
  const glm::ivec3 size = frames.place.size;
  description_ =
      json{{"name", volume.name},
           {"size", {size.x, size.y, size.z}},
           {"spacing_mm", numbers(frames.spacing_mm)},
           {"voxel_from_volume", affine(frames.place.index_from_volume, frames.place.offset)},
           {"box",
            {{"corner_m", numbers(box.corner_m)},
             {"axes", axes},
             {"edges_m", numbers(box.edges_m)}}},
           {"sides", sides},
           {"frames", frame_parts},
           {"motion", motion},
           {"whole", volume.whole != nullptr},
           {"blends", drawn.blend_values},
           {"times_s", volume.times.times_s},
           {"cycle_s", volume.times.cycle_s},
           {"look", look},
           {"table", of_vec4(parameters.table)},
           {"shine", of_vec4(parameters.shine)},
           {"stretch", of_vec4(parameters.stretch)},
           {"background", {numbers(shown.background_top), numbers(shown.background_bottom)}},
           {"light", numbers(glm::normalize(shown.light))},
           {"corners_m", corners},
           {"low_m", numbers(low)},
           {"high_m", numbers(high)},
           {"tool_m", scene_->tool_radius_m},
           {"patient", source != "molecule" && source != "charges"}}
          .dump(-1, ' ', false, json::error_handler_t::replace);
}

bool LiveScene::update(std::shared_ptr<const Scene> scene, const SceneSnapshot& snapshot) {
  if (scene == scene_) return false;
  scene_ = scene;
  picture_.update(scene);
  used_.clear();
  volume_ = -1;
  description_ = "null";
  if (!picture_.volumes().empty()) {
    const Eye anywhere;
    pack(picture_.at(snapshot, snapshot.now_ns, {&anywhere, 1}), snapshot);
  }
  // Parts that nothing uses any more.
  numbers_ = used_;
  std::erase_if(parts_, [&](const auto& part) {
    return std::none_of(numbers_.begin(), numbers_.end(),
                        [&](const auto& used) { return used.second == part.first; });
  });
  return true;
}

}  // namespace palpate::web
