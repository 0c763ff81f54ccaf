#include "module/haptics/modes/modes.h"

namespace palpate {
namespace {

/// Viscosity: the material slows the hand down. The strength, a function of the scalar, is the
/// force at 1 m/s relative to the material.
class Viscosity final : public Mode {
 public:
  explicit Viscosity(const ModeSpec& spec) : n_s_per_m_(spec.strength) {}

  void place(const ModePoint& at, PrimitiveSink& out) const noexcept override {
    out.drag(n_s_per_m_(at.data.scalar()));
  }

 private:
  TransferFunction n_s_per_m_;
};

}  // namespace

Result<std::shared_ptr<const Mode>> make_viscosity(const ModeSpec& spec) {
  return std::shared_ptr<const Mode>(std::make_shared<Viscosity>(spec));
}

}  // namespace palpate
