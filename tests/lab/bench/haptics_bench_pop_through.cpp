#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <glm/gtc/constants.hpp>

#include "compute/volume/phantom.h"
#include "tests/lab/bench/haptics_bench.h"
#include "tests/lab/bench/haptics_bench_scenes.h"
#include "tests/lab/stability/thin_shell.h"
#include "tests/support/random.h"

namespace palpate::bench {
namespace {

using stability::thin_shell;
using test::Random;

constexpr int kFrames = stability::kThinFrames;
constexpr double kVoxel_m = 1e-3;
constexpr double kStiffness = 600.0, kStrength_n = 20.0;
constexpr double kWallSpeed_m_per_s = 0.3, kHandSpeed_m_per_s = 1.0;
constexpr int kFramesPerScene = 100'000;

/// A hand that darts about the wall at up to 1 m/s, up to 20 mm inside of it. Straight ways between
/// seeded points.
class Darting {
 public:
  /// Starts outside.
  glm::dvec3 next(Random& random, double radius_m, glm::dvec3 centre_m) {
    glm::dvec3 way = target_ - at_;
    if (glm::length(way) < speed_ * 1e-3) {
      const glm::dvec3 from = glm::normalize(at_ - centre_m);
      const glm::dvec3 to = glm::normalize(from + random.vector(0.5));
      target_ = centre_m + to * (radius_m + random.draw(-0.015, 0.004));
      speed_ = kHandSpeed_m_per_s * std::pow(0.02, random.draw(0.0, 1.0));
      way = target_ - at_;
    }
    const double length = glm::length(way);
    if (length > 0.0) at_ += way * std::min(1.0, speed_ * 1e-3 / length);
    return at_;
  }

 private:
  glm::dvec3 at_{0.05, 0.0, 0.0}, target_{0.04, 0.0, 0.0};
  double speed_ = 0.1;
};

struct Counts {
  int64_t frames = 0, contact = 0, strong = 0, through = 0;
  double deepest_m = -1.0;  ///< of the proxy behind the wall's middle
  void operator+=(const Counts& o) {
    frames += o.frames;
    contact += o.contact;
    strong += o.strong;
    through += o.through;
    deepest_m = std::max(deepest_m, o.deepest_m);
  }
};

SceneSpec drawn_scene(Random& random, double& frames_per_second) {
  SceneSpec spec = test::shell_spec(kStrength_n, random.draw(0.0, 0.8), kStiffness);
  spec.modes.front().strength = *TransferFunction::window(300.0, 200.0, kStrength_n);
  // The data move by at most 5 mm from a frame to the next; the swing gets what speed is left.
  frames_per_second = random.draw(1.0, 40.0);
  const double data_m_per_s = 0.005 * frames_per_second;
  VolumeSpec& volume = spec.volumes.front();
  volume.path = PosePath::kExact;
  volume.drive.kind = DriveSpec::Kind::kSwing;
  volume.drive.axis = glm::normalize(random.vector(1.0) + glm::dvec3(1e-6));
  volume.drive.amplitude_m = random.draw(0.002, 0.010);
  volume.drive.rate_hz =
      (kWallSpeed_m_per_s - data_m_per_s) / (glm::two_pi<double>() * volume.drive.amplitude_m);
  volume.transform.rotation =
      glm::angleAxis(random.draw(0.0, 3.0), glm::normalize(random.vector(1.0) + glm::dvec3(1e-6)));
  return spec;
}

/// One seeded scene. A frame in which the force comes to the strength ends what is counted: then
/// the hand may go through, and starts again outside.
template <class MakeHand, class VolumeOf>
Counts darts(uint32_t seed, int frames, const MakeHand& make, const VolumeOf& place) {
  Random random(seed);
  double fps = 1.0;
  const SceneSpec spec = drawn_scene(random, fps);
  const auto data = thin_shell(fps);
  auto hand = make(spec, data);
  Darting path;
  Counts counts;
  double radius = 0.025;
  glm::dvec3 centre(0.0);
  for (int i = 0; i < frames; ++i) {
    const TickOutput out = hand->to(path.next(random, radius, centre));
    ++counts.frames;
    counts.contact += glm::length(out.wanted_n) > 0.0;
    radius = test::shell_radius_m(out.first, kFrames);
    centre = place(*hand).world(glm::dvec3(0.0));
    const bool strong = glm::length(out.wanted_n) >= kStrength_n;
    const double behind = radius - glm::length(place(*hand).volume(out.proxy_m));
    const bool through = behind > 0.5 * kVoxel_m;
    if (!strong) counts.deepest_m = std::max(counts.deepest_m, behind);
    counts.strong += strong;
    counts.through += through && !strong;
    if (!strong && !through) continue;
    hand = make(spec, data);
    path = Darting{};
  }
  return counts;
}

}  // namespace

Findings pop_through_rows(const HapticsBench& bench) {
  Counts ours, papers;
  std::mutex guard;
  std::atomic<int64_t> next{0};
  const int64_t scenes = std::max<int64_t>(1, bench.frames / kFramesPerScene);
  const auto work = [&] {
    for (int64_t scene = next++; scene < scenes; scene = next++) {
      const Counts our = darts(
          uint32_t(scene), kFramesPerScene,
          [](const SceneSpec& spec, const auto& data) {
            return std::make_unique<test::Hand>(spec, std::vector{data}, bare());
          },
          [](const test::Hand& hand) -> const VolumeRun& {
            return hand.haptics.run()->volumes.front();
          });
      Counts paper;
      if (scene % 20 == 0)
        paper = darts(
            uint32_t(scene), kFramesPerScene,
            [](SceneSpec spec, const auto& data) {
              spec.volumes.front().back_tracking = BackTracking::kPicard;
              return std::make_unique<PaperHand>(spec, std::vector{data});
            },
            [](const PaperHand& hand) -> const VolumeRun& {
              return hand.loop.run().volumes.front();
            });
      const std::lock_guard lock(guard);
      ours += our;
      papers += paper;
    }
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < bench.threads; ++t) others.emplace_back(work);
  work();
  others.clear();
  const auto million = [](int64_t n) { return 1e-6 * double(n); };
  Findings findings;
  findings.goals.push_back(
      {"pop-through below the strength: probe to 1 m/s, wall to 0.3 m/s, one voxel thin",
       "\"pop-through\" seen",
       "",
       0.0,
       {},
       double(ours.through),
       0,
       fmt::format(
           "in {:.1f} million frames, {:.1f} of them in contact, proxy at most {:.2f} voxel "
           "behind the wall's middle; the paper's loop {} in {:.1f} million",
           million(ours.frames), million(ours.contact), ours.deepest_m / kVoxel_m, papers.through,
           million(papers.frames))});
  return findings;
}

}  // namespace palpate::bench
