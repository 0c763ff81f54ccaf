// A shell one voxel thin between a fast hand and a fast wall. Oracle: the shell's radius in closed
// form; a proxy nearer to the centre than the middle of the shell has passed through.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

constexpr double kPopStiffness = 600.0;  // N/m
constexpr double kStrength_n = 6.0;
// The hand stays where the spring pulls with less than this. In one frame hand (1 mm) and wall (0.3
// mm) may add 0.8 N before the next check.
constexpr double kMostSpring_n = 5.0;
constexpr double kPopVoxel_m = 2e-3;
constexpr int kPopFrames = 4;

/// A layer of value 1000 around a radius; its width at half its height is one voxel.
Volume thin_frame(const Grid& grid, double radius_mm) {
  Volume frame{grid, std::vector<float>(grid.count())};
  const double width_mm = grid.finest_mm() / 2.355;  // full width at half height
  for (int z = 0; z < grid.size.z; ++z)
    for (int y = 0; y < grid.size.y; ++y)
      for (int x = 0; x < grid.size.x; ++x) {
        const double r = glm::length(grid.lps_from_index({x, y, z}));
        const double t = (r - radius_mm) / width_mm;
        frame.values[grid.offset(x, y, z)] = float(1000.0 * std::exp(-0.5 * t * t));
      }
  return frame;
}

/// The beating shell as samples; it moves fastest from its smallest state to the next.
std::shared_ptr<const MovingVolume> thin_shell(double frames_per_second) {
  auto volume = std::make_shared<MovingVolume>();
  volume->name = "shell";
  const Grid grid = shell_grid(1e3 * kPopVoxel_m);
  Motion motion{"data", {}};
  for (int k = 0; k < kPopFrames; ++k) {
    volume->frames.push_back(sampled_scalar(thin_frame(grid, shell_radius_mm(k, kPopFrames))));
    volume->times.times_s.push_back(k / frames_per_second);
    motion.steps.push_back(MotionMap::of(shell_truth(grid, k, (k + 1) % kPopFrames, kPopFrames)));
  }
  volume->times.cycle_s = kPopFrames / frames_per_second;
  volume->motions.push_back(motion);
  return volume;
}

/// Frames per second at which the wall's fastest step has this speed, m/s.
double rate_for(double wall_m_per_s) {
  double step_m = 0.0;
  for (int k = 0; k < kPopFrames; ++k)
    step_m = std::max(step_m, 1e-3 * std::abs(shell_radius_mm(k + 1, kPopFrames) -
                                              shell_radius_mm(k, kPopFrames)));
  return wall_m_per_s / step_m;
}

SceneSpec thin_spec(double friction) {
  SceneSpec spec = shell_spec(kStrength_n, friction, kPopStiffness);
  // The spline lowers a layer one voxel thick to about 0.6 of its height.
  spec.modes[0].strength = *TransferFunction::stepped({0.0, 200.0}, {0.0, kStrength_n});
  return spec;
}

/// A hand that moves fast and at random: towards one random place after another, at up to 1 m/s. It
/// stops where the spring would exceed its limit.
class Darting {
 public:
  explicit Darting(uint32_t seed) : random_(seed) { aim(); }
  /// The next place of the probe, from its present place and the proxy's.
  glm::dvec3 next(glm::dvec3 probe, glm::dvec3 proxy) {
    const glm::dvec3 way = aim_ - probe;
    const double length = glm::length(way), step = 1e-3 * speed_;
    glm::dvec3 to = length > step ? probe + way * (step / length) : aim_;
    if (length <= step || --left_ == 0) aim();
    const double reach = kMostSpring_n / kPopStiffness, pull = glm::length(to - proxy);
    // The hand gives way, but not faster than its largest speed.
    if (pull > reach) {
      const glm::dvec3 back = proxy + (to - proxy) * (reach / pull) - probe;
      const double fast = glm::length(back);
      to = probe + (fast > 1e-3 ? back * (1e-3 / fast) : back);
    }
    return to;
  }

