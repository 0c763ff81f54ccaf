#include "tests/lab/studies/feel_runs.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "module/haptics/proxy/back_track.h"
#include "tests/lab/stability/paper_loop.h"
#include "tests/lab/stability/shell.h"
#include "tests/lab/studies/measuring.h"
#include "tests/support/random.h"

namespace palpate::studies {
namespace {

using test::Random;

constexpr double kStiffness = 600.0, kStrength_n = 20.0, kFastest_m_per_s = 0.1;
constexpr double kFramesPerSecond = 2.0;
constexpr int kTicks = 4000, kFrames = 4;

int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// A stroke around the ball along a seeded great circle, in and out through the surface.
class Stroke {
 public:
  Stroke(uint32_t seed, double middle_m, double swing_m) : middle_m_(middle_m), swing_m_(swing_m) {
    Random random(seed);
    along_ = random.direction();
    across_ = glm::normalize(glm::cross(along_, random.direction() + glm::dvec3(0.0, 1e-6, 0.0)));
    in_out_per_s_ = random.draw(3.0, 7.0);
    const double radial = swing_m * in_out_per_s_;
    round_per_s_ =
        std::sqrt(kFastest_m_per_s * kFastest_m_per_s - radial * radial) / (middle_m + swing_m);
  }
  glm::dvec3 direction(double t) const {
    return std::cos(round_per_s_ * t) * along_ + std::sin(round_per_s_ * t) * across_;
  }
  double radius_m(double t) const { return middle_m_ + swing_m_ * std::cos(in_out_per_s_ * t); }

 private:
  double middle_m_, swing_m_, in_out_per_s_ = 0.0, round_per_s_ = 0.0;
  glm::dvec3 along_{1.0, 0.0, 0.0}, across_{0.0, 1.0, 0.0};
};

/// The sphere with its motion on another grid than its data.
std::shared_ptr<const MovingVolume> sphere(int frames, const FeelSetting& setting) {
  auto own = stability::shell(frames, kFramesPerSecond, setting.made, setting.data_mm);
  if (setting.data_mm == setting.field_mm || frames == 1) return own;
  auto volume = std::make_shared<MovingVolume>(*own);
  const Grid grid = stability::shell_grid(setting.field_mm);
  for (int k = 0; k < frames; ++k)
    volume->motions.front().steps[size_t(k)] =
        MotionMap::of(shell_truth(grid, k, (k + 1) % frames, frames));
  return volume;
}

/// The radius at which a strength that grows over the edge balances the spring. The paper's loop
/// needs such a growing strength: with a step its proxy would stay at the hand.
double balanced_radius_m(double probe_m, double surface_m, const TransferFunction& strength) {
  const stability::Ball ball(surface_m, 1.06e-3);
  double in = surface_m - 0.003, out = surface_m + 0.003;
  for (int i = 0; i < 40; ++i) {
    const double r = 0.5 * (in + out);
    (kStiffness * (r - probe_m) < strength(ball.scalar({r, 0.0, 0.0})) ? in : out) = r;
  }
  return in;
}

SceneSpec spec_of(const FeelSetting& setting) {
  SceneSpec spec = stability::shell_spec(kStrength_n, 0.0, kStiffness);
  VolumeSpec& volume = spec.volumes.front();
  volume.back_tracking = setting.method;
  if (setting.moves != Moves::kNothing) volume.drive.kind = DriveSpec::Kind::kSecondHand;
  volume.path = setting.paper ? PosePath::kPaper : PosePath::kSmooth;
  if (setting.paper)
    spec.modes.front().strength = *TransferFunction::window(500.0, 400.0, kStrength_n);
  return spec;
}

/// Poses of a sphere that rotates about its middle, from graphics frames of alternately 11 and 22
/// ms.
class Turning {
 public:
  explicit Turning(bool turns) : turns_(turns) {}
  void next(TickInput& input) noexcept {
    input.pose_count = 0;
    const int64_t now_ns = input.now_ns + 1'000'000;
    if (!turns_ || now_ns < next_ns_) return;
    Transform pose;
    pose.rotation = glm::angleAxis(1.5e-9 * double(now_ns), glm::dvec3(0.0, 1.0, 0.0));
    input.poses[0] = {0, pose, now_ns};
    input.pose_count = 1;
    next_ns_ = now_ns + (long_frame_ ? 22'000'000 : 11'000'000);
    long_frame_ = !long_frame_;
  }

