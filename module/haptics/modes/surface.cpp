#include <algorithm>
#include <cmath>

#include "module/haptics/modes/modes.h"
#include "module/scene/segment_modes.h"

namespace palpate {
namespace {

// A slope below this share of the value, per m, is only rounding between equal samples.
constexpr double kFlat_per_m = 1e-9;

constexpr double kMm_per_m = 1e3;

/// Surface and friction, equation (12): a plane across the gradient at the proxy, as strong as the
/// transfer function says, with Coulomb friction. It holds the hand out of higher values (or in
/// them, or both ways); a force above its strength goes through.
class Surface final : public Mode {
 public:
  explicit Surface(const ModeSpec& spec)
      : of_distance_(!spec.segment.empty()),
        strength_(spec.strength),
        friction_(spec.friction),
        entering_(spec.two_sided || !spec.leaving),
        leaving_(spec.two_sided || spec.leaving) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    const double value = at.data.scalar();
    if (of_distance_ && at.ball) return place_ball(value, at, out);
    double strength = strength_(value);
    if (!(strength > 0.0)) return;
    const glm::dvec3 uphill = at.data.vector();
    // Flat, but for rounding: there is no surface to stand on.
    if (!(glm::length(uphill) > kFlat_per_m * std::abs(value))) return;
    if (of_distance_) strength = sure_strength(strength, glm::length(uphill) / kMm_per_m);
    const double friction = friction_(value);
    if (entering_) out.surface(at.proxy, -uphill, strength, friction);
    if (leaving_) out.surface(at.proxy, uphill, strength, friction);
  }

 private:
  /// A ball is as deep behind a surface as its middle and its reach towards it: exact wherever the
  /// distance is, also where two walls meet.
  void place_ball(double middle_mm, const ModePoint& at, PrimitiveSink& out) const noexcept {
    const glm::dvec3 uphill = at.data.vector();
    const double slope = glm::length(uphill);
    if (!(slope > kFlat_per_m * std::abs(middle_mm))) return;
    const double reach_mm = kMm_per_m * at.ball->reach_m(uphill / slope);
    if (const double mm = middle_mm + reach_mm; entering_)
      out.surface(at.proxy, -uphill, sure_strength(strength_(mm), slope / kMm_per_m),
                  friction_(mm));
    if (const double mm = middle_mm - reach_mm; leaving_)
      out.surface(at.proxy, uphill, sure_strength(strength_(mm), slope / kMm_per_m), friction_(mm));
  }

  bool of_distance_;  ///< it reads a signed distance, mm
  TransferFunction strength_, friction_;
  bool entering_, leaving_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_surface(const ModeSpec& spec) {
  return std::shared_ptr<const Mode>(std::make_shared<Surface>(spec));
}

}  // namespace palpate
