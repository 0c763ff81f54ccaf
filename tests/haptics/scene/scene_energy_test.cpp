// The energy of a whole scene. Oracle: the work of the force on the hand, summed here from the
// output, compared with the tank's own terms.
#include <gtest/gtest.h>

#include "tests/haptics/guard/force_steps.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kStiffness = 600.0;
// The required limit.
constexpr double kMost_j = 1e-6;

HapticsOptions metered() {
  HapticsOptions options;
  options.lead = false;
  options.tank.capacity_j = 2e-3;
  options.tank.allowance_w = 5e-3;
  // So that the bound does not depend on the tank's own bookkeeping.
  options.tank.dissipated_share = 0.0;
  return options;
}

/// Work on the hand beyond capacity, allowance and the sampling energy.
class Books {
 public:
  explicit Books(const HapticsOptions& options) : options_(options) {}
  void add(const Hand& hand, const TickOutput& out) {
    if (known_) {
      const glm::dvec3 moved = out.probe_m - last_probe_;
      work_j += glm::dot(last_n_, moved);
      held_j_ += 0.5 * last_k_ * glm::dot(moved, moved);
      allowed_j_ += options_.tank.allowance_w * 1e-3;
    }
    known_ = true;
    last_probe_ = out.probe_m;
    last_n_ = out.wanted_n;
    last_k_ = hand.haptics.run()->stiffness_n_per_m;
    beyond_j = std::max(beyond_j, work_j - options_.tank.capacity_j - allowed_j_ - held_j_);
    steps.add(out);
  }
  double work_j = 0.0, beyond_j = -1e300;
  ForceSteps steps;

 private:
  HapticsOptions options_;
  double held_j_ = 0.0, allowed_j_ = 0.0, last_k_ = 0.0;
  glm::dvec3 last_probe_{0.0}, last_n_{0.0};
  bool known_ = false;
};

/// A hand of 0.3 kg with a soft grip, so that the scene can do work on it.
class LooseHand {
 public:
  explicit LooseHand(glm::dvec3 rest) : rest_(rest), at(rest) {}
  void push(glm::dvec3 force_n) {
    const glm::dvec3 all = force_n - 120.0 * (at - rest_) - 4.0 * velocity_;
    velocity_ += all * (1e-3 / 0.3);
    at += 1e-3 * velocity_;
  }
  void aim(glm::dvec3 rest) { rest_ = rest; }

 private:
  glm::dvec3 rest_, velocity_{0.0};

 public:
  glm::dvec3 at;
};

SceneSpec swinging(double rate_hz, double amplitude_m) {
  SceneSpec spec = shell_spec(50.0, 0.2, kStiffness);
  DriveSpec& drive = spec.volumes[0].drive;
  drive.kind = DriveSpec::Kind::kSwing;
  drive.axis = {1.0, 0.0, 0.0};
  drive.rate_hz = rate_hz;
  drive.amplitude_m = amplitude_m;
  spec.volumes[0].path = PosePath::kExact;
  return spec;
}

TEST(SceneEnergy, OfASwingingVolumeStaysInTheTankAndSlipsWithoutAJump) {
  double worst = -1e300;
  for (const double rate : {1.0, 3.0}) {
    // A soft wall, so that there is a slope at the proxy wherever the wall slips to.
    auto data = std::make_shared<MovingVolume>(*shell(1, 1.0));
    data->frames = {std::make_shared<Ball>(0.025, 0.006)};
    Hand hand(swinging(rate, 0.01), {data}, metered());
    Books books(metered());
    LooseHand loose({0.04, 0.0, 0.0});
    double most_moved = 0.0;
    for (int i = 0; i < 8000; ++i) {
      loose.aim({i < 500 ? 0.04 - 0.018 * i / 500.0 : 0.022, 0.002, 0.001});
      const glm::dvec3 before = loose.at;
      const TickOutput out = hand.to(loose.at);
      books.add(hand, out);
      loose.push(out.wanted_n);
      most_moved = std::max(most_moved, glm::length(loose.at - before));
    }
    const EnergyLedger ledger = hand.haptics.tank().ledger();
    std::printf(
        "swinging at %.0f Hz: work %.3f mJ, beyond the tank %.3g J, %ld slips, worst step "
        "%.4f N per ms\n",
        rate, 1e3 * books.work_j, books.beyond_j, long(ledger.slips), books.steps.worst_n());
    EXPECT_GT(ledger.slips, 10) << "the tank must run empty for this test to check anything";
    EXPECT_LE(books.beyond_j, kMost_j);
    worst = std::max(worst, books.beyond_j);
    // The force step is at most that of the motion of wall and hand in a frame.
    const double wall = 2.0 * std::numbers::pi * rate * 0.01 * 1e-3;
    EXPECT_LE(books.steps.worst_n(), kStiffness * (wall + most_moved) * 1.01);
  }
}

TEST(SceneEnergy, OfABeatingVolumeStaysInTheTankWhateverThePersonDoes) {
  const auto data = shell(4, 8.0, Made::kAnalytic, 2.0);
  double worst = -1e300;
  int64_t slips = 0;
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    SceneSpec spec = shell_spec(50.0, random.draw(0.0, 0.8), kStiffness);
    spec.modes.push_back(spec.modes[0]);
    spec.modes[1].name = "push";
    spec.modes[1].kind = "gradient-force";
    spec.modes[1].strength = TransferFunction::constant(0.5);
    spec.modes[1].gain = -1e-6;
    Hand hand(spec, {data}, metered());
    Books books(metered());
    glm::dvec3 way = glm::normalize(random.vector(1.0));
    LooseHand loose(0.045 * way);
    for (int i = 0; i < 6000; ++i) {
      if (i % 300 == 299) {
        ControlEvent& event = hand.input.events[0];
        event.kind = ControlEvent::Kind(int(random.draw(0.0, 5.0)));
        event.index = int(random.draw(0.0, 2.0));
        event.value = random.draw(-1.0, 2.0);
        if (event.kind == ControlEvent::Kind::kStiffness) event.value = random.draw(200.0, 1500.0);
        hand.input.event_count = 1;
        way = glm::normalize(way + random.vector(0.3));
      }
      loose.aim((i % 1500 < 500 ? 0.04 : 0.024) * way);
      const TickOutput out = hand.to(loose.at);
      books.add(hand, out);
      loose.push(out.wanted_n);
    }
    slips += hand.haptics.tank().ledger().slips;
    EXPECT_LE(books.beyond_j, kMost_j) << "seed " << seed;
    worst = std::max(worst, books.beyond_j);
  }
  std::printf("beating: at most %.3g J beyond the tank, %ld slips\n", worst, long(slips));
  EXPECT_GT(slips, 10);
}

}  // namespace
}  // namespace palpate
