#include "module/view/resident_volume.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "compute/volume/parallel.h"
#include "compute/vulkan/recorder.h"
#include "module/scene/cycle_closing.h"
#include "shaders/interface/view.h"

namespace palpate::view {
namespace {

constexpr int kMostMadeSamples = 256, kLeastMadeSamples = 128;
// What is subtracted before trilinear reading, as a share of f''. One reading adds between 0 and
// 1/8 of it, so 1/16 leaves at most 1/16 to either side; moving volumes are read twice.
constexpr double kOnce = 1.0 / 16.0, kTwice = 4.0 / 32.0;

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
  const double spacing =
      std::clamp(data.detail_m(), longest / kMostMadeSamples, longest / kLeastMadeSamples);
  GridPlace place;
  place.size = glm::max(glm::ivec3(glm::round(extent / spacing)), glm::ivec3(1));
  place.index_from_volume = glm::dmat3(1.0 / spacing);
  place.offset = -data.low_m() / spacing - 0.5;
  return place;
}

size_t count_of(const GridPlace& place) {
  return size_t(place.size.x) * size_t(place.size.y) * size_t(place.size.z);
}

/// A frame at the voxels of `place`, read as the hand reads it.
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

struct BrickRange {
  float low = 3e38F, high = -3e38F;
};

void widen(BrickRange& range, std::span<const float> values) {
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
        staging_(context_, 4 * count_of(place), vulkan::Buffer::Kind::kHostVisible),
        samples_(context_, place.size, VK_FORMAT_R32_SFLOAT) {
    vulkan::Recorder recorder(context_, 1);
    recorder.prepare(samples_);
    recorder.run();
  }

  /// side: weight of a neighbour along an axis, see HostFrames::Frame.
  vulkan::Image put(std::span<const float> values, double side, const ResidentFrames& frames) {
    const std::span<float> staged = staging_.as<float>();
    parallel_ranges(int(values.size()), 2.0, [&](int begin, int end) {
      for (size_t i = size_t(begin); i < size_t(end); ++i)
        staged[i] = std::isfinite(values[i]) ? values[i] : float(frames.lowest);
    });
    const VkFormat format = frames.curved ? VK_FORMAT_R32G32B32A32_SFLOAT : VK_FORMAT_R16_SFLOAT;
    vulkan::Image image(context_, place_.size, format);
    const double scale = 1.0 / (frames.highest - frames.lowest);
    view_shaders::PrefilterPush push{};
    push.size = glm::ivec4(place_.size, 0);
    push.weights = glm::vec4(1.0 - 2.0 * side, side, scale, -frames.lowest * scale);
    vulkan::Recorder recorder(context_, 1);
    recorder.prepare(image);
    recorder.copy(staging_, samples_);
    const glm::ivec3 group(8 * view_shaders::kPrefilterRun, 8, 1);
    recorder.dispatch(frames.curved ? kernels_.curve() : kernels_.prefilter(),
                      {{samples_, kernels_.nearest()}, image}, push,
                      (place_.size + group - 1) / group);
    recorder.run();
    return image;
  }

 private:
  std::shared_ptr<vulkan::Context> context_;
  Kernels& kernels_;
  GridPlace place_;
  vulkan::Buffer staging_;
  vulkan::Image samples_;
};

/// The closing of a cycle, by the index of its last field. What the fields leave is small and
/// smooth, and each value needs several runs of the cycle, so it is computed at every fourth sample
/// of each axis.
class Closing {
 public:
  Closing(const std::vector<std::shared_ptr<const MotionMap>>& steps, const GridPlace& place)
      : size_((place.size + kEvery - 1) / kEvery + 1) {
    rest_.resize(size_t(size_.x) * size_t(size_.y) * size_t(size_.z));
    const glm::dmat3 volume_from_index = glm::inverse(place.index_from_volume);
    parallel_ranges(size_.z, 3000.0 * size_.x * size_.y, [&](int begin, int end) {
      for (int k = begin; k < end; ++k)
        for (int j = 0; j < size_.y; ++j)
          for (int i = 0; i < size_.x; ++i) {
            const glm::dvec3 index = double(kEvery) * glm::dvec3(i, j, k);
            rest_[at(i, j, k)] = closing_forward(steps, volume_from_index * (index - place.offset));
          }
    });
  }

