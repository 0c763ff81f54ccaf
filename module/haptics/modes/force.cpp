#include <algorithm>
#include <cmath>

#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Force functions, equations (2) and (3): f = C grad L or f = C L, pushing the hand directly. The
/// strength's transfer function, where one is given, is the most it may push with; nothing else
/// bounds a gradient.
class Force final : public Mode {
 public:
  explicit Force(const ModeSpec& spec) : gain_(spec.gain), most_(spec.strength) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    const glm::dvec3 vector = at.data.vector();
    const double size = glm::length(vector);
    if (!(size > 0.0)) return;
    const double strength = std::min(std::abs(gain_) * size, most_(size));
    out.force(gain_ < 0.0 ? -vector : vector, strength);
  }

 private:
  double gain_;
  TransferFunction most_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_force(const ModeSpec& spec) {
  ModeSpec bounded = spec;
  if (bounded.strength.in().empty()) bounded.strength = TransferFunction::constant(4.0);
  return std::shared_ptr<const Mode>(std::make_shared<Force>(bounded));
}

}  // namespace palpate
