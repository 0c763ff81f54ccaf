#include "tests/lab/stability/darts.h"

#include <cmath>

#include "tests/lab/stability/back_track_maps.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/stability/thin_shell.h"

namespace palpate::stability {
namespace {

constexpr double kThin_m = 1e-3;

/// The thin shell whose fastest step has this speed, m/s.
std::shared_ptr<const MovingVolume> shell_at(double wall_m_per_s) {
  double step_m = 0.0;
  for (int k = 0; k < kThinFrames; ++k)
    step_m = std::max(step_m, 1e-3 * std::abs(shell_radius_mm(k + 1, kThinFrames) -
                                              shell_radius_mm(k, kThinFrames)));
  return thin_shell(std::max(1e-6, wall_m_per_s / step_m));
}

class Darting {
 public:
  explicit Darting(const DartHand& hand) : hand_(hand), step_m_(1e-3 * hand.fastest_m_per_s) {}
  /// Starts outside.
  glm::dvec3 next(test::Random& random, double radius_m, glm::dvec3 centre_m) {
    if (glm::length(target_ - at_) < step_m_) {
      const glm::dvec3 to = glm::normalize(glm::normalize(at_ - centre_m) + random.vector(0.5));
      target_ = centre_m + to * (radius_m + random.draw(-0.015, 0.006));
      if (hand_.slowest_m_per_s < hand_.fastest_m_per_s)
        step_m_ = 1e-3 * random.log_draw(hand_.slowest_m_per_s, hand_.fastest_m_per_s);
    }
    const glm::dvec3 way = target_ - at_;
    const double length = glm::length(way);
    if (length > 0.0) at_ += way * std::min(1.0, step_m_ / length);
    return at_;
  }

 private:
  DartHand hand_;
  double step_m_;
  glm::dvec3 at_{0.05, 0.0, 0.0}, target_{0.04, 0.0, 0.0};
};

const VolumeRun& volume_of(const Hand& hand) {
  return hand.haptics.run()->volumes.front();
}
const VolumeRun& volume_of(const PaperHand& hand) {
  return hand.loop.run().volumes.front();
}

template <class AnyHand>
Darts darted_by(const SceneSpec& spec, const std::shared_ptr<const MovingVolume>& data,
                const DartHand& how, int ticks, test::Random random) {
  const auto make = [&] { return std::make_unique<AnyHand>(spec, std::vector{data}); };
  auto hand = make();
  Darting path(how);
  Darts darts;
  double radius = 0.025;
  glm::dvec3 centre(0.0);
  for (int i = 0; i < ticks; ++i) {
    const TickOutput out = hand->to(path.next(random, radius, centre));
    ++darts.frames;
    darts.contact += glm::length(out.wanted_n) > 0.0;
    radius = shell_radius_m(out.first, kThinFrames);
    centre = volume_of(*hand).world(glm::dvec3(0.0));
    // The spring presses on the wall, not the force that is wanted on the hand: a bridge over a
    // sudden change may hold that back for a while.
    const double spring_n = spec.stiffness_n_per_m * glm::length(out.probe_m - out.proxy_m);
    const bool strong = spring_n >= kDartStrength_n;
    const double behind = radius - glm::length(volume_of(*hand).volume(out.proxy_m));
    const bool through = !strong && behind > 0.5 * kThin_m;
    if (!strong) darts.deepest_m = std::max(darts.deepest_m, behind);
    darts.strong += strong;
    darts.through += through;
    darts.unseen += through && !out.frozen;
    if (!strong && !through) continue;
    hand = make();
    path = Darting(how);
  }
  return darts;
}

}  // namespace

SceneSpec dart_spec(double friction) {
  SceneSpec spec = shell_spec(kDartStrength_n, friction, 600.0);
  spec.modes.front().strength = *TransferFunction::window(300.0, 200.0, kDartStrength_n);
  return spec;
}

Darts darted(const SceneSpec& spec, const std::shared_ptr<const MovingVolume>& data,
             const DartHand& hand, int ticks, test::Random random) {
  if (hand.palpate) return darted_by<Hand>(spec, data, hand, ticks, random);
  SceneSpec papers = spec;
  papers.volumes.front().back_tracking = BackTracking::kPicard;
  return darted_by<PaperHand>(papers, data, hand, ticks, random);
}

Cell dart_cell(double hand_m_per_s, double wall_m_per_s, bool palpate, int ticks, uint32_t seed) {
  const Darts darts = darted(dart_spec(0.2), shell_at(wall_m_per_s),
                             {hand_m_per_s, hand_m_per_s, palpate}, ticks, test::Random(seed));
  Cell cell{1e3 * double(darts.through) / double(std::max<int64_t>(1, darts.contact)),
            Outcome::kHeld};
  if (darts.through) cell.outcome = darts.unseen || !palpate ? Outcome::kSilent : Outcome::kFlagged;
  return cell;
}

}  // namespace palpate::stability
