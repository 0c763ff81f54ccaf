#include "module/view/resident_volume.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "compute/volume/parallel.h"
#include "compute/vulkan/recorder.h"
#include "module/scene/cycle_closing.h"
#include "shaders/interface/view.h"

namespace palpate::view {
namespace {

constexpr int kMostMadeSamples = 256;
// What is taken off before trilinear reading, as a share of f''. One reading adds between 0 and 1/8
// of it, so 1/16 leaves at most 1/16 to either side; moving volumes are read twice.
constexpr double kOnce = 1.0 / 16.0, kTwice = 3.0 / 32.0;

bool same(const GridPlace& a, const GridPlace& b) {
  if (a.size != b.size) return false;
  const glm::dvec3 far(a.size);
  return glm::length(a.offset - b.offset) < 1e-3 &&
         glm::length((a.index_from_volume - b.index_from_volume) *
                     (glm::inverse(a.index_from_volume) * far)) < 1e-3;
}

/// A grid along volume space's axes for data that have none.
GridPlace made_place(const FrameData& data) {
  const glm::dvec3 extent = data.high_m() - data.low_m();
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double spacing = std::max(data.detail_m(), longest / kMostMadeSamples);
  GridPlace place;
  place.size = glm::max(glm::ivec3(glm::round(extent / spacing)), glm::ivec3(1));
  place.index_from_volume = glm::dmat3(1.0 / spacing);
  place.offset = -data.low_m() / spacing - 0.5;
  return place;
}

size_t count_of(const GridPlace& place) {
  return size_t(place.size.x) * size_t(place.size.y) * size_t(place.size.z);
}

/// A frame at the voxels of `place`, as the hand reads it there.
std::vector<float> read_at(const FrameData& data, const GridPlace& place) {
  std::vector<float> values(count_of(place));
  const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
  parallel_ranges(place.size.z, 300.0 * place.size.x * place.size.y, [&](int begin, int end) {
    size_t at = size_t(begin) * size_t(place.size.x) * size_t(place.size.y);
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < place.size.y; ++j)
        for (int i = 0; i < place.size.x; ++i)
          values[at++] =
              float(data.scalar(volume_from_index * (glm::dvec3(i, j, k) - place.offset)));
  });
  return values;
}

struct Range {
  float low = 3e38F, high = -3e38F;
};

void widen(Range& range, std::span<const float> values) {
  for (const float v : values)
    if (std::isfinite(v)) range.low = std::min(range.low, v), range.high = std::max(range.high, v);
}

/// Both ways of a value into the image; one staging buffer serves all frames.
class FrameUpload {
 public:
  FrameUpload(std::shared_ptr<vulkan::Context> context, Kernels& kernels, const GridPlace& place)
      : context_(std::move(context)),
        kernels_(kernels),
        place_(place),
        staging_(context_, 4 * count_of(place), vulkan::Buffer::Kind::kHostVisible) {}

  /// curve: what to take off, see kOnce. Samples are smoothed as the hand smooths them; values
  /// that were read by the hand's own reader are not.
  vulkan::Image put(std::span<const float> values, bool samples, double curve,
                    const ResidentFrames& frames) {
    const std::span<float> staged = staging_.as<float>();
    for (size_t i = 0; i < values.size(); ++i)
      staged[i] = std::isfinite(values[i]) ? values[i] : float(frames.lowest);
    const VkFormat format = context_->is_cpu() ? VK_FORMAT_R32_SFLOAT : VK_FORMAT_R16_SFLOAT;
    vulkan::Image image(context_, place_.size, format);
    const double side = (samples ? 1.0 / 6.0 : 0.0) - curve;
    const double scale = 1.0 / (frames.highest - frames.lowest);
    view_shaders::PrefilterPush push{};
    push.size = glm::ivec4(place_.size, 0);
    push.weights = glm::vec4(1.0 - 2.0 * side, side, scale, -frames.lowest * scale);
    vulkan::Recorder recorder(context_, 1);
    recorder.prepare(image);
    recorder.dispatch(kernels_.prefilter(), {staging_, image}, push,
                      {(place_.size.x + 63) / 64, place_.size.y, place_.size.z});
    recorder.run();
    return image;
  }

