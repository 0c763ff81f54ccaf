#include "module/view/resolution.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kTooSlow = 0.95, kTooFast = 0.65, kAim = 0.80;
constexpr double kDown = 0.97, kUp = 1.01;
// The weight of a new time in the smoothed one: about eight pictures are averaged.
constexpr double kNew = 0.125;

}  // namespace

Resolution next_resolution(const Resolution& now, double frame_s,
                           const ResolutionOptions& options) {
  if (!(frame_s > 0.0) || !std::isfinite(frame_s)) return now;
  Resolution next = now;
  const double full_s = frame_s / (now.scale * now.scale);
  next.full_s = now.full_s > 0.0 ? now.full_s + kNew * (full_s - now.full_s) : full_s;

  const double share = next.full_s * now.scale * now.scale / options.budget_s;
  if (share > kTooSlow || share < kTooFast) next.moving = true;
  const double wanted =
      std::clamp(std::sqrt(kAim * options.budget_s / next.full_s), options.least, 1.0);
  if (next.moving)
    next.scale = std::clamp(wanted, kDown * now.scale, std::min(kUp * now.scale, 1.0));
  if (next.scale == wanted) next.moving = false;
  return next;
}

PictureSize scaled(PictureSize full, double scale) {
  const auto even = [&](int n) {
    return std::clamp(2 * int(std::lround(0.5 * scale * n)), std::min(16, n), n);
  };
  return {even(full.width), even(full.height)};
}

}  // namespace palpate
