#include "module/haptics/proxy/carrier.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "module/haptics/proxy/back_track.h"
#include "module/haptics/proxy/ball_contact.h"
#include "module/haptics/proxy/local_reader.h"
#include "module/haptics/proxy/world_sink.h"
#include "module/scene/cycle_closing.h"
#include "module/scene/drive.h"

namespace palpate {
namespace {

// A path is sampled a little more than twice per voxel, so that a shell one voxel thick can not be
// stepped over.
constexpr double kStridePerVoxel = 0.45;

// The weight of a field by its confidence: 0 below the first, 1 above the second, smooth in
// between.
constexpr double kNoConfidence = 0.10, kFullConfidence = 0.35;

// A determinant below this is a fold: directions there are not to be trusted.
constexpr double kFlattest = 0.02;

// In a field that is not invertible everywhere, q above this is so near to a fold that a piece of
// the way may have led through it.
constexpr double kRough = 0.5;

// A plane counts as standing across the gradient if the cosine is this close to 1: rounding.
constexpr double kAcross = 1e-9;

double worth(double confidence) {
  const double t =
      std::clamp((confidence - kNoConfidence) / (kFullConfidence - kNoConfidence), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// What a mode reads of a frame: its values, or the distance to a segment.
const FrameData& source_of(const SceneMode& mode, const MovingVolume& data, int frame) {
  if (mode.segment < 0) return *data.frames[size_t(frame)];
  return *data.segments[size_t(mode.segment)].distance_mm[size_t(frame)];
}

double squared(const glm::dmat3& m) {
  return glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]);
}

/// Gives the planes from index `first` on the iso-surfaces that they lie on: those that stand at
/// the proxy (`at`, world) across the data's gradient. `derivative` is that of the map from the
/// data frame to the world.
void tell_surface_values(const LocalData& data, const ModeSpec& mode, const glm::dmat3& derivative,
                         glm::dvec3 at, int first, Placed& out) noexcept {
  for (int i = first; i < out.set.count(); ++i) out.surface_value[i] = {};
  if (mode.scalar != ScalarProperty::kValue || first == out.set.count()) return;
  const glm::dvec3 a = derivative[0], b = derivative[1], c = derivative[2];
  const glm::dvec3 bc = glm::cross(b, c), uphill = data.scalar_gradient();
  const glm::dvec3 gradient =
      (uphill.x * bc + uphill.y * glm::cross(c, a) + uphill.z * glm::cross(a, b)) / glm::dot(a, bc);
  const double steepness = glm::length(gradient);
  for (int i = first; i < out.set.count(); ++i) {
    if (out.set[i].kind != Primitive::Kind::kPlane || out.set[i].position != at) continue;
    const double slope = glm::dot(gradient, out.set[i].direction);
    if (std::abs(slope) > (1.0 - kAcross) * steepness)
      out.surface_value[i] = {data.scalar(), slope};
  }
}

/// Data that do not move. The volume may move as a whole; then the point moves with it.
class StillCarrier final : public Carrier {
 public:
  StillCarrier(const VolumeRun& volume, double tool_radius_m)
      : volume_(volume), data_(*volume.plan->data), frame_(*data_.frames.front()) {
    tool_radius_m_ = tool_radius_m;
  }

  void carry() noexcept override {
    at_ = volume_.world(material_);
    set_stride(frame_.detail_m() * volume_.least_scale);
  }
  bool go_to(glm::dvec3 world) noexcept override {
    at_ = world;
    material_ = volume_.volume(world);
    return true;
  }
  void place(const SceneMode& mode, glm::dvec3 probe, double dt_s, double weight, double cap_n,
             Placed& out) noexcept override {
    const FrameData& frame = source_of(mode, data_, 0);
    std::optional<ToolBall> ball;
    glm::dvec3 place = material_;
    if (tool_radius_m_ > 0.0) {
      ball = ball_in_data(tool_radius_m_, volume_.linear);
      if (mode.reads_contact) place = ball_contact(frame, material_, *ball, contact_);
    }
    const StillReader data(frame, mode.spec, place, read_);
    const auto forward = [this](glm::dvec3 x) { return volume_.world(x); };
    WorldSink sink(out, volume_.linear, material_, at_, weight, cap_n, forward);
    const int first = out.set.count();
    mode.mode->place({data, material_, volume_.volume(probe), dt_s, ball ? &*ball : nullptr}, sink);
    tell_surface_values(data, mode.spec, volume_.linear, at_, first, out);
    report_.not_finite |= !data.is_finite();
  }

