#include <algorithm>
#include <cmath>

#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/draws.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/stability/thin_shell.h"

namespace palpate::stability {
namespace {

constexpr int kFrames = kThinFrames;
constexpr double kThin_m = 1e-3;
constexpr double kDartStrength_n = 20.0;

/// The thin shell whose fastest step goes at so many m/s.
std::shared_ptr<const MovingVolume> shell_at(double wall_m_per_s) {
  double step_m = 0.0;
  for (int k = 0; k < kFrames; ++k)
    step_m = std::max(
        step_m, 1e-3 * std::abs(shell_radius_mm(k + 1, kFrames) - shell_radius_mm(k, kFrames)));
  return thin_shell(std::max(1e-6, wall_m_per_s / step_m));
}

/// A hand that darts about the wall, up to 15 mm inside of it. Straight ways between seeded points.
class Darting {
 public:
  explicit Darting(double speed_m_per_s) : step_m_(1e-3 * speed_m_per_s) {}
  /// Starts outside.
  glm::dvec3 next(Draws& draws, double radius_m) {
    if (glm::length(target_ - at_) < step_m_) {
      const glm::dvec3 to = glm::normalize(glm::normalize(at_) + draws.vector(0.5));
      target_ = to * (radius_m + draws.even(-0.015, 0.006));
    }
    const glm::dvec3 way = target_ - at_;
    const double length = glm::length(way);
    if (length > 0.0) at_ += way * std::min(1.0, step_m_ / length);
    return at_;
  }

 private:
  double step_m_;
  glm::dvec3 at_{0.05, 0.0, 0.0}, target_{0.04, 0.0, 0.0};
};

struct Darts {
  int64_t contact = 0, through = 0, unseen = 0;
};

/// A frame in which the force comes to the strength, or the proxy is behind the wall, starts the
/// hand anew outside.
template <class MakeHand>
Darts darted(double hand_m_per_s, int ticks, Draws draws, const MakeHand& make) {
  auto hand = make();
  Darting path(hand_m_per_s);
  Darts darts;
  double radius = 0.025;
  for (int i = 0; i < ticks; ++i) {
    const TickOutput out = hand->to(path.next(draws, radius));
    darts.contact += glm::length(out.wanted_n) > 0.0;
    radius = shell_radius_m(out.first, kFrames);
    const bool strong = glm::length(out.wanted_n) >= kDartStrength_n;
    const bool through = !strong && radius - glm::length(out.proxy_m) > 0.5 * kThin_m;
    darts.through += through;
    darts.unseen += through && !out.held;
    if (!strong && !through) continue;
    hand = make();
    path = Darting(hand_m_per_s);
  }
  return darts;
}

}  // namespace

Cell dart_cell(double hand_m_per_s, double wall_m_per_s, bool palpate, int ticks, uint32_t seed) {
  const auto data = shell_at(wall_m_per_s);
  SceneSpec spec = shell_spec(kDartStrength_n, 0.2, 600.0);
  spec.modes.front().strength = *TransferFunction::window(300.0, 200.0, kDartStrength_n);
  Darts darts;
  if (palpate) {
    darts = darted(hand_m_per_s, ticks, Draws(seed),
                   [&] { return std::make_unique<Hand>(spec, std::vector{data}); });
  } else {
    spec.volumes.front().back_tracking = BackTracking::kPicard;
    darts = darted(hand_m_per_s, ticks, Draws(seed),
                   [&] { return std::make_unique<PaperHand>(spec, std::vector{data}); });
  }
  Cell cell{1e3 * double(darts.through) / double(std::max<int64_t>(1, darts.contact)),
            Outcome::kHeld};
  if (darts.through) cell.outcome = darts.unseen || !palpate ? Outcome::kSilent : Outcome::kFlagged;
  return cell;
}

}  // namespace palpate::stability
