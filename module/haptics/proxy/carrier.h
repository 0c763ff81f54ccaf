#pragma once

#include <glm/glm.hpp>
#include <memory>

#include "module/haptics/proxy/placed.h"
#include "module/haptics/proxy/pose_path.h"
#include "module/haptics/scene/scene.h"
#include "module/scene/playback.h"

namespace palpate {

struct BackTrack;

/// The state of a volume while it runs: its pose and the phase of its sequence. World from volume
/// is one affine map, so a rotated volume costs no more than one that is not.
struct VolumeRun {
  explicit VolumeRun(const SceneVolume& volume);

  const SceneVolume* plan;
  MovingPose pose;
  Playback playback;
  FramePointer pointer;
  int crossed = 0;         ///< the frame border that playback crossed in this haptic frame
  Transform transform;     ///< world from volume, as set()
  glm::dmat3 linear{1.0};  ///< world from volume: x_world = linear * x + offset
  glm::dmat3 inverse{1.0};
  glm::dvec3 offset{0.0};
  /// how far it has gone from MovingVolume::whole_before to `whole`, 0 to 1
  double blended = 1.0;
  double least_scale = 1.0;  ///< of the axes: how large a voxel is in the world

  void set(const Transform& to) noexcept;
  glm::dvec3 world(glm::dvec3 x) const { return linear * x + offset; }
  glm::dvec3 volume(glm::dvec3 x) const { return inverse * (x - offset); }
};

/// What one haptic frame found while it moved a carrier.
struct CarrierReport {
  double residual_m = 0.0;  ///< worst of back-tracking
  int steps = 0;            ///< most of back-tracking
  bool frozen = false;      ///< a point could not be found: the last one is kept
  bool rough = false;       ///< the motion was read where, or near where, q >= 1
  bool not_finite = false;  ///< data were read that are not finite
  double confidence = 1.0;  ///< of the field where the proxy is
};

/// The proxy as a material point of one volume. It moves with the volume's transform and motion
/// field, is set to where the solver puts the proxy, and is where the volume's modes read data and
/// place primitives. Positions in and out are world, m. Real-time safe; one thread.
class Carrier {
 public:
  virtual ~Carrier() = default;
  /// The material point moves with its volume (equations (16) and (22)); call once per haptic
  /// frame, before anything else.
  virtual void carry() noexcept = 0;
  /// Makes the material at `world` the material point: equation (26). False, and nothing changed,
  /// if it can not be found.
  virtual bool go_to(glm::dvec3 world) noexcept = 0;
  /// The same without an earlier point to start from.
  virtual bool put(glm::dvec3 world) noexcept { return go_to(world); }
  /// Places a mode's primitives, carried forward to the world, and the values of their surfaces.
  /// weight scales strengths, cap bounds them (N).
  virtual void place(const SceneMode& mode, glm::dvec3 probe_world, double dt_s, double weight,
                     double cap_n, Placed& out) noexcept = 0;

  /// Where the material point is now.
  glm::dvec3 at() const { return at_; }
  /// The longest way between two samples of the data on a path, m.
  double stride_m() const { return stride_m_; }
  const CarrierReport& report() const { return report_; }
  void clear_report() { report_ = {}; }

  /// A saved material point to return to, for bisection.
  struct Mark {
    glm::dvec3 at, material;
    MotionSample motion;
  };
  Mark mark() const { return {at_, material_, motion_}; }
  void reset(const Mark& mark) {
    at_ = mark.at;
    material_ = mark.material;
    motion_ = mark.motion;
  }
  glm::dvec3 material() const { return material_; }

 protected:
  /// Makes what was found for `world` the material point, and reports it. False, and nothing
  /// changed, if it was not found.
  bool arrive(const BackTrack& found, glm::dvec3 world) noexcept;

  glm::dvec3 at_{0.0};        ///< world
  glm::dvec3 material_{0.0};  ///< the same point in its data frame, volume space
  MotionSample motion_{};     ///< the field there; stays zero where nothing flows
  double stride_m_ = 1e-3;
  double tool_radius_m_ = 0.0;  ///< world; 0: a point
  glm::dvec3 contact_{0.0};     ///< from the middle of a ball of radius 1 to where it last touched
  CarrierReport report_;
};

/// Makes the carrier for a volume and motion; where the data do not move it is one without any
/// time. tool_radius_m: of the ball that touches, world; 0: a point.
std::unique_ptr<Carrier> make_carrier(const SceneCarrier& plan, const VolumeRun& volume,
                                      double tool_radius_m);

}  // namespace palpate
