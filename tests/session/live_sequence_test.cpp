// A live source while it is felt: frames arrive one by one; the test ticks the session as a host
// does.
#include "module/session/live_sequence.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <thread>

#include "compute/volume/phantom.h"
#include "integration/files/read_volume.h"
#include "integration/loading/load_scene.h"
#include "module/haptics/servo/monotonic.h"
#include "tests/session/made_session.h"
#include "tests/support/device.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;

constexpr int64_t kMs = 1'000'000;
// As in session_test.cpp for frames of a file.
constexpr double kStep_n = 0.1;
// Several of these are shorter than ctest's limit for a test.
constexpr std::chrono::seconds kLongest{180};

LoadedScene scene_of(const Volume& first) {
  auto given = std::make_shared<loading::GivenVolume>();
  given->frames = LiveSequence::standing(first);
  loading::SequenceChoices choices;
  choices.given["live"] = given;
  choices.values = CarriedValues::kOwn;
  auto scene = loading::load_scene({"live"}, choices);
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  if (!scene) return {};
  LiveSequence::prepare(*scene, 0);
  return std::move(*scene);
}

class LiveFrames : public test::DeviceTest {
 protected:
  void begin(const Volume& first, bool keep_cycles) {
    auto session = Session::start_in_host(scene_of(first), test::host_device(), {});
    ASSERT_TRUE(session) << session.error().message;
    session_ = std::move(*session);
    LiveSequenceOptions options;
    options.open_context = [this]() -> Result<std::shared_ptr<vulkan::Context>> {
      if (to_throw_.fetch_sub(1) > 0) throw std::runtime_error("the driver has fallen over");
      return context();
    };
    options.keep_cycles = keep_cycles;
    options.on_note = [this](const std::string& note) {
      const std::lock_guard lock(mutex_);
      notes_ += note + "\n";
      if (notes_throw_) throw 17;
    };
    live_ = std::make_unique<LiveSequence>(*session_, 0, first, std::move(options));
  }
  void TearDown() override {
    live_.reset();
    session_.reset();
  }
  std::string notes() {
    const std::lock_guard lock(mutex_);
    return notes_;
  }
  /// Ticks one millisecond, which takes about as long, at distance r from the middle along a
  /// slanted line.
  double at(double r_m) {
    time_ns_ += kMs;
    const glm::dvec3 force_n =
        session_->tick({r_m * glm::normalize(glm::dvec3(0.3, 0.4, 0.9)), time_ns_});
    worst_step_n_ = std::max(worst_step_n_, glm::length(force_n - last_n_));
    last_n_ = force_n;
    return glm::length(force_n);
  }
  /// Pushes a frame, and ticks at r for 100 ms.
  void push_for_100_ms(const Volume& frame, double r_m) {
    pushed_ns_.push_back(monotonic_ns());
    live_->push(frame, pushed_ns_.back());
    const auto until = std::chrono::steady_clock::now() + 100ms;
    tick_until(r_m, [&] { return std::chrono::steady_clock::now() > until; });
  }
  /// Pushes the first frame, the second, ... until the condition is true. Motion is estimated
  /// meanwhile, on a busy machine for more frames: it is the time that has a limit.
  template <class Condition, class Push>
  void push_until(Condition condition, Push push, std::chrono::seconds longest = kLongest) {
    const auto end = std::chrono::steady_clock::now() + longest;
    for (size_t n = 1; !condition() && std::chrono::steady_clock::now() < end; ++n) push(n);
  }
  /// The mean time between two such pushes: longer than 100 ms on a busy machine.
  double seconds_per_push() const {
    return 1e-9 * double(pushed_ns_.back() - pushed_ns_.front()) / double(pushed_ns_.size() - 1);
  }
  double press(double force_n) {
    for (double r_m = 0.07; r_m > 0.005; r_m -= 10e-6)
      if (at(r_m) > force_n) return r_m;
    return 0.0;
  }
  /// Ticks at r until the condition is true. False: it was not within this time.
  template <class Condition>
  bool tick_until(double r_m, Condition condition, std::chrono::seconds most = 60s) {
    const auto start = std::chrono::steady_clock::now();
    for (int tick = 1; !condition(); ++tick) {
      if (std::chrono::steady_clock::now() > start + most) return false;
      const double force_n = at(r_m);
      least_n_ = std::min(least_n_, force_n);
      most_n_ = std::max(most_n_, force_n);
      // The loop's time must advance as that of the frames.
      std::this_thread::sleep_until(start + tick * 1ms);
    }
    return true;
  }

