#pragma once

#include <array>
#include <glm/glm.hpp>

#include "module/haptics/primitive.h"

namespace palpate {

/// The data as a mode may read them: at one point and one time. Time, transforms and devices stay
/// outside. What "scalar" and "vector" are (the value, a gradient, a curl, ...) is chosen in the
/// scene, not here. Space: the volume's own, m. Values are read when asked for and kept, so asking
/// twice costs nothing. Real-time safe.
class LocalData {
 public:
  virtual double scalar() const noexcept = 0;               ///< in the data's unit
  virtual glm::dvec3 scalar_gradient() const noexcept = 0;  ///< per metre; zero where the data end
  /// In the data's unit, along volume space's axes.
  virtual glm::dvec3 vector() const noexcept = 0;

 protected:
  ~LocalData() = default;
};

/// The ball at the tip of the tool as a data frame sees it: an ellipsoid where the data or their
/// volume are stretched. Space: the volume's own, m.
struct ToolBall {
  glm::dmat3 data_from_ball{0.0};  ///< takes the ball of radius 1 to it

  /// How far it reaches along a direction of unit length, m.
  double reach_m(glm::dvec3 along) const {
    return glm::length(along * data_from_ball);  // v * M is M transposed times v
  }
};

/// What a mode sees of the scene in one haptic frame. Space: the volume's own (of its data frame),
/// m.
struct ModePoint {
  const LocalData& data;  ///< at the proxy
  glm::dvec3 proxy;       ///< where the proxy is: constraints belong here
  glm::dvec3 probe;  ///< where the hand is, taken back to the data frame (only if wants_probe())
  double dt_s;       ///< length of this haptic frame
  const ToolBall* ball = nullptr;  ///< null: the tool is a point
};

/// Takes a mode's primitives and carries them to where the data are now: positions as points,
/// normals as normals (they stay perpendicular to the surface under any stretch), tangents as
/// tangents. Real-time safe.
class PrimitiveSink {
 public:
  /// A one-sided surface that holds the proxy on the side `outward` points to, with Coulomb
  /// friction. outward: any length > 0.
  virtual void surface(glm::dvec3 position, glm::dvec3 outward, double strength_n,
                       double friction = 0.0) noexcept = 0;
  /// Holds the proxy on a line along `tangent` (a direction in the material, as a field line is).
  virtual void line(glm::dvec3 position, glm::dvec3 tangent, double strength_n) noexcept = 0;
  /// Pulls to a point.
  virtual void point(glm::dvec3 position, double strength_n) noexcept = 0;
  /// A force in N along a direction in the material, of any length.
  virtual void force(glm::dvec3 tangent, double strength_n) noexcept = 0;
  /// Slows the proxy down against the material, N s/m: the force is this coefficient times the
  /// velocity of the proxy relative to the material. What is placed where a haptic frame begins
  /// holds for the whole frame.
  virtual void drag(double n_s_per_m) noexcept = 0;

 protected:
  ~PrimitiveSink() = default;
};

/// A haptic mode: turns local data into primitives. Knows nothing of time, transforms or devices.
/// Immutable: place() is called from the servo thread while others may hold the same object; it
/// must be real-time safe (no allocation, lock, log or exception). All primitives of one haptic
/// frame of a scene go into one balance.
class Mode {
 public:
  virtual ~Mode() = default;
  virtual void place(const ModePoint& at, PrimitiveSink& out) const noexcept = 0;
  /// True if it reads ModePoint::probe: taking the probe back costs as much as taking the proxy
  /// back.
  virtual bool wants_probe() const { return false; }
};

/// A mode with code from outside, not bound to the rules of Mode: it may fail while it is felt.
class ForeignMode : public Mode {
 public:
  /// The reason why it places nothing any more, in one sentence; "" as long as it works. Any
  /// thread.
  virtual const char* failure() const noexcept = 0;
};

}  // namespace palpate
