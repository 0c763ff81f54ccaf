#include "tests/lab/soak/soak.h"

#include <malloc.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "compute/motion/estimator.h"
#include "compute/volume/phantom.h"
#include "integration/devices/simulated.h"
#include "module/haptics/scene_ticker.h"
#include "module/haptics/servo/servo.h"
#include "module/scene/built_in.h"
#include "tests/support/random.h"

namespace palpate::soak {
namespace {

using test::Random;
using Clock = std::chrono::steady_clock;

constexpr int kFrames = 4, kSize = 48;
constexpr int64_t kPeriod_ns = 1'000'000;
constexpr double kMostForce_n = 4.0;

int64_t own_time_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// Minor and major page faults of this thread.
int64_t page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

/// About 20 us of arithmetic in registers.
uint32_t fixed_work(uint32_t x) noexcept {
  for (int k = 0; k < 20'000; ++k) x = x * 1664525U + 1013904223U;
  return x;
}

void add(OwnTime& all, int64_t took_ns) noexcept {
  all.longest_ns = std::max(all.longest_ns, took_ns);
  all.all_ns += took_ns;
  all.count += took_ns > kPeriod_ns;
}

/// A simulated device that fails at random, as the bus, the firmware and the user may. Seeded; used
/// by the servo thread only.
class FailingDevice final : public ForceDevice {
 public:
  FailingDevice(devices::SimulatedOptions options, uint32_t seed)
      : device_(std::move(options)), random_(seed) {}
  DeviceInfo info() const override { return device_.info(); }

  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    // A disconnected device keeps no force: its motors go off.
    const bool gone = left_ > 0 && (kind_ == Kind::kUnplugged || kind_ == Kind::kTimeout);
    DeviceReading reading = device_.exchange(gone ? DeviceCommand{} : command);
    reading = failed(reading);
    if (stall_ms_ > 0) std::this_thread::sleep_for(std::chrono::milliseconds(stall_ms_));
    stall_ms_ = 0;
    return reading;
  }

  Injected injected;

 private:
  enum class Kind { kUnplugged, kTimeout, kGarbage, kJump, kNotNumber, kStale, kStall, kClockBack };

  void begin() noexcept {
    kind_ = Kind(std::min(7, int(random_.draw(0.0, 8.0))));
    switch (kind_) {
      case Kind::kUnplugged:
        left_ = int(random_.log_draw(50.0, 1500.0));
        ++injected.unplugged;
        break;
      case Kind::kTimeout:
        left_ = int(random_.draw(1.0, 30.0));
        ++injected.timeouts;
        break;
      case Kind::kGarbage:
        left_ = int(random_.draw(1.0, 10.0));
        ++injected.garbage;
        break;
      case Kind::kJump:
        left_ = 1;
        ++injected.jumps;
        break;
      case Kind::kNotNumber:
        left_ = int(random_.draw(1.0, 5.0));
        ++injected.not_numbers;
        break;
      case Kind::kStale:
        left_ = int(random_.draw(2.0, 60.0));
        ++injected.stale;
        break;
      case Kind::kStall:
        left_ = 1;
        stall_ms_ = int(random_.draw(2.0, 12.0));
        ++injected.stalls;
        break;
      case Kind::kClockBack:
        left_ = 1;
        ++injected.clock_back;
        break;
    }
  }

  DeviceReading failed(DeviceReading reading) noexcept {
    // Every 3 s on average: the force needs two of them to come up again.
    if (left_ == 0 && random_.draw(0.0, 1.0) < 1.0 / 3000.0) begin();
    if (left_ == 0) return reading;
    --left_;
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    switch (kind_) {
      case Kind::kUnplugged:
      case Kind::kTimeout:
        reading.fault = kind_ == Kind::kUnplugged ? DeviceFault::kUnplugged : DeviceFault::kTimeout;
        reading.fresh = false;
        break;
      case Kind::kGarbage:
        reading.fault = DeviceFault::kGarbage;
        reading.position_m = random_.vector(1e6);
        break;
      case Kind::kJump:
        reading.position_m += random_.vector(0.05);
        break;
      case Kind::kNotNumber:
        reading.position_m.y = kNan;
        break;
      case Kind::kStale:
        reading.fresh = false;
        break;
      case Kind::kStall:
        break;
      case Kind::kClockBack:
        reading.time_ns -= 2'000'000;
        break;
    }
    return reading;
  }

  devices::SimulatedDevice device_;
  Random random_;
  Kind kind_ = Kind::kStale;
  int left_ = 0, stall_ms_ = 0;
};

/// The haptic step with a measurement of its own processor time, and the reference work after it.
class TimedTicker final : public Ticker {
 public:
  TimedTicker(const HapticsOptions& options, const DeviceInfo& device) : scene(options, device) {
    // The servo thread does not allocate.
    long_.reserve(100);
    long_work_.reserve(100);
  }
  TickOutput tick(const TickInput& input) noexcept override {
    const int64_t faults = page_faults();
    const int64_t start = own_time_ns();
    const TickOutput output = scene.tick(input);
    const int64_t middle = own_time_ns();
    work_ = fixed_work(work_);
    const int64_t end = own_time_ns();
    add(own, middle - start);
    add(yardstick, end - middle);
    Work& work = works_[work_of(output)];
    if (middle - start <= kPeriod_ns) {
      ++work.count;
      work.all_ns += middle - start;
    } else if (long_.size() < long_.capacity()) {
      long_.push_back({middle - start, page_faults() > faults, output.substeps, output.primitives,
                       output.newton_steps, 0, 0.0});
      long_work_.push_back(work_of(output));
    }
    return output;
  }
  /// To be called after the loop has ended.
  std::vector<LongTick> long_ticks() const {
    std::vector<LongTick> all = long_;
    for (size_t n = 0; n < all.size(); ++n) {
      const Work& work = works_[long_work_[n]];
      all[n].others = work.count;
      all[n].others_mean_ns = work.count ? double(work.all_ns) / double(work.count) : 0.0;
    }
    return all;
  }
  SceneTicker scene;
  OwnTime own, yardstick;