  glm::dvec3 operator()(int i, int j, int k) const {
    const glm::ivec3 low = glm::ivec3(i, j, k) / kEvery;
    const glm::dvec3 w = glm::dvec3(glm::ivec3(i, j, k) - kEvery * low) / double(kEvery);
    glm::dvec3 sum(0.0);
    for (int c = 0; c < 8; ++c) {
      const glm::ivec3 to(c & 1, c >> 1 & 1, c >> 2);
      const glm::dvec3 share = glm::mix(1.0 - w, w, glm::dvec3(to));
      const double weight = share.x * share.y * share.z;
      if (weight > 0.0) sum += weight * rest_[at(low.x + to.x, low.y + to.y, low.z + to.z)];
    }
    return sum;
  }

 private:
  static constexpr int kEvery = 4;
  size_t at(int i, int j, int k) const {
    return size_t(i) + size_t(size_.x) * (size_t(j) + size_t(size_.y) * size_t(k));
  }
  glm::ivec3 size_;
  std::vector<glm::dvec3> rest_;
};

// Terms of a motion are laid out finer only up to here.
constexpr double kMostTermBytes = 256e6;

/// Where a field of this place lies in the frames.
void set_place(ResidentField& field, const GridPlace& place, const ResidentFrames& frames) {
  const glm::dmat3 volume_from_voxel = glm::inverse(frames.place.index_from_volume);
  field.size = place.size;
  field.from_voxel = place.index_from_volume * volume_from_voxel;
  field.offset = place.offset - field.from_voxel * frames.place.offset;
}

}  // namespace

HostFrames host_frames(const MovingVolume& volume) {
  HostFrames host;
  const FrameData& first = *volume.frames.front();
  const ScalarSamples samples = first.samples();
  host.place = samples.place ? *samples.place : made_place(first);
  const glm::dmat3 volume_from_index = glm::inverse(host.place.index_from_volume);
  for (int a = 0; a < 3; ++a) host.spacing_mm[a] = 1e3 * glm::length(volume_from_index[a]);

  // Each frame is read once and kept until the range of all frames is known.
  const double curve = volume.is_still() ? kOnce : kTwice;
  host.frames.resize(volume.frames.size());
  BrickRange range;
  for (size_t k = 0; k < volume.frames.size(); ++k) {
    HostFrames::Frame& frame = host.frames[k];
    const ScalarSamples own = volume.frames[k]->samples();
    const bool is_sampled = own.place && same(*own.place, host.place);
    if (!is_sampled) frame.read = read_at(*volume.frames[k], host.place);
    frame.values = is_sampled ? own.values : std::span<const float>(frame.read);
    frame.smoothed = is_sampled ? 1.0 / 6.0 : 0.0;
    frame.side = frame.smoothed - curve;
    widen(range, frame.values);
  }
  if (!(range.low < range.high)) range = {range.low < 1e38F ? range.low : 0.0F, range.low + 1.0F};
  if (!(range.low < range.high)) range = {0.0F, 1.0F};
  host.lowest = double(range.low);
  host.highest = double(range.high);
  return host;
}