 private:
  void set_stride(double detail_m) { stride_m_ = kStridePerVoxel * detail_m; }
  const VolumeRun& volume_;
  const MovingVolume& data_;
  const FrameData& frame_;
  LastRead read_;
};

/// What data that move have in common: the modes read them at a material point, whose motion says
/// how what they place comes to the world.
class MovingCarrier : public Carrier {
 public:
  MovingCarrier(const VolumeRun& volume, double tool_radius_m)
      : volume_(volume), data_(*volume.plan->data) {
    tool_radius_m_ = tool_radius_m;
  }

  bool go_to(glm::dvec3 world) noexcept override {
    const glm::dvec3 target = volume_.volume(world);
    if (!arrive(tracked_back(target, near(target)), world)) return false;
    look_for_roughness();
    return true;
  }

  void place(const SceneMode& mode, glm::dvec3 probe, double dt_s, double weight, double cap_n,
             Placed& out) noexcept final {
    report_.confidence = motion_.confidence;
    weight *= worth(motion_.confidence);
    if (!(weight > 0.0)) return;
    // Where the mode's primitives go: through the motion, then with the volume.
    const glm::dmat3 derivative = volume_.linear * stretch();
    const auto to_world = [this](glm::dvec3 x) { return volume_.world(moved(x)); };
    WorldSink sink(out, derivative, material_, at_, weight, cap_n, to_world);
    const glm::dvec3 probe_here = mode.mode->wants_probe() ? hand_in_data(probe) : material_;
    const int first = out.set.count();
    const FrameData& frame = source_of(mode, data_, frame_);
    std::optional<ToolBall> ball;
    glm::dvec3 place = material_;
    if (tool_radius_m_ > 0.0) {
      ball = ball_in_data(tool_radius_m_, derivative);
      if (mode.reads_contact) place = ball_contact(frame, material_, *ball, contact_);
    }
    // The mode reads one frame, or what lies between two.
    const auto place_with = [&](const auto& data) {
      mode.mode->place({data, material_, probe_here, dt_s, ball ? &*ball : nullptr}, sink);
      tell_surface_values(data, mode.spec, derivative, at_, first, out);
      report_.not_finite |= !data.is_finite();
    };
    if (const std::optional<int> next = blended_frame())
      place_with(BlendedReader(frame, source_of(mode, data_, *next), mode.spec, place,
                               in_next(place), motion_.jacobian, volume_.pointer.phase, read_,
                               read_next_));
    else
      place_with(StillReader(frame, mode.spec, place, read_));
  }

 protected:
  /// Where a place of the data frame is now, volume space.
  virtual glm::dvec3 moved(glm::dvec3 x) noexcept = 0;
  /// The derivative of that at the material point.
  virtual glm::dmat3 moved_gradient() const noexcept = 0;
  /// The place of the data frame that is at `target` now.
  virtual BackTrack tracked_back(glm::dvec3 target, glm::dvec3 start) noexcept = 0;
  /// Where the search for the hand's place begins.
  virtual glm::dvec3 hand_start(glm::dvec3 target) const noexcept = 0;
  /// The motion may not be invertible everywhere.
  virtual bool may_fold() const noexcept = 0;
  /// The frame to which the data are blended, and the material point in it; empty: none.
  virtual std::optional<int> blended_frame() const noexcept { return std::nullopt; }
  virtual glm::dvec3 material_in_next() const noexcept { return material_; }
  /// Where a place near the material point is in it.
  glm::dvec3 in_next(glm::dvec3 place) const noexcept {
    const glm::dvec3 aside = place - material_;
    if (aside == glm::dvec3(0.0)) return material_in_next();
    return material_in_next() + aside + motion_.jacobian * aside;
  }

  /// The material at a place near the point: as far from it as now.
  glm::dvec3 near(glm::dvec3 target) const noexcept {
    return material_ + (target - volume_.volume(at_));
  }
  /// A motion from one reference frame is large and steep, but still has an inverse wherever it
  /// does not fold; so has a step whose contraction is below 1.
  void look_for_roughness() noexcept {
    if (may_fold()) report_.rough |= squared(motion_.jacobian) >= kRough * kRough;
  }
  void set_stride() noexcept {
    stride_m_ = kStridePerVoxel * data_.frames[size_t(frame_)]->detail_m() * volume_.least_scale;
  }

  const VolumeRun& volume_;
  const MovingVolume& data_;
  int frame_ = 0;  ///< whose data are read