 private:
  struct Work {
    uint64_t count = 0;
    int64_t all_ns = 0;
  };
  static size_t work_of(const TickOutput& output) noexcept {
    return std::min<size_t>(output.substeps, 31) << 8 |
           std::min<size_t>(output.primitives, 15) << 4 | std::min<size_t>(output.newton_steps, 15);
  }
  std::vector<Work> works_ = std::vector<Work>(32 * 256);
  std::vector<LongTick> long_;
  std::vector<size_t> long_work_;
  volatile uint32_t work_ = 1;
};

/// Checks every tick for effects that a hand in the device must never feel.
class Watch final : public TickListener {
 public:
  enum Broken { kNotFinite, kTooLarge, kTooFast, kForceInFault, kNoName, kBrokenKinds };

  void hear(const TickInput& input, const TickOutput& output) noexcept override {
    const glm::dvec3 force = output.command.force_n;
    const double newton = glm::length(force);
    const SafetyOptions usual;
    if (!std::isfinite(newton)) blame(kNotFinite);
    if (newton > kMostForce_n + 1e-9) blame(kTooLarge);
    const double dt_s = std::clamp(input.dt_s, 1e-3, 2e-3);
    if (glm::length(force - last_) > usual.max_slew_n_per_s * dt_s + 1e-9) blame(kTooFast);
    // The ramp takes 20 ms of at most 2 ms per tick, and one tick to begin.
    fault_s_ =
        input.reading.fault != DeviceFault::kNone ? fault_s_ + std::min(input.dt_s, 2e-3) : 0;
    if (fault_s_ > 0.030 && newton > 0.0) blame(kForceInFault);
    const bool off = newton == 0.0 && glm::length(output.wanted_n) > 0.5;
    if (off && output.cause == Cause::kNone) blame(kNoName);
    ++ticks;
    touching += output.command.in_contact;
    ++causes[size_t(output.cause) % causes.size()];
    last_ = force;
  }

