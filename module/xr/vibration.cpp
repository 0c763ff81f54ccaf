#include "module/xr/vibration.h"

#include <algorithm>
#include <cmath>

namespace palpate::xr {

double vibration(double force_n, double max_force_n) noexcept {
  if (!std::isfinite(force_n) || !(max_force_n > 0.0) || !std::isfinite(max_force_n)) return 0.0;
  const double share = std::min(std::abs(force_n) / max_force_n, 1.0);
  return share < 0.01 ? 0.0 : std::pow(share, 0.7);
}

}  // namespace palpate::xr
