#pragma once

#include <cmath>
#include <numbers>

#include "module/haptics/modes/modes.h"

/// A mode of your own: a surface with a texture. A hand that strokes it with the speed v feels a
/// vibration of the frequency v / wavelength_m. The texture belongs to the material, so it moves
/// with it, and it needs neither time nor memory: it is a friction that changes from place to
/// place. Friction only takes energy from the hand, so the texture can not shake by itself.
/// Vibrations of more than 0.3 N rms between 20 and 300 Hz are taken for an oscillation of the loop
/// and weakened: with the normal force F they have at most share * friction * F / sqrt(2).
class TextureMode final : public palpate::Mode {
 public:
  /// strength (N) and friction: transfer functions of the data's value, as of a surface. share: 0
  /// to 1, of the friction, by which it changes. wavelength_m: along each axis of the volume.
  TextureMode(const palpate::ModeSpec& spec, double share, double wavelength_m)
      : strength_(spec.strength),
        friction_(spec.friction),
        share_(share),
        wave_per_m_(2.0 * std::numbers::pi / wavelength_m) {}

  void place(const palpate::ModePoint& at, palpate::PrimitiveSink& out) const noexcept override {
    const double value = at.data.scalar();
    const double strength_n = strength_(value);
    if (!(strength_n > 0.0)) return;
    const glm::dvec3 uphill = at.data.scalar_gradient();
    if (!(glm::length(uphill) > 0.0)) return;
    // One of the three waves is crossed whichever way the hand goes.
    const glm::dvec3 wave = glm::sin(wave_per_m_ * at.proxy);
    const double friction = friction_(value) * (1.0 + share_ * (wave.x + wave.y + wave.z) / 3.0);
    out.surface(at.proxy, -uphill, strength_n, friction);
  }

 private:
  palpate::TransferFunction strength_, friction_;
  double share_, wave_per_m_;
};

/// Call once, before scenes are made. Then a scene file may contain "kind": "texture", with the
/// share as "gain" and the wavelength (m) as "range_m".
inline void add_texture(palpate::ModeKinds& kinds) {
  kinds.add(
      "texture",
      [](const palpate::ModeSpec& spec) -> palpate::Result<std::shared_ptr<const palpate::Mode>> {
        if (!(spec.range_m > 0.0) || !(spec.gain >= 0.0 && spec.gain <= 1.0))
          return palpate::Error{palpate::ErrorKind::kBadInput,
                                "Mode \"" + spec.name +
                                    "\" needs a range_m above 0 (the wavelength) and a gain from "
                                    "0 to 1 (the share of the friction that changes)."};
        return std::shared_ptr<const palpate::Mode>(
            std::make_shared<TextureMode>(spec, spec.gain, spec.range_m));
      });
}
