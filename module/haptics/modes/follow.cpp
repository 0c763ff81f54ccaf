#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Follow, equation (13): moving across a vector field takes force, moving along it none, so the
/// hand is guided along its lines. Along the curl it is the vortex mode: the hand follows a
/// vortex's core.
class Follow final : public Mode {
 public:
  explicit Follow(const ModeSpec& spec) : strength_(spec.strength) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    const glm::dvec3 along = at.data.vector();
    const double size = glm::length(along);
    if (size > 0.0) out.line(at.proxy, along, strength_(size));
  }

 private:
  TransferFunction strength_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_follow(const ModeSpec& spec) {
  return std::shared_ptr<const Mode>(std::make_shared<Follow>(spec));
}

}  // namespace palpate