 private:
  void aim() {
    const double radius =
        random_.draw(0.0, 1.0) < 0.5 ? random_.draw(0.015, 0.027) : random_.draw(0.030, 0.045);
    glm::dvec3 direction = random_.vector(1.0);
    while (!(glm::length(direction) > 0.1)) direction = random_.vector(1.0);
    aim_ = radius * glm::normalize(direction);
    speed_ = random_.draw(0.02, 1.0);
    left_ = 1 + int(random_.draw(0.0, 80.0));
  }
  test::Random random_;
  glm::dvec3 aim_{0.0};
  double speed_ = 1.0;
  int left_ = 1;
};

struct Crossings {
  int64_t frames = 0, through = 0, touching = 0, above = 0;
  double largest_n = 0.0;
};

Crossings run(Hand& hand, uint32_t seed, int64_t frames) {
  Crossings found;
  Darting darting(seed);
  glm::dvec3 probe(0.045, 0.0, 0.0), proxy = probe;
  for (int64_t i = 0; i < frames; ++i) {
    probe = darting.next(probe, proxy);
    const TickOutput out = hand.to(probe);
    proxy = out.proxy_m;
    const double force = glm::length(out.wanted_n);
    found.largest_n = std::max(found.largest_n, force);
    found.touching += force > 0.0;
    found.above += force >= kStrength_n;
    ++found.frames;
    const double wall = shell_radius_m(out.first, kPopFrames);
    if (glm::length(out.proxy_m) >= wall) continue;
    ++found.through;
    if (found.through <= 5)
      ADD_FAILURE() << "seed " << seed << " frame " << i << ": proxy at "
                    << 1e3 * glm::length(out.proxy_m) << " mm, wall at " << 1e3 * wall
                    << " mm, force " << force << " N, pieces " << int(out.substeps);
    // Starts outside again, so that crossings are counted, not frames inside.
    hand.haptics.adopt(Haptics::prepare(hand.haptics.run()->scene));
    break;
  }
  return found;
}

int64_t asked_frames(int64_t usual) {
  const char* asked = std::getenv("PALPATE_POP_THROUGH_FRAMES");
  return asked ? std::max<int64_t>(std::atoll(asked), 1000) : usual;
}

// PALPATE_POP_THROUGH_FRAMES=100000000 gives the long run.
TEST(PopThrough, DoesNotHappenBelowTheStrengthHoweverFastHandAndWallAre) {
  const int64_t frames = asked_frames(1'000'000);
  Crossings all;
  int64_t runs = 0;
  for (const double wall_m_per_s : {0.0, 0.1, 0.3}) {
    const auto data = thin_shell(wall_m_per_s > 0.0 ? rate_for(wall_m_per_s) : 1e-9);
    for (const double friction : {0.0, 0.4}) {
      // Many short runs: the hand meets the wall at different phases.
      const int64_t each = std::max<int64_t>(frames / 6 / 20, 1000);
      for (int64_t done = 0; done < frames / 6; done += each, ++runs) {
        Hand hand(thin_spec(friction), {data});
        const Crossings found = run(hand, uint32_t(1 + runs), each);
        all.frames += found.frames;
        all.through += found.through;
        all.touching += found.touching;
        all.above += found.above;
        all.largest_n = std::max(all.largest_n, found.largest_n);
        ASSERT_LT(all.through, 20);
      }
    }
  }
  std::printf("pop-through: %ld of %ld frames, %ld touching, largest force %.3f N\n",
              long(all.through), long(all.frames), long(all.touching), all.largest_n);
  EXPECT_EQ(all.through, 0);
  EXPECT_GT(all.touching, all.frames / 4)
      << "the hand must be at the wall for this test to check anything";
  EXPECT_EQ(all.above, 0) << "the hand's law keeps the spring below the strength";
}

}  // namespace
}  // namespace palpate