 private:
  /// The deformation gradient at the point, from the data frame to now. In a fold it would turn
  /// surfaces inside out, so there the last valid one is used.
  const glm::dmat3& stretch() noexcept {
    const glm::dmat3 now = moved_gradient();
    if (glm::determinant(now) > kFlattest) stretch_ = now;
    return stretch_;
  }
  /// The hand's place in the data frame. If it can not be found the proxy's place is given, and
  /// that is no failure of the proxy.
  glm::dvec3 hand_in_data(glm::dvec3 probe) noexcept {
    const glm::dvec3 target = volume_.volume(probe);
    const BackTrack found = tracked_back(target, hand_start(target));
    return found.ok ? found.x_m : material_;
  }

  glm::dmat3 stretch_{1.0};
  LastRead read_, read_next_;
};

/// Data that move and change: the point is kept in the coordinates of the frame the sequence stands
/// in.
class FlowingCarrier final : public MovingCarrier {
 public:
  FlowingCarrier(const VolumeRun& volume, const Motion* motion, double tool_radius_m)
      : MovingCarrier(volume, tool_radius_m),
        motion_of_(motion),
        method_(volume.plan->spec.back_tracking),
        blend_(volume.plan->blends) {}

  void carry() noexcept override {
    if (volume_.crossed > 0) enter_next();
    if (volume_.crossed < 0) enter_previous();
    frame_ = volume_.pointer.frame;
    const MotionMap* map = step(frame_);
    motion_ = map ? map->sample(material_) : MotionSample{glm::dvec3(0.0), glm::dmat3(0.0), 1.0};
    at_ = volume_.world(forward(material_, motion_.u_m));
    look_for_roughness();
    set_stride();
  }

  bool go_to(glm::dvec3 world) noexcept override {
    if (step(frame_)) return MovingCarrier::go_to(world);
    material_ = volume_.volume(world);
    at_ = world;
    return true;
  }

  bool put(glm::dvec3 world) noexcept override {
    closing_ = glm::dvec3(0.0);
    if (!go_to(world)) return false;
    set_closing();
    return closing_ == glm::dvec3(0.0) || go_to(world);
  }

 protected:
  glm::dvec3 moved(glm::dvec3 x) noexcept override {
    const MotionMap* map = step(frame_);
    return map ? forward(x, map->displacement(x)) : x;
  }
  glm::dmat3 moved_gradient() const noexcept override {
    return glm::dmat3(1.0) + volume_.pointer.phase * motion_.jacobian;
  }
  BackTrack tracked_back(glm::dvec3 target, glm::dvec3 start) noexcept override {
    const MotionMap* map = step(frame_);
    if (map) return back_track(*map, volume_.pointer.phase, target, start, closing_, method_);
    BackTrack still;
    still.ok = true;
    still.x_m = target;
    return still;
  }
  glm::dvec3 hand_start(glm::dvec3 target) const noexcept override { return target; }
  bool may_fold() const noexcept override {
    const MotionMap* map = step(frame_);
    return map && !(map->worst_contraction() < 1.0F);
  }
  std::optional<int> blended_frame() const noexcept override {
    if (!blend_ || !(volume_.pointer.phase > 0.0)) return std::nullopt;
    if (frame_ + 1 < int(data_.frames.size())) return frame_ + 1;
    return data_.times.cyclic() ? 0 : frame_;
  }
  glm::dvec3 material_in_next() const noexcept override {
    return material_ + motion_.u_m + closing_;
  }

 private:
  const MotionMap* step(int frame) const {
    return motion_of_ && frame < int(motion_of_->steps.size()) ? motion_of_->steps[frame].get()
                                                               : nullptr;
  }
  glm::dvec3 forward(glm::dvec3 x, glm::dvec3 u) const {
    return x + volume_.pointer.phase * (u + closing_);
  }

  /// Case B: the step is done, whole: the material point is one of the next frame's now.
  void enter_next() noexcept {
    if (const MotionMap* map = step(frame_)) material_ += map->displacement(material_) + closing_;
    set_closing();
  }

  /// Case B backwards: the point of the frame before that comes to here.
  void enter_previous() noexcept {
    const int frame = volume_.pointer.frame;
    closing_ = glm::dvec3(0.0);
    if (closes(frame)) closing_ = closing_backward(motion_of_->steps, material_);
    const MotionMap* map = step(frame);
    if (!map) return;
    const glm::dvec3 start = material_ - map->displacement(material_) - closing_;
    const BackTrack found = back_track(*map, 1.0, material_, start, closing_, method_);
    report_.steps = std::max(report_.steps, found.steps);
    if (found.ok)
      material_ = found.x_m;
    else
      report_.frozen = true;
  }