 private:
  bool turns_, long_frame_ = false;
  int64_t next_ns_ = 0;
};

struct Sums {
  std::vector<double> us;
  double squares = 0.0, most = 0.0, exact_squares = 0.0;
  int64_t held = 0;
};

/// One stroke of either hand; exact(probe radius, sphere radius) is the exact force.
template <class AnyHand, class Exact>
void run_stroke(AnyHand& hand, const Stroke& path, const FeelSetting& setting, const Exact& exact,
                Sums& sums) {
  const int frames = setting.moves == Moves::kBoth ? kFrames : 1;
  Turning turning(setting.moves != Moves::kNothing);
  for (int i = 0; i < kTicks; ++i) {
    const double t = 1e-3 * i, probe_m = path.radius_m(t);
    const glm::dvec3 along = path.direction(t);
    turning.next(hand.input);
    const int64_t begin = steady_ns();
    const TickOutput out = hand.to(probe_m * along);
    sums.us.push_back(1e-3 * double(steady_ns() - begin));
    const double wanted = exact(probe_m, stability::shell_radius_m(out.first, frames));
    const double error = glm::length(out.wanted_n - wanted * along);
    if (!std::isfinite(error)) throw Mismatch("A force is not finite: " + setting.name + ".");
    sums.squares += error * error;
    sums.most = std::max(sums.most, error);
    sums.exact_squares += wanted * wanted;
    sums.held += out.frozen;
  }
}

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

FeelMeasure feel(const FeelSetting& setting, int strokes) {
  const bool beats = setting.moves == Moves::kBoth;
  const auto data = sphere(beats ? kFrames : 1, setting);
  const double middle_m = beats ? 0.030 : 0.0235, swing_m = beats ? 0.006 : 0.004;
  const SceneSpec spec = spec_of(setting);
  Sums sums;
  for (uint32_t seed = 1; seed <= uint32_t(strokes); ++seed) {
    const Stroke path(seed, middle_m, swing_m);
    if (setting.paper) {
      const TransferFunction& strength = spec.modes.front().strength;
      stability::PaperHand hand(spec, {data});
      run_stroke(
          hand, path, setting,
          [&](double probe_m, double surface_m) {
            return kStiffness *
                   std::max(0.0, balanced_radius_m(probe_m, surface_m, strength) - probe_m);
          },
          sums);
    } else {
      stability::Hand hand(spec, {data}, stability::unmetered());
      run_stroke(
          hand, path, setting,
          [](double probe_m, double surface_m) {
            return kStiffness * std::max(0.0, surface_m - probe_m);
          },
          sums);
    }
  }
  FeelMeasure measure{setting,
                      quantile(sums.us, 0.5),
                      quantile(sums.us, 0.99),
                      std::sqrt(sums.squares / double(sums.us.size())),
                      sums.most,
                      std::sqrt(sums.exact_squares / double(sums.us.size())),
                      sums.held,
                      0.0};
  if (!data->motions.empty())
    for (const auto& step : data->motions.front().steps)
      measure.field_megabytes += 1e-6 * double(step->bytes());
  return measure;
}

double hearts_us(int volumes, int modes_of_each, Moves moves, int ticks) {
  const std::vector<std::shared_ptr<const MovingVolume>> data(size_t(volumes),
                                                              heart_volume(moves != Moves::kBoth));
  stability::Hand hand(hearts_spec(volumes, modes_of_each, moves), data, HapticsOptions{});
  HeartHand path(volumes, moves);
  std::vector<double> us;
  TickOutput out;
  TickInput input;
  for (int i = 0; i < ticks; ++i) {
    path.next(input, out.first);
    const int64_t begin = steady_ns();
    out = hand.haptics.tick(input);
    // In the first half second the hand comes in from outside, with cold caches.
    if (i > 500) us.push_back(1e-3 * double(steady_ns() - begin));
  }
  return quantile(us, 0.5);
}

namespace {

/// Seeded places within the moving wall of the heart, and the motion map for them.
struct InversionPlaces {
  std::shared_ptr<const MotionMap> map;
  std::vector<glm::dvec3> targets;
};

InversionPlaces inversion_places(int count) {
  static const auto map = MotionMap::of(shell_truth(heart_grid(128), 0, 1));
  InversionPlaces places{map, {}};
  Random random(7);
  for (int n = 0; n < count; ++n) {
    const double radius_m = random.draw(0.015, 0.05);
    places.targets.push_back(radius_m * random.direction());
  }
  return places;
}

// Late in a step the motion is large and hardest to invert.
constexpr double kPhase = 0.9;

template <class Inversion>
InversionMeasure inversion_measure(const InversionPlaces& places, const Inversion& invert) {
  std::vector<double> us;
  double squares = 0.0, steps = 0.0;
  constexpr int kBatches = 9;
  for (int batch = 0; batch < kBatches; ++batch) {
    squares = steps = 0.0;
    const int64_t begin = steady_ns();
    for (const glm::dvec3& target : places.targets) {
      const auto [x, taken] = invert(target);
      const glm::dvec3 left = x + kPhase * places.map->sample(x).u_m - target;
      squares += glm::dot(left, left);
      steps += taken;
    }
    us.push_back(1e-3 * double(steady_ns() - begin) / double(places.targets.size()));
  }
  const auto count = double(places.targets.size());
  return {int(std::lround(steps / count)), 1e6 * std::sqrt(squares / count), median(us)};
}

}  // namespace

InversionMeasure picard_inversion(int steps, int count) {
  const InversionPlaces places = inversion_places(count);
  return inversion_measure(places, [&](glm::dvec3 target) {
    glm::dvec3 x = target;
    for (int n = 0; n < steps; ++n) x = target - kPhase * places.map->sample(x).u_m;
    return std::pair(x, steps);
  });
}

InversionMeasure newton_inversion(int count) {
  const InversionPlaces places = inversion_places(count);
  return inversion_measure(places, [&](glm::dvec3 target) {
    const BackTrack found = back_track(*places.map, kPhase, target, target);
    return std::pair(found.x_m, found.steps);
  });
}

}  // namespace palpate::studies