  std::vector<std::string> broken() const {
    constexpr const char* kNames[] = {
        "a force is not finite", "a force is too large", "a force changes too fast",
        "a force is left while the device is at fault", "there is no force, and no cause is named"};
    std::vector<std::string> all;
    for (size_t k = 0; k < kBrokenKinds; ++k)
      if (seen_[k])
        all.push_back(
            fmt::format("{} ({} times, first in tick {})", kNames[k], seen_[k], first_[k]));
    return all;
  }

  uint64_t ticks = 0, touching = 0;
  std::array<uint64_t, 32> causes{};

 private:
  void blame(Broken kind) noexcept {
    if (!seen_[kind]++) first_[kind] = ticks;
  }
  std::array<uint64_t, kBrokenKinds> seen_{}, first_{};
  glm::dvec3 last_{0.0};
  double fault_s_ = 0.0;
};

/// A hand that moves in and out of the heart, and around it.
devices::ScriptedPath wandering(double seconds, uint32_t seed) {
  Random random(seed);
  std::vector<devices::ScriptedPath::PathPoint> points;
  glm::dvec3 towards(0.0, 0.0, 1.0);
  for (double t = 0.0; t < seconds + 5.0; t += random.draw(0.2, 0.8)) {
    towards = glm::normalize(towards + random.vector(0.7));
    const bool out = points.size() % 4 == 0 || t < 3.0;
    points.push_back({t, towards * (out ? 0.046 : random.draw(0.022, 0.038)), 0});
  }
  return devices::ScriptedPath(std::move(points));
}

/// Frames and motion of the heart, and fields for them as they are estimated.
class Fields {
 public:
  explicit Fields(const Options& options) : context_(options.context) {
    heart_ = shell_phantom(kSize, kFrames, 1, 0.01);
    auto volume = std::make_shared<MovingVolume>();
    volume->name = "heart";
    for (int k = 0; k < kFrames; ++k) {
      volume->frames.push_back(sampled_scalar(heart_.frames[size_t(k)]));
      volume->times.times_s.push_back(0.25 * k);
    }
    volume->times.cycle_s = 1.0;
    volume->motions.push_back({"data", {}});
    volume->motions.front().steps.resize(kFrames);
    base_ = volume;
  }
  /// The motion of a step, estimated or true.
  std::shared_ptr<const MotionMap> find(int step) const {
    if (!context_)
      return MotionMap::of(shell_truth(heart_grid(kSize), step, (step + 1) % kFrames, kFrames));
    EstimatorOptions options;
    options.motion = motion_preset("fast").value();
    const auto motion = estimate_motion(context_, heart_.frames[size_t(step)],
                                        heart_.frames[size_t((step + 1) % kFrames)], options);
    return motion ? MotionMap::of(motion->field, &motion->confidence) : nullptr;
  }
  const MovingVolume& base() const { return *base_; }

 private:
  std::shared_ptr<vulkan::Context> context_;
  Sequence heart_;
  std::shared_ptr<const MovingVolume> base_;
};

/// The owner's side: exchanges scenes and fields, sends control events and poses.
class Owner {
 public:
  Owner(const Options& options, SceneTicker& ticker)
      : fields_(options), ticker_(ticker), random_(options.seed ^ 0x9e3779b9U) {
    volume_ = fields_.base();
    offer(1);
  }

