#pragma once

#include <cmath>

#include "module/haptics/modes/modes.h"

/// A mode of your own: the hand is pulled to an iso-surface and slides along it. It reads the
/// data's value and gradient at the proxy, and places two surfaces back to back at the nearest
/// point of the iso-surface. palpate handles motion of the data, transforms and devices. iso_value:
/// in the data's unit; reach_m: m; strength_n: N, at the iso-surface.
class Snap final : public palpate::Mode {
 public:
  Snap(double iso_value, double reach_m, double strength_n)
      : iso_value_(iso_value), reach_m_(reach_m), strength_n_(strength_n) {}

  void place(const palpate::ModePoint& at, palpate::PrimitiveSink& out) const noexcept override {
    const glm::dvec3 uphill = at.data.scalar_gradient();
    const double slope = glm::length(uphill);
    if (!(slope > 0.0)) return;  // no gradient: the direction to the surface is not known
    const double away_m = (at.data.scalar() - iso_value_) / slope;
    // Falls linearly to 0 at the reach, so that the force has no step there.
    const double strength_n = strength_n_ * (1.0 - std::abs(away_m) / reach_m_);
    const glm::dvec3 foot = at.proxy - uphill * (away_m / slope);
    out.surface(foot, uphill, strength_n);
    out.surface(foot, -uphill, strength_n);
  }

 private:
  double iso_value_, reach_m_, strength_n_;
};

/// Call once, before scenes are made. Then a scene file may contain "kind": "snap", with the
/// iso-value as "gain" and the reach (m) as "range_m".
inline void add_snap(palpate::ModeKinds& kinds) {
  kinds.add(
      "snap",
      [](const palpate::ModeSpec& spec) -> palpate::Result<std::shared_ptr<const palpate::Mode>> {
        if (!(spec.range_m > 0.0))
          return palpate::Error{palpate::ErrorKind::kBadInput,
                                "Mode \"" + spec.name + "\" needs a range_m above 0."};
        return std::shared_ptr<const palpate::Mode>(
            std::make_shared<Snap>(spec.gain, spec.range_m, spec.strength.highest()));
      });
}