 private:
  std::shared_ptr<vulkan::Context> context_;
  Kernels& kernels_;
  GridPlace place_;
  vulkan::Buffer staging_;
};

}  // namespace

std::shared_ptr<const ResidentFrames> upload_frames(const std::shared_ptr<vulkan::Context>& context,
                                                    Kernels& kernels, const MovingVolume& volume) {
  auto resident = std::make_shared<ResidentFrames>();
  resident->sources = volume.frames;
  const FrameData& first = *volume.frames.front();
  const ScalarSamples samples = first.samples();
  resident->place = samples.place ? *samples.place : made_place(first);
  const glm::dmat3 volume_from_index = glm::inverse(resident->place.index_from_volume);
  for (int a = 0; a < 3; ++a) resident->spacing_mm[a] = 1e3 * glm::length(volume_from_index[a]);

  // Read once: what was read has to be kept until the range of all frames is known.
  std::vector<std::vector<float>> read(volume.frames.size());
  std::vector<std::span<const float>> values(volume.frames.size());
  std::vector<bool> is_sampled(volume.frames.size());
  Range range;
  for (size_t k = 0; k < volume.frames.size(); ++k) {
    const ScalarSamples own = volume.frames[k]->samples();
    is_sampled[k] = own.place && same(*own.place, resident->place);
    if (!is_sampled[k]) read[k] = read_at(*volume.frames[k], resident->place);
    values[k] = is_sampled[k] ? own.values : std::span<const float>(read[k]);
    widen(range, values[k]);
  }
  if (!(range.low < range.high)) range = {range.low < 1e38F ? range.low : 0.0F, range.low + 1.0F};
  if (!(range.low < range.high)) range = {0.0F, 1.0F};
  resident->lowest = double(range.low);
  resident->highest = double(range.high);
  FrameUpload upload(context, kernels, resident->place);
  for (size_t k = 0; k < volume.frames.size(); ++k)
    resident->images.push_back(
        upload.put(values[k], is_sampled[k], volume.is_still() ? kOnce : kTwice, *resident));
  return resident;
}

std::shared_ptr<const ResidentField> upload_field(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const MovingVolume& volume, size_t motion,
                                                  size_t step) {
  const auto& steps = volume.motions[motion].steps;
  const MotionMap* map = steps[step].get();
  if (!map) return nullptr;
  auto resident = std::make_shared<ResidentField>();
  const GridPlace& place = map->place();
  resident->size = place.size;
  const glm::dmat3 volume_from_voxel = glm::inverse(frames.place.index_from_volume);
  resident->from_voxel = place.index_from_volume * volume_from_voxel;
  resident->offset = place.offset - resident->from_voxel * frames.place.offset;

  const size_t count = count_of(place);
  vulkan::Buffer staging(context, 16 * count, vulkan::Buffer::Kind::kHostVisible);
  const std::span<glm::vec4> staged = staging.as<glm::vec4>();
  const bool closes = volume.times.cyclic() && step + 1 == steps.size() && step > 0;
  const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
  const std::span<const glm::vec4> samples = map->samples();
  const double cost = (closes ? 3000.0 : 10.0) * place.size.x * place.size.y;
  parallel_ranges(place.size.z, cost, [&](int begin, int end) {
    size_t at = size_t(begin) * size_t(place.size.x) * size_t(place.size.y);
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < place.size.y; ++j)
        for (int i = 0; i < place.size.x; ++i, ++at) {
          glm::dvec3 u(samples[at]);
          if (closes)
            u += closing_forward(steps, volume_from_index * (glm::dvec3(i, j, k) - place.offset));
          staged[at] = glm::vec4(glm::vec3(frames.place.index_from_volume * u), samples[at].w);
        }
  });
  resident->image = vulkan::Image(context, place.size, VK_FORMAT_R32G32B32A32_SFLOAT);
  vulkan::Recorder recorder(context, 1);
  recorder.prepare(resident->image);
  recorder.copy(staging, resident->image);
  recorder.run();
  return resident;
}

}  // namespace palpate::view
