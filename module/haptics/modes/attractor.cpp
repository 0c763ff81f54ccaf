#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Pulls to a point of the data, which moves with them. The strength is a function of the scalar at
/// the hand; with a range it falls to zero at that distance, so that entering its reach is no step.
class Attractor final : public Mode {
 public:
  explicit Attractor(const ModeSpec& spec)
      : strength_(spec.strength), point_m_(spec.point_m), range_m_(spec.range_m) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    double strength = strength_(at.data.scalar());
    if (range_m_ > 0.0) {
      const double near = 1.0 - glm::length(at.proxy - point_m_) / range_m_;
      if (!(near > 0.0)) return;
      strength *= near;
    }
    out.point(point_m_, strength);
  }

 private:
  TransferFunction strength_;
  glm::dvec3 point_m_;
  double range_m_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_attractor(const ModeSpec& spec) {
  return std::shared_ptr<const Mode>(std::make_shared<Attractor>(spec));
}

}  // namespace palpate