  bool closes(int frame) const {
    return data_.times.cyclic() && motion_of_ && frame + 1 == int(motion_of_->steps.size()) &&
           frame > 0;
  }
  void set_closing() noexcept {
    closing_ = closes(volume_.pointer.frame) ? closing_forward(motion_of_->steps, material_)
                                             : glm::dvec3(0.0);
  }

  const Motion* motion_of_;
  BackTracking method_;
  bool blend_;
  glm::dvec3 closing_{0.0};  ///< of the last step of a cycle, for the material the proxy is on
};

/// One frame's values carried by one motion for all times: the material point is a place of that
/// frame, and time only says where it is now. There are no borders between frames.
class MaterialCarrier final : public MovingCarrier {
 public:
  MaterialCarrier(const VolumeRun& volume, double tool_radius_m)
      : MovingCarrier(volume, tool_radius_m), now_(*data_.whole, data_.whole->basis().at(0, 0.0)) {
    if (data_.whole_before)
      before_.emplace(*data_.whole_before, data_.whole_before->basis().at(0, 0.0));
    set_stride();
  }

  void carry() noexcept override {
    now_.set(now_.map().basis().at(volume_.pointer.frame, volume_.pointer.phase));
    const double way = volume_.blended;
    if (before_ && way < 1.0) {
      before_->set(before_->map().basis().at(volume_.pointer.frame, volume_.pointer.phase));
      now_.blend_from(&*before_, share_of_better(way));
    } else {
      now_.blend_from(nullptr, 1.0);
    }
    motion_ = now_.sample(material_);
    at_ = volume_.world(material_ + motion_.u_m);
    look_for_roughness();
    set_stride();
  }

 protected:
  glm::dvec3 moved(glm::dvec3 x) noexcept override { return x + now_.displacement(x); }
  glm::dmat3 moved_gradient() const noexcept override { return glm::dmat3(1.0) + motion_.jacobian; }
  BackTrack tracked_back(glm::dvec3 target, glm::dvec3 start) noexcept override {
    return back_track(now_, target, start);
  }
  glm::dvec3 hand_start(glm::dvec3 target) const noexcept override { return near(target); }
  bool may_fold() const noexcept override { return now_.may_fold(); }

 private:
  SequenceSnapshot now_;
  std::optional<SequenceSnapshot> before_;  ///< while the volume goes from one motion to another
};

}  // namespace

bool Carrier::arrive(const BackTrack& found, glm::dvec3 world) noexcept {
  report_.steps = std::max(report_.steps, found.steps);
  if (!found.ok) {
    report_.frozen = true;
    return false;
  }
  report_.residual_m = std::max(report_.residual_m, found.residual_m);
  material_ = found.x_m;
  motion_ = found.at;
  at_ = world;
  return true;
}

namespace {

/// Only keys put a volume elsewhere than its own transform at the start.
Transform first_of(const VolumeSpec& spec) {
  return spec.drive.kind == DriveSpec::Kind::kKeys ? driven(spec.drive, spec.transform, 0.0)
                                                   : spec.transform;
}

}  // namespace

VolumeRun::VolumeRun(const SceneVolume& volume)
    : plan(&volume),
      pose(volume.spec.path, first_of(volume.spec)),
      playback(&volume.data->times),
      blended(volume.data->whole_before ? 0.0 : 1.0) {
  playback.set_rate(volume.spec.rate);
  set(first_of(volume.spec));
}

void VolumeRun::set(const Transform& to) noexcept {
  transform = to;
  linear = transform.linear();
  offset = transform.translation_m;
  // R S: its inverse is S^-1 R^T, exact where a general inverse would only be close.
  inverse = glm::transpose(glm::mat3_cast(transform.rotation));
  for (int c = 0; c < 3; ++c) inverse[c] /= transform.scale;
  least_scale = std::min({transform.scale.x, transform.scale.y, transform.scale.z});
}

std::unique_ptr<Carrier> make_carrier(const SceneCarrier& plan, const VolumeRun& volume,
                                      double tool_radius_m) {
  switch (volume.plan->phase) {
    case DataStage::kStill:
      return std::make_unique<StillCarrier>(volume, tool_radius_m);
    case DataStage::kMaterial:
      return std::make_unique<MaterialCarrier>(volume, tool_radius_m);
    case DataStage::kFrames:
      break;
  }
  return std::make_unique<FlowingCarrier>(volume, plan.motion, tool_radius_m);
}

}  // namespace palpate