  std::unique_ptr<Session> session_;
  std::unique_ptr<LiveSequence> live_;
  std::vector<int64_t> pushed_ns_;
  double worst_step_n_ = 0.0, least_n_ = 1e9, most_n_ = 0.0;
  // How often opening the device fails.
  std::atomic<int> to_throw_{0};
  std::atomic<bool> notes_throw_{false};

 private:
  int64_t time_ns_ = 5'000'000'000;
  glm::dvec3 last_n_{0.0};
  std::mutex mutex_;
  std::string notes_;
};

TEST_F(LiveFrames, AreFollowedUnderTheHandWithoutAStepOfTheForce) {
  const Sequence shell = shell_phantom(40, 8, 1, 0.0);
  begin(shell.frames[0], false);
  const double r_m = press(0.5);
  ASSERT_GT(r_m, 0.01);
  worst_step_n_ = 0.0;
  for (size_t k = 1; k <= 16; ++k) {
    live_->push(shell.frames[k % 8], monotonic_ns());
    ASSERT_TRUE(tick_until(r_m, [&] { return live_->numbers().felt >= k; })) << "frame " << k;
  }
  const LiveNumbers numbers = live_->numbers();
  EXPECT_EQ(numbers.received, 16u);
  EXPECT_EQ(numbers.felt, 16u);
  EXPECT_EQ(numbers.newer_came, 0u);
  EXPECT_GT(numbers.delay_median_s, 0.0);
  EXPECT_GE(numbers.delay_p95_s, numbers.delay_median_s);
  EXPECT_LT(worst_step_n_, kStep_n);
  // The wall did move.
  EXPECT_GT(most_n_ - least_n_, 0.3);
  // No frame arrives: the wall rests, and the force is constant.
  for (int k = 0; k < 500; ++k) at(r_m);
  const double resting_n = at(r_m);
  for (int k = 0; k < 500; ++k) EXPECT_NEAR(at(r_m), resting_n, 0.02);
}

TEST_F(LiveFrames, ThatComeOnceMoreDoNotMove) {
  // With noise, a detail that coefficients of a spline do not have.
  Volume first = shell_phantom(40, 8, 1, 0.0).frames[0];
  std::mt19937 random(7);
  std::uniform_real_distribution<float> noise(-20.0F, 20.0F);
  for (float& value : first.values) value += noise(random);
  begin(first, false);
  for (size_t k = 1; k <= 2; ++k) {
    live_->push(first, monotonic_ns());
    ASSERT_TRUE(tick_until(0.07, [&] { return live_->numbers().felt >= k; }));
    EXPECT_EQ(session_->scene()->volumes[0].data->motions[0].steps[k - 1]->largest_u_m(), 0.0) << k;
  }
}

TEST_F(LiveFrames, AreFollowedAfterAnException) {
  const Sequence shell = shell_phantom(40, 8, 1, 0.0);
  to_throw_ = 1;
  notes_throw_ = true;
  begin(shell.frames[0], false);
  live_->push(shell.frames[1], monotonic_ns());
  const double r_m = press(0.5);
  ASSERT_GT(r_m, 0.01);
  ASSERT_TRUE(tick_until(r_m, [&] { return live_->numbers().felt >= 1; }));
  EXPECT_NE(notes().find("the driver has fallen over"), std::string::npos) << notes();
  EXPECT_LE(to_throw_, -1) << "opening was not tried again";
}

TEST_F(LiveFrames, ArriveWhereTheirOwnSurfaceIs) {
  // Frame 3 of a live source, and the same frame alone: the same wall at the same place.
  const Sequence shell = shell_phantom(40, 8, 1, 0.0);
  begin(shell.frames[3], false);
  const double alone_m = press(0.5);
  ASSERT_GT(alone_m, 0.01);
  TearDown();
  begin(shell.frames[0], false);
  for (size_t k = 1; k <= 3; ++k) {
    live_->push(shell.frames[k], monotonic_ns());
    ASSERT_TRUE(tick_until(0.07, [&] { return live_->numbers().felt >= k; }));
  }
  EXPECT_NEAR(press(0.5), alone_m, 1e-4);
}

