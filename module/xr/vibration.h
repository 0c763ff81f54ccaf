#pragma once

namespace palpate::xr {

/// How strongly a controller vibrates for a force, 0 to 1: the force as a fraction of the largest,
/// to the power 0.7, so that light touches are felt; below 1 % of the largest nothing. Facts from
/// Maereg et al. 2017: vibration in proportion to the force improves the sense of stiffness (Weber
/// fraction 0.39 to 0.25). Anything not finite gives 0.
double vibration(double force_n, double max_force_n) noexcept;

}  // namespace palpate::xr
