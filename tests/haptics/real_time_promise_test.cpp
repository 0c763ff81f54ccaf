// What the servo thread guarantees: after its start it allocates nothing, takes no lock and writes
// nothing, with any scene and any control event.
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <shared_mutex>

#include "module/haptics/scene_ticker.h"
#include "module/haptics/servo/black_box.h"
#include "module/haptics/servo/recording.h"
#include "module/haptics/servo/servo.h"
#include "tests/haptics/forbidden_calls.h"
#include "tests/haptics/servo/servo_fakes.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {

using namespace test;

constexpr int kFrames = 4;

/// All at once: a beating volume that rotates, volumes that a second hand or keys move, one that
/// stands still; modes of every kind.
SceneSpec everything() {
  SceneSpec spec = shell_spec(8.0, 0.4, 600.0);
  spec.damping_n_s_per_m = 0.5;
  spec.tool_radius_m = 0.002;
  spec.volumes[0].drive.kind = DriveSpec::Kind::kTurn;
  spec.volumes[0].drive.rate_hz = 0.5;
  spec.volumes[0].path = PosePath::kExact;
  for (const char* name : {"moved", "paper", "still", "keyed"}) {
    spec.volumes.push_back(spec.volumes[0]);
    VolumeSpec& volume = spec.volumes.back();
    volume.name = name;
    volume.drive.kind = DriveSpec::Kind::kSecondHand;
    volume.path = volume.name == "moved" ? PosePath::kSmooth : PosePath::kPaper;
    if (volume.name == "still") volume.drive.kind = DriveSpec::Kind::kStill;
    if (volume.name == "keyed") {
      KeyedPose pose;
      pose.translation_m = {{0.0, 0.5, 1.0}, {{0, 0, 0}, {0.01, 0, 0}, {0, 0, 0}}, 0.7, true};
      volume.drive.kind = DriveSpec::Kind::kKeys;
      volume.drive.poses = {pose};
      volume.path = PosePath::kExact;
    }
    volume.transform.translation_m = {0.0, 0.01, 0.0};
  }
  const char* kinds[] = {"surface",   "follow",       "front",   "vortex",   "gradient-force",
                         "attractor", "vector-force", "surface", "viscosity"};
  const char* volumes[] = {"shell", "moved", "paper", "still", "keyed"};
  spec.modes.clear();
  for (int m = 0; m < 9; ++m) {
    ModeSpec mode = shell_spec(8.0, 0.4, 600.0).modes[0];
    mode.name = "mode " + std::to_string(m);
    mode.kind = kinds[m];
    mode.volume = volumes[m % 5];
    if (m > 0 && m < 7) mode.strength = TransferFunction::constant(0.3);
    mode.gain = 1e-6;
    spec.modes.push_back(mode);
  }
  return spec;
}

std::vector<std::shared_ptr<const MovingVolume>> data_for_everything() {
  const auto beating = shell(kFrames, 2.0, Made::kSampled, 4.0);
  return {beating, shell(1, 1.0, Made::kSampled, 4.0), beating, shell(1, 1.0), beating};
}

/// Moves in and out of the scene, and reports a fault now and then. Stores nothing, so that it
/// allocates nothing itself.
class MovingDevice : public ForceDevice {
 public:
  DeviceInfo info() const override { return Hand::device(); }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    if (watch_) ForbiddenCalls::watch_this_thread(true);
    ++exchanges;
    if (command.force_n != glm::dvec3(0.0)) pushed = true;
    DeviceReading reading;
    const double t = 1e-3 * exchanges;
    reading.position_m = (0.029 + 0.008 * std::cos(2.0 * t)) *
                         glm::dvec3(std::cos(t), 0.8 * std::sin(t), 0.6 * std::sin(t));
    reading.time_ns = clock_ ? clock_->now_ns() : int64_t(exchanges) * 1'000'000;
    reading.fresh = true;
    if (exchanges % 6000 > 5900) reading.fault = DeviceFault::kUnplugged;
    if (exchanges % 7001 == 7000) reading.position_m.x = std::nan("");
    return reading;
  }
  void watch_its_thread(ServoClock* clock) {
    watch_ = true;
    clock_ = clock;
  }
  std::atomic<int> exchanges{0};
  std::atomic<bool> pushed{false};

 private:
  bool watch_ = false;
  ServoClock* clock_ = nullptr;
};

