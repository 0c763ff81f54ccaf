// A recorded run repeated by a new Haptics gives the same bits, for all kinds of input, faults
// included.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "module/haptics/servo/recording.h"
#include "tests/haptics/shell_scene.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using namespace test;

/// points: of the tool; with several it is a finger pad.
SceneSpec two_volumes(int points = 1) {
  SceneSpec spec = shell_spec(6.0, 0.4, 700.0);
  spec.tool_points = points;
  spec.tool_radius_m = points > 1 ? 0.006 : 0.0;
  spec.damping_n_s_per_m = 0.4;
  spec.volumes[0].drive.kind = DriveSpec::Kind::kSecondHand;
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "turning";
  spec.volumes[1].drive.kind = DriveSpec::Kind::kTurn;
  spec.volumes[1].path = PosePath::kExact;
  spec.volumes[1].transform.translation_m = {0.012, 0.0, 0.0};
  for (const char* kind : {"surface", "gradient-force", "attractor", "tissue", "viscosity"}) {
    spec.modes.push_back(spec.modes[0]);
    spec.modes.back().name = kind;
    spec.modes.back().kind = kind;
    spec.modes.back().volume = "turning";
    spec.modes.back().gain = 1e-6;
    spec.modes.back().range_m = 0.02;
  }
  return spec;
}

std::unique_ptr<Haptics> fresh(const SceneSpec& spec) {
  static const std::vector<std::shared_ptr<const MovingVolume>> data = {
      shell(4, 3.0, Made::kSampled, 4.0), shell(1, 1.0)};
  HapticsOptions options;
  options.safety.start_ramp_s = 0.1;
  options.tank.capacity_j = 0.01;
  auto haptics = std::make_unique<Haptics>(options, Hand::device());
  const auto scene = plan(spec, data);
  if (!scene) throw std::runtime_error(scene.error().message);
  haptics->adopt(Haptics::prepare(*scene));
  return haptics;
}

/// The next tick's input of a random run with all kinds of events.
class RandomRun {
 public:
  explicit RandomRun(uint32_t seed) : random_(seed) {}
  TickInput next() {
    TickInput input;
    const auto chance = [&](double one_in) { return random_.draw(0.0, one_in) < 1.0; };
    input.dt_s = chance(50) ? random_.draw(0.0, 0.02) : random_.draw(0.0009, 0.0011);
    if (chance(2000)) input.dt_s = std::nan("");
    if (chance(3000)) input.dt_s = -1.0;
    if (std::isfinite(input.dt_s)) now_ns_ += int64_t(1e9 * input.dt_s);
    input.now_ns = now_ns_;
    input.late = chance(1000);
    input.stop = false;
    t_ += 1e-3;
    const double r = 0.027 + 0.007 * std::cos(3.0 * t_);
    input.reading.position_m =
        r * glm::dvec3(std::cos(t_), 0.8 * std::sin(t_), 0.6 * std::sin(t_)) + random_.vector(2e-5);
    input.reading.time_ns = now_ns_;
    input.reading.fresh = !chance(20);
    input.reading.buttons = uint32_t(random_.draw(0.0, 4.0));
    input.reading.grip.turns = !chance(30);
    if (input.reading.grip.turns)
      input.reading.grip.device_from_grip =
          glm::angleAxis(std::sin(2.0 * t_), glm::dvec3(0.6, 0.8, 0.0));
    if (chance(1500)) lost_ = 40;
    if (lost_ > 0 && --lost_ > 0) input.reading.fault = DeviceFault(1 + lost_ % 17);
    if (chance(1000)) input.reading.position_m.y = std::nan("");
    while (input.pose_count < 4 && chance(10)) {
      PoseUpdate& pose = input.poses[size_t(input.pose_count++)];
      pose.volume = int(random_.draw(-1.0, 3.0));
      pose.time_ns = now_ns_ - int64_t(random_.draw(0.0, 2e7));
      pose.transform.translation_m = random_.vector(0.003);
      pose.transform.rotation = glm::angleAxis(random_.draw(-0.3, 0.3), glm::dvec3(0.0, 1.0, 0.0));
      if (chance(20)) pose.transform.scale.x = -1.0;
    }
    while (input.event_count < 4 && chance(15)) {
      ControlEvent& event = input.events[size_t(input.event_count++)];
      event.kind = ControlEvent::Kind(int(random_.draw(0.0, 7.0)));
      event.index = int(random_.draw(-1.0, 6.0));
      event.value = chance(30) ? std::nan("") : random_.draw(-2.0, 3.0);
      if (event.kind == ControlEvent::Kind::kStiffness) event.value *= 400.0;
    }
    return input;
  }

 private:
  test::Random random_;
  int64_t now_ns_ = 1'000'000'000;
  double t_ = 0.0;
  int lost_ = 0;
};

TEST(Replay, OfARandomRunThroughAFreshHapticsGivesTheSameBits) {
  const auto folder = std::filesystem::temp_directory_path() / "palpate-haptics-replay";
  std::filesystem::create_directories(folder);
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    const auto path = folder / ("run" + std::to_string(seed) + ".ticks");
    auto recorder = TickRecorder::start(path, "two volumes", 1'000'000);
    ASSERT_TRUE(recorder) << recorder.error().message;
    const auto haptics = fresh(two_volumes(2 * int(seed) - 1));
    RandomRun run(seed);
    int felt = 0, causes = 0;
    for (int i = 0; i < 10'000; ++i) {
      const TickInput input = run.next();
      const TickOutput output = haptics->tick(input);
      ASSERT_TRUE(std::isfinite(glm::length(output.command.force_n))) << "seed " << seed;
      felt += glm::length(output.command.force_n) > 0.01;
      causes |= 1 << int(output.cause);
      (*recorder)->hear(input, output);
      // The recorder's thread empties its ring every 20 ms; a real run gives it that time.
      if (i % 2000 == 1999) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_GT(felt, 500) << "seed " << seed;
    EXPECT_GT(__builtin_popcount(unsigned(causes)), 5) << "seed " << seed;
    ASSERT_EQ((*recorder)->lost(), 0u);
    ASSERT_TRUE((*recorder)->finish());

    auto recording = Recording::read(path);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->ticks(), 10'000u);
    const auto again = fresh(two_volumes(2 * int(seed) - 1));
    const auto same = replay(*recording, *again);
    ASSERT_TRUE(same) << same.error().message;
    EXPECT_EQ(same->ticks, 10'000u);
    EXPECT_EQ(same->different, 0u) << "seed " << seed << ": first in tick " << same->first_different
                                   << ", field " << same->first_field;
    // A replay with a slightly different friction must differ.
    SceneSpec rougher = two_volumes();
    rougher.modes[0].friction = TransferFunction::constant(0.400001);
    recording->rewind();
    const auto other = replay(*recording, *fresh(rougher));
    ASSERT_TRUE(other);
    EXPECT_GT(other->different, 0u);
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace palpate