  /// One random action.
  void step(Servo& servo, Report& report) {
    const double what = random_.draw(0.0, 1.0);
    if (what < 0.35) {
      const int at = int(random_.draw(0.0, kFrames));
      if (auto map = fields_.find(at)) {
        volume_.motions.front().steps[size_t(at)] = std::move(map);
        ++report.fields;
        report.scenes += offer(volumes_);
      }
    } else if (what < 0.5) {
      // Sometimes there is nothing to feel; sometimes there is a second heart in the first.
      report.scenes += offer(random_.draw(0.0, 1.0) < 0.1 ? 0 : 1 + int(random_.draw(0.0, 2.0)));
    } else if (what < 0.55) {
      // From the start: no motion is known.
      volume_ = fields_.base();
      report.scenes += offer(volumes_);
    } else if (what < 0.8) {
      report.events += turn(servo);
    } else {
      for (int k = 0; k < 10; ++k) {
        Transform pose;
        pose.translation_m = random_.vector(0.004);
        servo.send(PoseUpdate{0, pose, Clock::now().time_since_epoch().count()});
        std::this_thread::sleep_for(std::chrono::milliseconds(int(random_.draw(5.0, 30.0))));
      }
    }
    ticker_.collect();
  }

 private:
  bool offer(int volumes) {
    volumes_ = volumes;
    SceneSpec spec = shell_scene();
    const VolumeSpec volume = spec.volumes.front();
    const ModeSpec mode = spec.modes.front();
    spec.volumes.clear();
    spec.modes.clear();
    std::vector<std::shared_ptr<const MovingVolume>> data;
    for (int v = 0; v < std::max(1, volumes); ++v) {
      spec.volumes.push_back(volume);
      spec.volumes.back().name = v ? "second" : "heart";
      spec.volumes.back().transform.translation_m = {0.005 * v, 0.0, 0.0};
      if (v == 0) spec.volumes.back().drive.kind = DriveSpec::Kind::kSecondHand;
      data.push_back(std::make_shared<const MovingVolume>(volume_));
      if (volumes == 0) continue;
      spec.modes.push_back(mode);
      spec.modes.back().name = v ? "second wall" : "wall";
      spec.modes.back().volume = spec.volumes.back().name;
    }
    auto scene = plan(spec, data);
    if (!scene) return false;
    return ticker_.offer(*scene);
  }

  bool turn(Servo& servo) {
    using Kind = ControlEvent::Kind;
    switch (int(random_.draw(0.0, 6.0))) {
      case 0:
        return servo.send({Kind::kRate, 0, random_.draw(-2.0, 3.0)});
      case 1:
        return servo.send({Kind::kScrub, 0, random_.draw(0.0, 1.0)});
      case 2:
        return servo.send({Kind::kModeOn, 0, double(random_.draw(0.0, 1.0) < 0.7)});
      case 3:
        return servo.send({Kind::kModeGain, 0, random_.draw(0.0, 2.0)});
      case 4:
        return servo.send({Kind::kStiffness, 0, random_.log_draw(100.0, 3000.0)});
      default:
        servo.send({Kind::kStop, 0, 0.0});
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        return servo.send({Kind::kRearm, 0, 0.0});
    }
  }

