#include <cmath>

#include <fmt/format.h>

#include "tests/lab/bench/haptics_bench.h"
#include "tests/lab/bench/haptics_bench_scenes.h"
#include "tests/support/random.h"

namespace palpate::bench {
namespace {

using test::Made;

constexpr double kStiffness = 600.0;
constexpr double kStrength_n = 20.0;
constexpr double kFastest_m_per_s = 0.1;

/// A stroke round the ball along a seeded great circle, in and out through the surface, never
/// faster than kFastest_m_per_s.
class Stroke {
 public:
  Stroke(uint32_t seed, double middle_m, double swing_m) : middle_m_(middle_m), swing_m_(swing_m) {
    test::Random random(seed);
    along_ = glm::normalize(random.vector(1.0) + glm::dvec3(1e-6));
    across_ = glm::normalize(glm::cross(along_, random.vector(1.0) + glm::dvec3(0.0, 1e-6, 0.0)));
    in_out_per_s_ = random.draw(3.0, 7.0);
    const double radial = swing_m * in_out_per_s_;
    round_per_s_ =
        std::sqrt(kFastest_m_per_s * kFastest_m_per_s - radial * radial) / (middle_m + swing_m);
  }
  glm::dvec3 direction(double t) const {
    return std::cos(round_per_s_ * t) * along_ + std::sin(round_per_s_ * t) * across_;
  }
  /// Starts outside.
  double radius_m(double t) const { return middle_m_ + swing_m_ * std::cos(in_out_per_s_ * t); }

 private:
  double middle_m_, swing_m_, in_out_per_s_ = 0.0, round_per_s_ = 0.0;
  glm::dvec3 along_{1.0, 0.0, 0.0}, across_{0.0, 1.0, 0.0};
};

struct ForceErrors {
  Errors error, exact;
  double percent() const { return 100.0 * error.rms() / exact.rms(); }
};

/// A frictionless surface gives exactly k times the depth, along the radius.
void stroke(test::Hand& hand, const Stroke& path, int frames, int ticks, ForceErrors& errors) {
  for (int i = 0; i < ticks; ++i) {
    const double t = 1e-3 * i;
    const glm::dvec3 along = path.direction(t);
    const TickOutput out = hand.to(path.radius_m(t) * along);
    if (out.held) throw Mismatch("A back-tracking failed on the shell: it has no folds.");
    const double radius = test::shell_radius_m(out.first, frames);
    const double exact = kStiffness * std::max(0.0, radius - path.radius_m(t));
    errors.error.add(glm::length(out.wanted_n - exact * along));
    errors.exact.add(exact);
  }
}

/// Where a strength that grows over the edge balances the spring: the paper's loop needs such a
/// window, as a surface that holds or does not would leave its proxy at the hand.
double balanced_radius_m(double probe_m, double surface_m, const TransferFunction& strength) {
  const test::Ball ball(surface_m, 1.06e-3);
  double in = surface_m - 0.003, out = surface_m + 0.003;
  for (int i = 0; i < 40; ++i) {
    const double r = 0.5 * (in + out);
    (kStiffness * (r - probe_m) < strength(ball.scalar({r, 0.0, 0.0})) ? in : out) = r;
  }
  return in;
}

/// The same strokes with the paper's loop. On the beating shell the edge's width changes a little
/// with the motion, which is not in the exact solution: 0.03 N at most.
ForceErrors papers_against_shell(const HapticsBench& bench, int frames) {
  ForceErrors errors;
  SceneSpec spec = test::shell_spec(kStrength_n, 0.0, kStiffness);
  const TransferFunction strength = *TransferFunction::window(500.0, 400.0, kStrength_n);
  spec.modes.front().strength = strength;
  spec.volumes.front().back_tracking = BackTracking::kPicard;
  spec.volumes.front().path = PosePath::kPaper;
  const double middle_m = frames > 1 ? 0.030 : 0.0235, swing_m = frames > 1 ? 0.006 : 0.004;
  const auto data = test::shell(frames, 2.0, Made::kAnalytic);
  for (uint32_t seed = 1; seed <= uint32_t(bench.part(40)); ++seed) {
    const Stroke path(seed, middle_m, swing_m);
    PaperHand hand(spec, {data});
    for (int i = 0; i < 4000; ++i) {
      const double t = 1e-3 * i, probe_m = path.radius_m(t);
      const TickOutput out = hand.to(probe_m * path.direction(t));
      const double proxy_m =
          balanced_radius_m(probe_m, test::shell_radius_m(out.first, frames), strength);
      const double exact = kStiffness * std::max(0.0, proxy_m - probe_m);
      errors.error.add(glm::length(out.wanted_n - exact * path.direction(t)));
      errors.exact.add(exact);
    }
  }
  return errors;
}

/// Still (frames = 1) or beating at 1, 2 and 4 frames a second.
ForceErrors against_shell(const HapticsBench& bench, int frames, Made made) {
  ForceErrors errors;
  const SceneSpec spec = test::shell_spec(kStrength_n, 0.0, kStiffness);
  const double middle_m = frames > 1 ? 0.030 : 0.0235, swing_m = frames > 1 ? 0.006 : 0.004;
  for (const double fps : {1.0, 2.0, 4.0}) {
    if (frames == 1 && fps > 1.0) break;
    const auto data = test::shell(frames, fps, made);
    for (uint32_t seed = 1; seed <= uint32_t(bench.part(40)); ++seed) {
      const Stroke path(seed, middle_m, swing_m);
      test::Hand hand(spec, {data}, bare());
      stroke(hand, path, frames, 4000, errors);
    }
  }
  return errors;
}

}  // namespace

Findings force_rows(const HapticsBench& bench) {
  Findings findings;
  const ForceErrors paper_moving = papers_against_shell(bench, 4);
  const ForceErrors paper_still = papers_against_shell(bench, 1);
  const auto moving = [&](const char* data, const ForceErrors& of) {
    const std::string what = fmt::format("moving shell, {}, probe to 100 mm/s: force error ", data);
    findings.goals.push_back(
        {what + "RMS", "", "N", 0.01, 0.003, of.error.rms(), 4,
         fmt::format("the paper's loop, formula: {:.3f}", paper_moving.error.rms())});
    findings.goals.push_back(
        {what + "max",
         "",
         "N",
         0.05,
         {},
         of.error.worst,
         4,
         fmt::format("the paper's loop, formula: {:.2f}", paper_moving.error.worst)});
  };
  moving("data as a formula", against_shell(bench, 4, Made::kAnalytic));
  moving("data sampled at 1 mm", against_shell(bench, 4, Made::kSampled));
  const auto resting = [&](const char* data, const ForceErrors& of) {
    const std::string what = fmt::format("still shell, {}: force error ", data);
    findings.goals.push_back(
        {what + "RMS", "", "%", 0.5, 0.1, of.percent(), 3,
         fmt::format("the paper's loop, formula: {:.2f}", paper_still.percent())});
    findings.goals.push_back(
        {what + "max",
         "",
         "N",
         0.02,
         {},
         of.error.worst,
         4,
         fmt::format("the paper's loop, formula: {:.3f}", paper_still.error.worst)});
  };
  resting("data as a formula", against_shell(bench, 1, Made::kAnalytic));
  resting("data sampled at 1 mm", against_shell(bench, 1, Made::kSampled));
  return findings;
}

}  // namespace palpate::bench
