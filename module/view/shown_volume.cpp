#include "module/view/shown_volume.h"

#include <algorithm>

#include "shaders/interface/view.h"

namespace palpate::view {

using namespace view_shaders;

namespace {

// A thousandth of a voxel: far below what can be seen, and above the rounding of a sum of numbers
// of a few hundred voxels.
constexpr float kCloseVoxels = 1e-3F;

glm::ivec3 blocks_of(glm::ivec3 size, int edge) {
  return (size + edge - 1) / edge;
}

uint64_t product(glm::ivec3 size) {
  return uint64_t(size.x) * uint64_t(size.y) * uint64_t(size.z);
}

glm::ivec3 rows(glm::ivec3 size) {
  return {(size.x + 63) / 64, size.y, size.z};
}

}  // namespace

Moment moment_of(const ViewVolume& volume, const ResidentVolume& resident) {
  const int frames = int(resident.frames->images.size());
  Moment moment;
  moment.frame = std::clamp(volume.pointer.frame, 0, frames - 1);
  const bool last = moment.frame + 1 == frames;
  moment.next = last ? (resident.source->times.cyclic() ? 0 : moment.frame) : moment.frame + 1;
  moment.phase = volume.whole_frames ? 0.0 : std::clamp(volume.pointer.phase, 0.0, 1.0);
  moment.blend = volume.blend_values && moment.phase > 0.0;
  if (moment.phase > 0.0 && volume.motion >= 0 && volume.motion < int(resident.fields.size())) {
    const auto& steps = resident.fields[size_t(volume.motion)];
    if (moment.frame < int(steps.size())) moment.field = steps[size_t(moment.frame)].get();
  }
  return moment;
}

int ShownVolume::skip_words(const ResidentVolume& resident) {
  return kSkipWords * int(product(blocks_of(resident.frames->place.size, kBrick)));
}

ShownVolume::ShownVolume(std::shared_ptr<vulkan::Context> context, Kernels& kernels,
                         std::shared_ptr<const ResidentVolume> resident, int slot,
                         int first_skip_word)
    : context_(std::move(context)),
      kernels_(kernels),
      resident_(std::move(resident)),
      slot_(slot),
      first_skip_word_(first_skip_word),
      size_(resident_->frames->place.size),
      bricks_(blocks_of(size_, kBrick)),
      node_count_((size_ - 1) / kNode + 2) {
  // A CPU reads 32-bit floats faster than it converts 16-bit ones; a GPU's texture unit and memory
  // are twice as fast with half the bytes.
  surface_ = vulkan::Image(
      context_, size_,
      context_->is_cpu() ? VK_FORMAT_R32G32B32A32_SFLOAT : VK_FORMAT_R16G16B16A16_SFLOAT);
  for (vulkan::Image& nodes : nodes_)
    nodes = vulkan::Image(context_, node_count_, VK_FORMAT_R32G32B32A32_SFLOAT);
  values_ = vulkan::Buffer(context_, 4 * product(size_));
  for (vulkan::Buffer& distance : distance_)
    distance = vulkan::Buffer(context_, 4 * product(bricks_));
  held_ = vulkan::Buffer(context_, 4, vulkan::Buffer::Kind::kHostVisible);
}

void ShownVolume::set_resident(std::shared_ptr<const ResidentVolume> resident) {
  resident_ = std::move(resident);
  shown_ = {};
}

void ShownVolume::record(vulkan::Recorder& recorder, const Moment& moment, bool look_changed,
                         const vulkan::Buffer& next_entries, const vulkan::Buffer& skip) {
  if (fresh_) {
    recorder.prepare(surface_);
    for (vulkan::Image& nodes : nodes_) {
      recorder.prepare(nodes);
      recorder.clear(nodes);
    }
  }
  const bool moved = !(moment == shown_);
  if (moved) {
    if (moment.field) record_nodes(recorder, moment);
    record_values(recorder, moment);
  }
  if (moved || look_changed) record_surface(recorder, next_entries, skip);
  shown_ = moment;
  fresh_ = false;
}

void ShownVolume::record_nodes(vulkan::Recorder& recorder, const Moment& moment) {
  const ResidentField& field = *moment.field;
  TrackPush push{};
  // What was found in the same step is a good start, and what is held where nothing is found.
  push.nodes = glm::ivec4(node_count_, shown_.field == moment.field ? 1 : 0);
  push.field_size = glm::ivec4(field.size, 0);
  for (int row = 0; row < 3; ++row)
    push.field_from[row] = glm::vec4(field.from_voxel[0][row], field.from_voxel[1][row],
                                     field.from_voxel[2][row], field.offset[row]);
  push.phase = glm::vec4(moment.phase, kCloseVoxels, 0.0F, 0.0F);
  recorder.fill(held_, 0);
  const vulkan::Image& from = nodes_[newest_nodes_];
  newest_nodes_ = 1 - newest_nodes_;
  recorder.dispatch(
      kernels_.track(),
      {{field.image, kernels_.nearest()}, {from, kernels_.nearest()}, nodes_[newest_nodes_], held_},
      push, rows(node_count_));
}

void ShownVolume::record_values(vulkan::Recorder& recorder, const Moment& moment) {
  ResamplePush push{};
  push.size = glm::ivec4(size_, 0);
  push.nodes = glm::vec4(glm::vec3(node_count_), moment.field ? float(moment.phase) : 0.0F);
  const float share = moment.blend ? float(moment.phase) : 0.0F;
  push.frames = glm::vec4(1.0F - share, share, 0.0F, 0.0F);
  const auto& images = resident_->frames->images;
  recorder.dispatch(kernels_.resample(),
                    {{nodes_[newest_nodes_], kernels_.linear()},
                     {images[size_t(moment.frame)], kernels_.linear()},
                     {images[size_t(moment.next)], kernels_.linear()},
                     values_},
                    push, rows(size_));
}

void ShownVolume::record_surface(vulkan::Recorder& recorder, const vulkan::Buffer& next_entries,
                                 const vulkan::Buffer& skip) {
  SurfacePush push{};
  push.size = glm::ivec4(size_, 0);
  push.bricks = glm::ivec4(bricks_, first_skip_word_);
  push.table = glm::vec4(kTable - 1, 0.5F, kTable * slot_, kTable - 1);
  push.per_mm = glm::vec4(1.0 / resident_->frames->spacing_mm, 0.0);
  recorder.dispatch(kernels_.surface(), {values_, next_entries, surface_, skip}, push, bricks_);
  for (int axis = 0; axis < 3; ++axis) {
    const DistancePush distance{glm::ivec4(bricks_, first_skip_word_)};
    recorder.dispatch(kernels_.distance(axis), {skip, distance_[axis % 2], distance_[1 - axis % 2]},
                      distance, rows(bricks_));
  }
}

}  // namespace palpate::view