std::shared_ptr<const ResidentFrames> upload_frames(const std::shared_ptr<vulkan::Context>& context,
                                                    Kernels& kernels, const MovingVolume& volume) {
  auto resident = std::make_shared<ResidentFrames>();
  resident->sources = volume.frames;
  resident->curved = volume.whole && context->is_cpu();
  const HostFrames host = host_frames(volume);
  resident->place = host.place;
  resident->spacing_mm = host.spacing_mm;
  resident->lowest = host.lowest;
  resident->highest = host.highest;
  FrameUpload upload(context, kernels, resident->place);
  for (const HostFrames::Frame& frame : host.frames)
    resident->images.push_back(
        upload.put(frame.values, resident->curved ? frame.smoothed : frame.side, *resident));
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
  set_place(*resident, place, frames);

  const size_t count = count_of(place);
  vulkan::Buffer staging(context, 16 * count, vulkan::Buffer::Kind::kHostVisible);
  const std::span<glm::vec4> staged = staging.as<glm::vec4>();
  const bool closes = volume.times.cyclic() && step + 1 == steps.size() && step > 0;
  std::optional<Closing> closing;
  if (closes) closing.emplace(steps, place);
  const std::span<const glm::vec4> samples = map->samples();
  const double cost = (closes ? 60.0 : 10.0) * place.size.x * place.size.y;
  parallel_ranges(place.size.z, cost, [&](int begin, int end) {
    size_t at = size_t(begin) * size_t(place.size.x) * size_t(place.size.y);
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < place.size.y; ++j)
        for (int i = 0; i < place.size.x; ++i, ++at) {
          glm::dvec3 u(samples[at]);
          if (closing) u += (*closing)(i, j, k);
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

std::shared_ptr<const ResidentTerms> upload_terms(const std::shared_ptr<vulkan::Context>& context,
                                                  const ResidentFrames& frames,
                                                  const SequenceMap& map) {
  auto resident = std::make_shared<ResidentTerms>();
  // Rays read trilinear, the hand its spline. At the motion's own samples they are 0.10 voxels
  // apart at one place in twenty (heart_cine), twice as fine a quarter of that, for eight times the
  // memory.
  const double fine_bytes =
      8.0 * double(count_of(map.place())) * double(map.basis().summands()) * sizeof(glm::vec4);
  const SequenceMap::Samples samples = map.samples(fine_bytes <= kMostTermBytes ? 2 : 1);
  set_place(resident->place, samples.place, frames);
  const size_t count = count_of(samples.place), terms = map.basis().summands();
  vulkan::Buffer staging(context, 16 * count * terms, vulkan::Buffer::Kind::kHostVisible);
  const std::span<glm::vec4> staged = staging.as<glm::vec4>();
  const glm::mat3 voxel_from_m(frames.place.index_from_volume);
  parallel_ranges(int(terms), 10.0 * double(count), [&](int begin, int end) {
    for (size_t n = size_t(begin); n < size_t(end); ++n)
      for (size_t s = 0; s < count; ++s) {
        staged[n * count + s] = glm::vec4(voxel_from_m * samples.u_m[n * count + s], 0.0F);
      }
  });
  resident->terms = vulkan::Buffer(context, staging.bytes());
  vulkan::Recorder recorder(context, 1);
  recorder.copy(staging, resident->terms, staging.bytes());
  recorder.run();
  resident->texels = vulkan::TexelView(context, resident->terms, VK_FORMAT_R32G32B32A32_SFLOAT);
  return resident;
}

int next_frame(const MovingVolume& volume, int frame) {
  if (frame + 1 < int(volume.frames.size())) return frame + 1;
  return volume.times.cyclic() ? 0 : frame;
}

std::shared_ptr<const ResidentStep> bound_step(const std::shared_ptr<vulkan::Context>& context,
                                               Kernels& kernels, const ResidentFrames& frames,
                                               int frame, int next,
                                               std::shared_ptr<const ResidentField> field) {
  using view_shaders::kPart;
  auto step = std::make_shared<ResidentStep>();
  const glm::ivec3 parts = (frames.place.size + kPart - 1) / kPart;
  const uint64_t count = uint64_t(parts.x) * uint64_t(parts.y) * uint64_t(parts.z);
  step->parts = vulkan::Buffer(context, count * sizeof(view_shaders::PartRange));
  view_shaders::RangesPush push{};
  push.size = glm::ivec4(frames.place.size, field ? 1 : 0);
  push.parts = glm::ivec4(parts, 0);
  if (field) {
    push.field_size = glm::ivec4(field->size, 0);
    set_rows(*field, push.field_from);
  }
  const auto image = [&](int k) {
    return vulkan::Binding(frames.images[size_t(k)], kernels.nearest());
  };
  // Something has to be bound where there is no field; it is not read.
  const vulkan::Binding field_image =
      field ? vulkan::Binding(field->image, kernels.nearest()) : image(frame);
  vulkan::Recorder recorder(context, 1);
  recorder.dispatch(kernels.ranges(frames.curved),
                    {image(frame), image(next), field_image, step->parts}, push,
                    {(parts.x + 63) / 64, parts.y, parts.z});
  recorder.run();
  step->field = std::move(field);
  return step;
}

void set_rows(const ResidentField& field, glm::vec4 (&rows)[3]) {
  for (int row = 0; row < 3; ++row)
    rows[row] = glm::vec4(field.from_voxel[0][row], field.from_voxel[1][row],
                          field.from_voxel[2][row], field.offset[row]);
}

}  // namespace palpate::view
