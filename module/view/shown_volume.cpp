#include "module/view/shown_volume.h"

#include <algorithm>

#include "shaders/interface/view.h"

namespace palpate::view {

using namespace view_shaders;

namespace {

// A thousandth of a voxel: far below what can be seen, and above the rounding of a sum of numbers
// of a few hundred voxels.
constexpr float kCloseVoxels = 1e-3F;

static_assert(kMostTerms == TimeWeights::kMost);

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

ShownFrames shown_frames_of(const ViewVolume& volume, const ResidentVolume& resident) {
  const MovingVolume& source = *resident.source;
  ShownFrames frames;
  if (source.whole) {
    const int last = int(source.times.times_s.size()) - 1;
    frames.frame = frames.next = 0;
    frames.phase = 1.0;
    frames.step = resident.steps[0][0].get();
    frames.moves = true;
    frames.whole = resident.whole.get();
    if (volume.whole_share < 1.0 && resident.whole_before) {
      frames.whole_before = resident.whole_before.get();
      frames.whole_share = std::max(volume.whole_share, 0.0);
    }
    // Without motion: the values at the time of the one frame.
    frames.whole_frame = std::clamp(
        volume.whole_frames ? int(source.whole->reference()) : volume.pointer.frame, 0, last);
    frames.whole_phase = volume.whole_frames ? 0.0 : std::clamp(volume.pointer.phase, 0.0, 1.0);
    return frames;
  }
  frames.frame = std::clamp(volume.pointer.frame, 0, int(source.frames.size()) - 1);
  frames.next = next_frame(source, frames.frame);
  frames.phase = volume.whole_frames ? 0.0 : std::clamp(volume.pointer.phase, 0.0, 1.0);
  frames.blend = volume.blend_values && frames.phase > 0.0;
  const size_t motion = size_t(std::clamp(volume.motion, 0, int(resident.steps.size()) - 1));
  frames.step = resident.steps[motion][size_t(frames.frame)].get();
  frames.moves = frames.phase > 0.0 && frames.step->field;
  return frames;
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
  // What curve.comp makes of values is larger than they are, and needs the digits.
  surface_ = vulkan::Image(
      context_, size_,
      resident_->frames->curved ? VK_FORMAT_R32G32B32A32_SFLOAT : VK_FORMAT_R16G16B16A16_SFLOAT);
  nodes_ = vulkan::Image(context_, node_count_, VK_FORMAT_R32G32B32A32_SFLOAT);
  marks_ = vulkan::Buffer(context_, 4 * product(bricks_));
  near_ = vulkan::Buffer(context_, 4 * product(bricks_));
  list_ = vulkan::Buffer(context_, 4 * (product(bricks_) + 3));
  list_start_ = vulkan::Buffer(context_, 12, vulkan::Buffer::Kind::kHostVisible);
  const std::span<uint32_t> start = list_start_.as<uint32_t>();
  start[0] = 0, start[1] = 1, start[2] = 1;
  for (vulkan::Buffer& distance : distance_)
    distance = vulkan::Buffer(context_, 4 * product(bricks_));
  frozen_ = vulkan::Buffer(context_, 4, vulkan::Buffer::Kind::kHostVisible);
  frozen_.as<uint32_t>()[0] = 0;
}

void ShownVolume::set_resident(std::shared_ptr<const ResidentVolume> resident) {
  resident_ = std::move(resident);
  shown_ = {};
}

bool ShownVolume::record(vulkan::Recorder& recorder, const ShownFrames& frames, bool look_changed,
                         double thin_per_mm, bool long_steps, const LookTables& tables,
                         const vulkan::Buffer& skip) {
  if (fresh_) {
    recorder.prepare(surface_);
    recorder.clear(surface_);
    recorder.prepare(nodes_);
    recorder.clear(nodes_);
  }
  fresh_ = false;
  if (frames == shown_ && !look_changed) return false;
  if (frames.whole) record_motion(recorder, frames);
  record_list(recorder, frames, thin_per_mm < 0.0, long_steps, tables, skip);
  if (frames.moves) record_nodes(recorder, frames);
  record_bricks(recorder, frames, thin_per_mm, tables, skip);
  shown_ = frames;
  return true;
}

void ShownVolume::record_list(vulkan::Recorder& recorder, const ShownFrames& frames,
                              bool everything, bool long_steps, const LookTables& tables,
                              const vulkan::Buffer& skip) {
  const glm::ivec3 parts = blocks_of(size_, kPart);
  recorder.begin_concurrent();
  recorder.fill(marks_, everything ? 0xff : 0);
  recorder.copy(list_start_, list_, list_start_.bytes());
  recorder.end_concurrent();
  MarkPush push{};
  push.parts = glm::ivec4(parts, 0);
  push.bricks = glm::ivec4(bricks_, 0);
  push.table = entries();
  push.phase = glm::vec4(frames.moves ? frames.phase : 0.0, frames.blend ? frames.phase : 0.0,
                         frames.moves ? 1.0 : 0.0, 0.0);
  if (frames.whole) {
    push.field_size = glm::ivec4(frames.whole->place.size, 0);
    set_rows(frames.whole->place, push.field_from);
  }
  // Something has to be bound where there is no such motion; it is not read.
  const vulkan::Image& field = frames.whole ? shown_motion() : nodes_;
  recorder.dispatch(kernels_.mark(frames.whole != nullptr),
                    {frames.step->parts, tables.next_entries, marks_, {field, kernels_.nearest()}},
                    push, rows(parts));
  // Below 0: segments may be longer than an eighth of a brick, see need.comp.
  const int first = frames.whole && long_steps ? -1 - first_skip_word_ : first_skip_word_;
  recorder.dispatch(frames.whole ? kernels_.need() : kernels_.list(), {marks_, near_, list_, skip},
                    BricksPush{glm::ivec4(bricks_, first)}, rows(bricks_));
}

void ShownVolume::record_motion_at(vulkan::Recorder& recorder, const ResidentTerms& terms,
                                   const TimeWeights& time, MotionAt& at) {
  const glm::ivec3 size = terms.place.size;
  if (!at.weights || at.u.size() != size) {
    at.u = vulkan::Image(context_, size, VK_FORMAT_R32G32B32A32_SFLOAT);
    at.weights = vulkan::Buffer(context_, sizeof(glm::vec4) * kMostTerms,
                                vulkan::Buffer::Kind::kFilledByHost);
    recorder.prepare(at.u);
  }
  const std::span<glm::vec4> weights = at.weights.as<glm::vec4>();
  for (size_t n = 0; n < size_t(time.count); ++n)
    weights[n] = glm::vec4(time.weight[n], time.term[n], 0.0F, 0.0F);
  // As texels they may be more than a storage buffer binds; something is bound there all the same.
  const bool as_texels = terms.texels.whole();
  recorder.dispatch(kernels_.motion_at(as_texels),
                    {at.weights, terms.texels, at.u, as_texels ? at.weights : terms.terms},
                    MotionAtPush{glm::ivec4(size, time.count)}, rows(size));
}

void ShownVolume::record_motion(vulkan::Recorder& recorder, const ShownFrames& frames) {
  const MovingVolume& source = *resident_->source;
  record_motion_at(recorder, *frames.whole,
                   source.whole->basis().at(frames.whole_frame, frames.whole_phase), motion_);
  if (!frames.whole_before) {
    on_the_way_.reset();
    return;
  }
  const glm::ivec3 size = frames.whole->place.size;
  if (!on_the_way_ || on_the_way_->blended.size() != size) {
    on_the_way_.emplace();
    on_the_way_->blended = vulkan::Image(context_, size, VK_FORMAT_R32G32B32A32_SFLOAT);
    recorder.prepare(on_the_way_->blended);
  }
  record_motion_at(recorder, *frames.whole_before,
                   source.whole_before->basis().at(frames.whole_frame, frames.whole_phase),
                   on_the_way_->before);
  MotionBlendPush push{};
  push.size = glm::ivec4(size, 0);
  push.share.x = float(frames.whole_share);
  // From an index of the one field to a voxel, and on to an index of the other.
  const ResidentField &after = frames.whole->place, &before = frames.whole_before->place;
  ResidentField between;
  between.from_voxel = before.from_voxel * glm::inverse(after.from_voxel);
  between.offset = before.offset - between.from_voxel * after.offset;
  set_rows(between, push.before_from);
  recorder.dispatch(kernels_.motion_blend(),
                    {{motion_.u, kernels_.nearest()},
                     {on_the_way_->before.u, kernels_.linear()},
                     on_the_way_->blended},
                    push, rows(size));
}

void ShownVolume::record_nodes(vulkan::Recorder& recorder, const ShownFrames& frames) {
  const ResidentField& field = frames.whole ? frames.whole->place : *frames.step->field;
  const vulkan::Image& image = frames.whole ? shown_motion() : field.image;
  TrackPush push{};
  // The result of the same step is a good start, and is kept where nothing is found.
  const bool warm = shown_.moves && (shown_.step == frames.step || (shown_.whole && frames.whole));
  push.nodes = glm::ivec4(node_count_, warm ? 1 : 0);
  push.field_size = glm::ivec4(field.size, 0);
  set_rows(field, push.field_from);
  push.phase = glm::vec4(frames.phase, kCloseVoxels, frames.whole ? 1.0F : 0.0F,
                         resident_->frames->curved ? 0.0F : 1.0F);
  push.bricks = glm::ivec4(bricks_, 0);
  recorder.fill(frozen_, 0);
  recorder.dispatch(
      kernels_.track(),
      {{image, kernels_.nearest()}, {nodes_, kernels_.nearest()}, nodes_, frozen_, near_}, push,
      rows(node_count_));
}

void ShownVolume::record_bricks(vulkan::Recorder& recorder, const ShownFrames& frames,
                                double thin_per_mm, const LookTables& tables,
                                const vulkan::Buffer& skip) {
  BrickPush push{};
  push.size = glm::ivec4(size_, 0);
  push.bricks = glm::ivec4(bricks_, first_skip_word_);
  push.nodes = glm::vec4(glm::vec3(node_count_), 0.0F);
  const double share = frames.blend ? frames.phase : 0.0;
  // Below a thousandth the next frame's weight is invisible, and 1 / phase would be too large.
  push.frames = glm::vec4(1.0 - share, share, thin_per_mm, 1.0 / std::max(frames.phase, 1e-3));
  push.table = entries();
  push.per_mm = glm::vec4(1.0 / resident_->frames->spacing_mm, 0.0);
  const auto& images = resident_->frames->images;
  if (resident_->frames->curved) {
    recorder.dispatch_indirect(kernels_.carry(),
                               {{nodes_, kernels_.nearest()},
                                {images[0], kernels_.linear()},
                                list_,
                                tables.next_entries,
                                tables.most,
                                surface_,
                                skip,
                                near_},
                               &push, list_, 0);
  } else {
    recorder.dispatch_indirect(kernels_.brick(frames.moves, frames.blend),
                               {{nodes_, kernels_.linear()},
                                {images[size_t(frames.frame)], kernels_.linear()},
                                {images[size_t(frames.next)], kernels_.linear()},
                                list_,
                                tables.next_entries,
                                tables.most,
                                surface_,
                                skip},
                               &push, list_, 0);
  }
  for (int axis = 0; axis < 3; ++axis)
    recorder.dispatch(kernels_.distance(axis), {skip, distance_[axis % 2], distance_[1 - axis % 2]},
                      BricksPush{glm::ivec4(bricks_, first_skip_word_)}, rows(bricks_));
}

glm::vec4 ShownVolume::entries() const {
  return {kTable - 1, 0.5F, kTable * slot_, kTable - 1};
}

}  // namespace palpate::view