TEST_F(LiveFrames, TheNewestWinsAndTheOthersAreCounted) {
  const Sequence shell = shell_phantom(40, 8, 1, 0.0);
  begin(shell.frames[0], false);
  for (size_t k = 1; k <= 40; ++k) live_->push(shell.frames[k % 8], monotonic_ns());
  ASSERT_TRUE(tick_until(0.07, [&] {
    const LiveNumbers now = live_->numbers();
    return now.felt + now.newer_came == 40;
  }));
  EXPECT_GT(live_->numbers().newer_came, 30u);
}

TEST_F(LiveFrames, OfAnotherGridAreBroughtOntoTheFirstOnes) {
  const Sequence shell = shell_phantom(40, 8, 1, 0.0);
  begin(shell.frames[0], false);
  Grid finer = shell.frames[1].grid;
  finer.size = glm::ivec3(50);
  finer.spacing_mm *= 0.8;
  live_->push(resampled(shell.frames[1], finer), monotonic_ns());
  ASSERT_TRUE(tick_until(0.07, [&] { return live_->numbers().felt == 1; }));
  Volume away = shell.frames[2];
  away.grid.origin_mm.x += 1000.0;
  live_->push(away, monotonic_ns());
  EXPECT_EQ(live_->numbers().elsewhere, 1u);
  EXPECT_NE(notes().find("elsewhere in space"), std::string::npos);
}

TEST_F(LiveFrames, ThatRepeatBecomeACycleUntilTheyNoLongerDo) {
  const Sequence shell = shell_phantom(32, 8, 1, 0.0);
  // Half grown: so the growth that follows stays below the largest force.
  begin(shell.frames[2], true);
  const double r_m = press(0.5);
  ASSERT_GT(r_m, 0.01);
  worst_step_n_ = 0.0;
  const auto every_100_ms = [&](size_t frame) { push_for_100_ms(shell.frames[frame], r_m); };
  size_t k = 3;
  push_until([&] { return live_->numbers().cycle_s > 0.0; },
             [&](size_t) { every_100_ms(k++ % 8); });
  EXPECT_NEAR(live_->numbers().cycle_s, 8.0 * seconds_per_push(), seconds_per_push());
  EXPECT_NE(notes().find("repeat every"), std::string::npos) << notes();
  EXPECT_TRUE(session_->scene()->volumes[0].data->whole);
  for (const size_t more = k + 16; k < more; ++k) every_100_ms(k % 8);
  EXPECT_GT(live_->numbers().kept, 5u);
  // Further cycles improve the motion, without a step of the force.
  const auto first = session_->scene()->volumes[0].data;
  // How many are in it by now depends on the machine.
  EXPECT_GE(live_->numbers().cycles, 1);
  EXPECT_LT(live_->numbers().cycles, 3);
  push_until([&] { return live_->numbers().cycles >= 3; }, [&](size_t) { every_100_ms(k++ % 8); });
  EXPECT_GE(live_->numbers().cycles, 3);
  const auto refined = session_->scene()->volumes[0].data;
  EXPECT_NE(refined->whole, first->whole);
  EXPECT_GE(live_->numbers().kept, 16u);
  EXPECT_EQ(refined->frames.front(), first->frames.front());
  EXPECT_FALSE(refined->whole->may_fold());
  // It stands still at one phase: this is no cycle.
  push_until([&] { return live_->numbers().cycle_s == 0.0; }, [&](size_t) { every_100_ms(3); });
  EXPECT_EQ(live_->numbers().cycle_s, 0.0);
  EXPECT_EQ(live_->numbers().cycles, 0);
  EXPECT_NE(notes().find("no longer repeat"), std::string::npos) << notes();
  EXPECT_LT(worst_step_n_, kStep_n);
}