/// Control events of a person and poses of a second hand.
template <class Send>
void play(int i, const Send& send) {
  using Kind = ControlEvent::Kind;
  const auto event = [&](Kind kind, int index, double value) {
    send(ControlEvent{kind, index, value});
  };
  if (i % 97 == 0) event(Kind::kModeOn, i / 97 % 8, i / 97 % 2);
  if (i % 131 == 0) event(Kind::kModeGain, i / 131 % 8, 0.5 + i % 3);
  if (i % 211 == 0) event(Kind::kRate, 0, i / 211 % 2 ? -3.0 : 2.0);
  if (i % 307 == 0) event(Kind::kScrub, 2, 0.3 * (i % 5));
  if (i % 401 == 0) event(Kind::kStiffness, 0, i / 401 % 2 ? 900.0 : 500.0);
  if (i % 5003 == 5002) event(Kind::kStop, 0, 0.0);
  if (i % 5003 == 300) event(Kind::kRearm, 0, 0.0);
  if (i % 16 == 0) {
    PoseUpdate pose;
    pose.volume = 1 + i / 16 % 2;
    pose.time_ns = 5'000'000'000 + int64_t(i) * 1'000'000;
    pose.transform.rotation = glm::angleAxis(1e-3 * i, glm::dvec3(0.0, 0.0, 1.0));
    send(pose);
  }
}

/// Keeps the compiler from removing an allocation that is not used.
template <class Pointer>
Pointer kept(Pointer memory) {
  Pointer volatile looked_at = memory;
  return looked_at;
}

