#include <algorithm>

#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Soft tissue: pushes the hand out of it the more, the deeper it is in, without a surface: the
/// strength is a function of the scalar (a segment's depth in mm), along its slope. Where the slope
/// is less than `gain` per mm (between two walls it is zero) the force is less by as much, so that
/// it has no step anywhere.
class Tissue final : public Mode {
 public:
  explicit Tissue(const ModeSpec& spec)
      : of_distance_(!spec.segment.empty()),
        strength_(spec.strength),
        full_slope_per_m_(1e3 * spec.gain) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    double value = at.data.scalar();
    const bool reaches = of_distance_ && at.ball;
    if (!reaches && !(strength_(value) > 0.0)) return;
    const glm::dvec3 deeper = at.data.vector();
    const double slope = glm::length(deeper);
    if (!(slope > 0.0)) return;
    // A ball is as deep as its deepest point.
    if (reaches) value += 1e3 * at.ball->reach_m(deeper / slope);
    const double strength = strength_(value);
    if (!(strength > 0.0)) return;
    out.force(-deeper, strength * std::min(1.0, slope / full_slope_per_m_));
  }

 private:
  bool of_distance_;  ///< it reads a signed distance, mm
  TransferFunction strength_;
  double full_slope_per_m_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_tissue(const ModeSpec& spec) {
  if (!(spec.gain > 0.0))
    return Error{ErrorKind::kBadInput, "Mode \"" + spec.name +
                                           "\" is of kind \"tissue\", whose gain is the slope per "
                                           "mm of full force: give one above 0."};
  return std::shared_ptr<const Mode>(std::make_shared<Tissue>(spec));
}

}  // namespace palpate
