#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Front shape: a surface across a vector field, as a wave front or an iso-surface of a potential.
/// It holds the hand from going along the vector; two-sided it holds both ways.
class Front final : public Mode {
 public:
  explicit Front(const ModeSpec& spec) : strength_(spec.strength), two_sided_(spec.two_sided) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    const glm::dvec3 along = at.data.vector();
    const double size = glm::length(along);
    if (!(size > 0.0)) return;
    const double strength = strength_(size);
    out.surface(at.proxy, -along, strength);
    if (two_sided_) out.surface(at.proxy, along, strength);
  }

 private:
  TransferFunction strength_;
  bool two_sided_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_front(const ModeSpec& spec) {
  return std::shared_ptr<const Mode>(std::make_shared<Front>(spec));
}

}  // namespace palpate