class RealTimePromise : public testing::Test {
 protected:
  void SetUp() override {
    if (!ForbiddenCalls::can_watch())
      GTEST_SKIP() << "A sanitizer stands in front of the C library here.";
    std::string name = (std::filesystem::temp_directory_path() / "palpate-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    ForbiddenCalls::count(true);
    ForbiddenCalls::forget();
  }
  void TearDown() override {
    ForbiddenCalls::watch_this_thread(false);
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }
  std::filesystem::path folder_;
};

TEST_F(RealTimePromise, IsWatchedByAnInterposerThatCatchesEveryKindOfCall) {
  std::mutex mutex;
  std::shared_mutex shared;
  std::condition_variable condition;
  const std::pair<const char*, std::function<void()>> breaches[] = {
      {"malloc", [] { ::operator delete(kept(::operator new(7))); }},
      {"malloc", [] { std::free(kept(std::malloc(9))); }},
      {"calloc", [] { std::free(kept(std::calloc(3, 3))); }},
      {"realloc", [] { std::free(kept(std::realloc(kept<void*>(nullptr), 30))); }},
      // operator new calls one of these two for a larger alignment: GCC 14's another than GCC 12's.
      {"aligned_alloc", [] { std::free(kept(std::aligned_alloc(64, 64))); }},
      {"posix_memalign",
       [] {
         void* memory = nullptr;
         EXPECT_EQ(::posix_memalign(&memory, 64, 64), 0);
         std::free(kept(memory));
       }},
      {"malloc", [] { kept(std::string(100, 'x').data()); }},
      {"pthread_mutex_lock", [&] { const std::lock_guard lock(mutex); }},
      {"pthread_rwlock_wrlock", [&] { const std::unique_lock lock(shared); }},
      {"pthread_rwlock_rdlock", [&] { const std::shared_lock lock(shared); }},
      {"pthread_cond_signal", [&] { condition.notify_one(); }},
      {"printf", [] { std::printf("said by %s\n", "a breach"); }},
      {"write", [] { EXPECT_EQ(::write(1, "", 0), 0); }},
      {"syscall", [&] { ::syscall(SYS_gettid); }},
  };
  for (const auto& [name, breach] : breaches) {
    ForbiddenCalls::forget();
    ForbiddenCalls::watch_this_thread(true);
    breach();
    ForbiddenCalls::watch_this_thread(false);
    EXPECT_GT(ForbiddenCalls::counted(), 0) << name << " is not caught";
    EXPECT_STREQ(ForbiddenCalls::first(), name);
  }
  ForbiddenCalls::forget();
  std::free(std::malloc(9));
  EXPECT_EQ(ForbiddenCalls::counted(), 0) << "a thread that is not watched is not counted";
}

TEST_F(RealTimePromise, IsKeptByTheLoopWithAWholeSceneRecorderBlackBoxAndNewScenes) {
  FakeClock clock;
  MovingDevice device;
  HapticsOptions options;
  options.safety.start_ramp_s = 0.1;
  // Some modes of this scene push everywhere, so the force is nowhere as low as the start gate
  // requires by default.
  options.safety.start_force_n = 2.0;
  SceneTicker ticker(options, device.info());
  const auto data = data_for_everything();
  const auto scene = plan(everything(), data);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_TRUE(ticker.offer(*scene));
  BlackBox box({folder_, 1000, 100, 0});
  auto recorder = TickRecorder::start(folder_ / "run.ticks", "everything", 1'000'000, {&box});
  ASSERT_TRUE(recorder);
  ServoPorts ports;
  ServoLoop loop(device, ticker, clock, ports, {}, {recorder->get()});
  int held = 0;
  TickOutput newest;
  for (int i = 0; i < 20'000; ++i) {
    play(i, [&](const auto& what) {
      if constexpr (std::is_same_v<std::decay_t<decltype(what)>, PoseUpdate>)
        ports.poses.push(what);
      else
        ports.events.push(what);
    });
    if (i % 777 == 776) {
      ticker.collect();
      ASSERT_TRUE(ticker.offer(*scene));
    }
    if (i % 3001 == 3000) clock.oversleep_ns = 8'000'000;
    ForbiddenCalls::watch_this_thread(true);
    const bool goes_on = loop.run_period();
    ForbiddenCalls::watch_this_thread(false);
    ASSERT_TRUE(goes_on);
    ASSERT_EQ(ForbiddenCalls::counted(), 0)
        << ForbiddenCalls::first() << " in period " << i << " of the loop";
    if (ports.outputs[0].get(newest)) held += newest.primitives > 0;
  }
  ports.stop = true;
  for (int i = 0; i < 2000; ++i) {
    ForbiddenCalls::watch_this_thread(true);
    const bool goes_on = loop.run_period();
    ForbiddenCalls::watch_this_thread(false);
    if (!goes_on) break;
  }
  EXPECT_EQ(ForbiddenCalls::counted(), 0) << ForbiddenCalls::first() << " while stopping";
  EXPECT_TRUE(device.pushed) << "the scene must be felt for this test to check anything";
  EXPECT_GT(held, 5000);
  EXPECT_TRUE((*recorder)->finish());
  EXPECT_FALSE(box.files().empty()) << "a recorder with a file passes ticks on, too";
}

TEST_F(RealTimePromise, IsKeptByTheThreadItself) {
  MonotonicClock clock;
  MovingDevice device;
  device.watch_its_thread(&clock);
  HapticsOptions options;
  options.safety.start_ramp_s = 0.1;
  SceneTicker ticker(options, device.info());
  const auto scene = plan(everything(), data_for_everything());
  ASSERT_TRUE(scene);
  ASSERT_TRUE(ticker.offer(*scene));
  BlackBox box({folder_, 1000, 100, 0});
  auto recorder = TickRecorder::start(folder_ / "thread.ticks", "everything", 1'000'000, {&box});
  ASSERT_TRUE(recorder);
  ServoOptions servo_options;
  servo_options.real_time = {.priority = 0, .core = -1, .lock_memory = false, .cores_awake = false};
  servo_options.listeners = {recorder->get()};
  auto servo = Servo::start(device, ticker, servo_options);
  ASSERT_TRUE(servo) << servo.error().message;
  for (int i = 0; i < 60'000 && (*servo)->statistics().ticks.load() < 600; ++i) {
    play(i, [&](const auto& what) { (*servo)->send(what); });
    if (i % 100 == 99) ticker.offer(*scene);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // The thread's end after its last tick is not covered by the guarantee.
  ForbiddenCalls::count(false);
  (*servo)->stop();
  EXPECT_GE((*servo)->statistics().ticks.load(), 600u);
  EXPECT_EQ(ForbiddenCalls::counted(), 0) << ForbiddenCalls::first() << " on the servo thread";
  EXPECT_TRUE((*recorder)->finish());
}

}  // namespace
}  // namespace palpate