TEST_F(LiveFrames, OfARealHeartBecomeACycleThatFurtherBeatsRefine) {
  const std::filesystem::path folder = PALPATE_SHARED_DATA "/heart_cine";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "There is no " << folder;
  std::vector<Volume> frames;
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0.0F, 3.0F);
  // Every second frame: ten of a beat.
  for (int k = 0; k < 20; k += 2) {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%02d.mha", k);
    auto frame = files::read_volume(folder / name);
    ASSERT_TRUE(frame) << frame.error().message;
    frames.push_back(std::move(*frame));
  }
  begin(frames[0], true);
  const double r_m = press(0.3);
  ASSERT_GT(r_m, 0.005);
  worst_step_n_ = 0.0;
  // Another part of it for each frame: drawing numbers for all would take most of the time.
  std::vector<float> noise(frames[0].values.size() + 4096);
  for (float& value : noise) value = normal(random);
  push_until([&] { return live_->numbers().cycles >= 2; },
             [&](size_t n) {
               Volume noisy = frames[n % 10];
               const float* const added = &noise[531 * n % 4096];
               for (size_t v = 0; v < noisy.values.size(); ++v) noisy.values[v] += added[v];
               push_for_100_ms(noisy, r_m);
             },
             500s);
  ASSERT_GE(live_->numbers().cycles, 2) << notes();
  EXPECT_NEAR(live_->numbers().cycle_s, 10.0 * seconds_per_push(), 2.0 * seconds_per_push());
  EXPECT_FALSE(session_->scene()->volumes[0].data->whole->may_fold());
  EXPECT_LT(worst_step_n_, kStep_n);
  std::printf("cycles %d, largest change %.3f N/ms\n", live_->numbers().cycles, worst_step_n_);
}

/// A small volume that depends on a phase, with noise.
Volume noisy(double phase, std::mt19937& random, double noise) {
  Volume volume;
  volume.grid.size = glm::ivec3(16);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int v = 0; v < 16 * 16 * 16; ++v)
    volume.values.push_back(float(100.0 * std::sin(phase + 0.01 * v) + noise * normal(random)));
  return volume;
}

std::optional<int> period_of(const std::function<double(int)>& phase, int frames, double noise) {
  std::mt19937 random(7);
  Repetition repetition;
  for (int n = 0; n < frames; ++n)
    if (const auto found = repetition.add(noisy(phase(n), random, noise))) return found;
  return std::nullopt;
}

TEST(RepetitionOfFrames, IsFoundInNoiseAndOnlyWhereItIs) {
  for (const int period : {6, 13, 20, 37})
    for (const double noise : {0.0, 20.0})
      EXPECT_EQ(period_of([&](int n) { return 2 * M_PI * n / period; }, 4 * period, noise), period)
          << period << " frames, noise " << noise;
  EXPECT_FALSE(period_of([](int) { return 0.3; }, 160, 20.0));  // stands still
  EXPECT_FALSE(period_of([](int) { return 0.3; }, 160, 0.0));
  // Faster and faster.
  EXPECT_FALSE(period_of([](int n) { return 0.002 * n * n; }, 60, 0.0));
  EXPECT_FALSE(period_of([](int n) { return 3.0 * std::sin(0.0005 * n * n); }, 70, 20.0));
}

TEST(RepetitionOfFrames, GoingToAndFroIsToldApartByWhereItWas) {
  // Frames 1 and 3, 0 and 4, 5 and 7 are equal.
  std::mt19937 random(7);
  Repetition repetition;
  const auto to_and_fro = [&](int k) {
    return noisy(std::sin(2.0 * 3.141592653589793 * (k - 2) / 8.0 + 1.5707963267948966), random,
                 1.0);
  };
  for (int k = 0; k < 8; ++k) repetition.add(to_and_fro(k));
  const auto means = repetition.last(8);
  EXPECT_EQ(Repetition::nearest(to_and_fro(3), means, 2.9, 3.0).frame, 3);
  EXPECT_EQ(Repetition::nearest(to_and_fro(3), means, 0.8, 3.0).frame, 1);
  EXPECT_EQ(Repetition::nearest(to_and_fro(0), means, 7.6, 3.0).frame, 0);
  EXPECT_EQ(Repetition::nearest(to_and_fro(7), means, -1.2, 3.0).frame, 7);
  // Frames 2 and 6 are like no other frame, so the time does not change the result.
  EXPECT_EQ(Repetition::nearest(to_and_fro(6), means, 2.0, 3.0).frame, 6);
}

}  // namespace
}  // namespace palpate
