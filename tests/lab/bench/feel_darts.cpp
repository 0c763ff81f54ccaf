#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <glm/gtc/constants.hpp>

#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/stability/darts.h"
#include "tests/lab/stability/thin_shell.h"

namespace palpate::bench {
namespace {

using stability::Darts;
using test::Random;

constexpr double kVoxel_m = 1e-3;
constexpr double kWallSpeed_m_per_s = 0.3, kHandSpeed_m_per_s = 1.0;
constexpr int kFramesPerScene = 100'000, kScenesPerPaper = 20;

SceneSpec drawn_scene(Random& random, double& frames_per_second) {
  SceneSpec spec = stability::dart_spec(random.draw(0.0, 0.8));
  // The data move by at most 5 mm from one frame to the next; the swing gets the remaining speed.
  frames_per_second = random.draw(1.0, 40.0);
  const double data_m_per_s = 0.005 * frames_per_second;
  VolumeSpec& volume = spec.volumes.front();
  volume.path = PosePath::kExact;
  volume.drive.kind = DriveSpec::Kind::kSwing;
  volume.drive.axis = random.direction();
  volume.drive.amplitude_m = random.draw(0.002, 0.010);
  volume.drive.rate_hz =
      (kWallSpeed_m_per_s - data_m_per_s) / (glm::two_pi<double>() * volume.drive.amplitude_m);
  const double angle = random.draw(0.0, 3.0);
  volume.transform.rotation = glm::angleAxis(angle, random.direction());
  return spec;
}

Darts scene_of(uint32_t seed, bool palpate) {
  Random random(seed);
  double fps = 1.0;
  const SceneSpec spec = drawn_scene(random, fps);
  return stability::darted(spec, stability::thin_shell(fps),
                           {0.02 * kHandSpeed_m_per_s, kHandSpeed_m_per_s, palpate},
                           kFramesPerScene, random);
}

}  // namespace

Findings dart_rows(const FeelBench& bench) {
  Darts ours, papers;
  std::mutex guard;
  std::atomic<int64_t> next{0};
  const int64_t scenes = std::max<int64_t>(1, bench.frames / kFramesPerScene);
  const auto work = [&] {
    for (int64_t scene = next++; scene < scenes; scene = next++) {
      const Darts our = scene_of(uint32_t(scene), true);
      const Darts paper = scene % kScenesPerPaper == 0 ? scene_of(uint32_t(scene), false) : Darts{};
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