  Fields fields_;
  SceneTicker& ticker_;
  Random random_;
  MovingVolume volume_;
  int volumes_ = 1;
};

/// The heap in use, including large blocks, which are mapped one by one.
int64_t heap_bytes() {
  const auto info = mallinfo2();
  return int64_t(info.uordblks) + int64_t(info.hblkhd);
}

devices::SimulatedOptions hand_of(const Options& options) {
  devices::SimulatedOptions simulated;
  simulated.path = wandering(options.seconds, options.seed + 7);
  simulated.real_time = true;
  simulated.workspace_radius_m = 0.06;
  simulated.seed = options.seed;
  return simulated;
}

}  // namespace

uint64_t Report::all_misses() const {
  uint64_t all = 0;
  for (const uint64_t count : misses) all += count;
  return all;
}

bool Report::long_ticks_explained() const {
  return own.count == long_ticks.size() &&
         std::all_of(long_ticks.begin(), long_ticks.end(), [](const LongTick& tick) {
           return !tick.page_faults && tick.others >= 10 &&
                  tick.others_mean_ns < 0.1 * double(kPeriod_ns);
         });
}

Report run(const Options& options) {
  Report report;
  FailingDevice device(hand_of(options), options.seed);
  HapticsOptions haptics;
  haptics.safety.max_force_n = kMostForce_n;
  TimedTicker ticker(haptics, device.info());
  Watch watch;
  Owner owner(options, ticker.scene);
  ServoOptions servo_options;
  servo_options.listeners = {&watch};
  auto servo = Servo::start(device, ticker, servo_options);
  if (!servo) {
    report.broken.push_back(servo.error().message);
    return report;
  }
  const auto start = Clock::now();
  const auto gone = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  for (double s = gone(); s < options.seconds; s = gone()) {
    owner.step(**servo, report);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (options.progress) options.progress(s);
    const int64_t heap = heap_bytes();
    if (s < 0.25 * options.seconds)
      report.heap_early_bytes = std::max(report.heap_early_bytes, heap);
    else
      report.heap_most_bytes = std::max(report.heap_most_bytes, heap);
  }
  report.heap_end_bytes = heap_bytes();
  (*servo)->stop();
  for (size_t c = 0; c < report.misses.size(); ++c)
    report.misses[c] = (*servo)->statistics().misses[c].load();
  report.ticks = watch.ticks;
  report.touching = watch.touching;
  report.causes = watch.causes;
  report.injected = device.injected;
  report.own = ticker.own;
  report.yardstick = ticker.yardstick;
  report.long_ticks = ticker.long_ticks();
  report.broken = watch.broken();
  return report;
}

std::string text(const Report& report) {
  const Injected& i = report.injected;
  std::string text = fmt::format(
      "Ticks     {}, of which {} touching\n"
      "Injected  {} faults: {} unplugged, {} timeouts, {} garbage, {} jumps, {} not finite, {} "
      "stale, "
      "{} stalls, {} clocks set back\n"
      "Handed    {} scenes with {} new fields, {} events\n",
      report.ticks, report.touching, i.all(), i.unplugged, i.timeouts, i.garbage, i.jumps,
      i.not_numbers, i.stale, i.stalls, i.clock_back, report.scenes, report.fields, report.events);
  text += "Causes   ";
  for (size_t c = 0; c < report.causes.size(); ++c)
    if (report.causes[c]) text += fmt::format(" {} {},", word(Cause(c)), report.causes[c]);
  text.back() = '\n';
  text += fmt::format("Missed    {} periods:", report.all_misses());
  for (size_t c = 0; c < report.misses.size(); ++c)
    text += fmt::format(" {} {},", word(MissCause(c)), report.misses[c]);
  text.back() = '\n';
  text += fmt::format(
      "Own time  {} ticks used more than a period of processor time; the longest {:.0f} us, all "
      "{:.1f} s\n"
      "Yardstick fixed arithmetic after each tick did so {} times; the longest {:.0f} us, all "
      "{:.1f} "
      "s\n"
      "Heap      {:.1f} MB early, {:.1f} MB at most after that, {:.1f} MB at the end\n",
      report.own.count, 1e-3 * double(report.own.longest_ns), 1e-9 * double(report.own.all_ns),
      report.yardstick.count, 1e-3 * double(report.yardstick.longest_ns),
      1e-9 * double(report.yardstick.all_ns), 1e-6 * double(report.heap_early_bytes),
      1e-6 * double(report.heap_most_bytes), 1e-6 * double(report.heap_end_bytes));
  for (const LongTick& tick : report.long_ticks)
    text += fmt::format(
        "Long tick {:.0f} us{} for {} pieces of path, {} primitives and {} steps of back-tracking; "
        "{} "
        "others with as much to do took {:.1f} us in the mean\n",
        1e-3 * double(tick.took_ns), tick.page_faults ? " with a page fault" : "", tick.substeps,
        tick.primitives, tick.newton_steps, tick.others, 1e-3 * tick.others_mean_ns);
  for (const std::string& what : report.broken) text += "BROKEN    " + what + "\n";
  return text;
}

}  // namespace palpate::soak
