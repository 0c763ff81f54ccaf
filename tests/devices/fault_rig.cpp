#include "tests/devices/fault_rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/haptics/shell_scene.h"

namespace palpate::devices::test {
namespace {

constexpr int kFrames = 4;
constexpr double kFramesPerSecond = 4.0;
// Of the motion; a finer one takes most of a second to make.
constexpr double kSpacing_mm = 4.0;
// The shell's radius goes from 25 to 34.8 mm and back: the hand is always inside, at a depth of at
// least 0.5 N, and the spring never exceeds the strength of the surface.
constexpr double kStiffness = 200.0, kStrength = 3.0;
constexpr double kFree_m = 0.038, kDeep_m = 0.0225;  // of the hand, from the shell's centre
constexpr double kStep_m = 0.2e-3;                   // of the hand, per ms
constexpr double kFelt_n = 0.4;

/// A frame whose values can become NaN.
class FaultyFrame final : public FrameData {
 public:
  FaultyFrame(std::shared_ptr<const FrameData> frame, std::shared_ptr<const DataFaults> faults)
      : frame_(std::move(frame)), faults_(std::move(faults)) {}
  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x) const noexcept override { return wrong() ? kNan : frame_->scalar(x); }
  glm::dvec3 scalar_gradient(glm::dvec3 x) const noexcept override {
    return wrong() ? glm::dvec3(kNan) : frame_->scalar_gradient(x);
  }
  glm::dvec3 vector(glm::dvec3 x) const noexcept override { return scalar_gradient(x); }
  glm::dmat3 vector_jacobian(glm::dvec3 x) const noexcept override {
    return frame_->vector_jacobian(x);
  }
  double detail_m() const noexcept override { return frame_->detail_m(); }
  glm::dvec3 low_m() const noexcept override { return frame_->low_m(); }
  glm::dvec3 high_m() const noexcept override { return frame_->high_m(); }

 private:
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  bool wrong() const noexcept { return faults_->not_a_number; }
  std::shared_ptr<const FrameData> frame_;
  std::shared_ptr<const DataFaults> faults_;
};

/// A beating shell with its centre in the middle of the device's reach; 0 shells: a scene without
/// modes.
std::shared_ptr<const Scene> scene(int shells, glm::dvec3 centre_m,
                                   const std::shared_ptr<DataFaults>& faults) {
  SceneSpec spec = palpate::test::shell_spec(kStrength, 0.1, kStiffness);
  spec.world_from_device.translation_m = -centre_m;
  const auto made =
      palpate::test::shell(kFrames, kFramesPerSecond, palpate::test::Made::kAnalytic, kSpacing_mm);
  auto data = std::make_shared<MovingVolume>(*made);
  for (auto& frame : data->frames) frame = std::make_shared<FaultyFrame>(frame, faults);
  if (shells == 0) spec.modes.clear();
  auto assembled = plan(spec, {data});
  if (!assembled) throw std::runtime_error(assembled.error().message);
  return *assembled;
}

HapticsOptions quick_start() {
  HapticsOptions options;
  // The usual 2 s would be most of the tests' time.
  options.safety.start_ramp_s = 0.02;
  return options;
}

}  // namespace

DeviceReading WatchedDevice::exchange(const DeviceCommand& command) noexcept {
  if (during) {
    during();
    during = nullptr;
  }
  const bool trusted = last_ == DeviceFault::kNone;
  const DeviceReading reading = device_.exchange(command);
  last_ = reading.fault;
  if (settle) settle(reading);
  if (reachable_) {
    // Earlier commands may still be on their way to the device, but no force is commanded any more.
    const auto at_zero = [&] { return hand_->received_count() <= from_ || !hand_->pushes(); };
    if (last_ != DeviceFault::kNone && !at_zero() && !(settle && wait_for(at_zero)))
      blame(std::string("a force is left in the device that said: ") + sentence(last_));
    const size_t received = hand_->received_count();
    for (size_t n = seen_; n < received && !trusted; ++n)
      if (hand_->pushed(n)) blame("a force before the device was said to work");
  }
  seen_ = hand_->received_count();
  return reading;
}

void WatchedDevice::find(EmulatedHand& hand) {
  hand_ = &hand;
  seen_ = from_ = hand.received_count();
  reachable_ = true;
}

void WatchedDevice::blame(const std::string& what) {
  if (std::find(wrong.begin(), wrong.end(), what) == wrong.end()) wrong.push_back(what);
}

DeviceRig::DeviceRig() : hand_(0.0, 0.0, kFree_m), goal_(hand_) {}

void DeviceRig::hold(EmulatedHand& hand, glm::dvec3 centre_m) {
  used_ = &hand;
  centre_m_ = centre_m;
  move_hand();
}

void DeviceRig::start(ForceDevice& device) {
  watched = std::make_unique<WatchedDevice>(device, *used_);
  haptics = std::make_unique<Haptics>(quick_start(), device.info());
  adopt(1);
  loop = std::make_unique<ServoLoop>(*watched, *haptics, time, ports, LoopOptions(),
                                     TickListeners{this});
}

void DeviceRig::hand_is_at(glm::dvec3 grip_m) {
  hand_ = goal_ = grip_m - centre_m_;
}

void DeviceRig::adopt(int shells) {
  haptics->adopt(Haptics::prepare(scene(shells, centre_m_, data)));
}

void DeviceRig::hear(const TickInput& input, const TickOutput& output) noexcept {
  inputs.push_back(input);
  outputs.push_back(output);
}

void DeviceRig::find(EmulatedHand& again) {
  used_ = &again;
  watched->find(again);
}

/// A hand is never still: without a tremor an encoder that does not change would be no fault.
void DeviceRig::move_hand() {
  const glm::dvec3 way = goal_ - hand_;
  const double length = glm::length(way);
  hand_ = length > kStep_m ? hand_ + way * (kStep_m / length) : goal_;
  if (!holds_grip) return;
  const double t = 2.0 * std::numbers::pi * 1e-3 * double(turn_);
  const glm::dvec3 tremor =
      0.3e-3 * glm::dvec3(std::sin(7.0 * t), std::sin(9.0 * t + 1.0), std::sin(8.0 * t + 2.0));
  place(centre_m_ + hand_ + tremor);
}

void DeviceRig::run_period() {
  ++turn_;
  move_hand();
  loop->run_period();
}

void DeviceRig::run_periods(int count) {
  for (int n = 0; n < count; ++n) run_period();
}

bool DeviceRig::turn_until(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    run_period();
    // Without a device to wait for, the loop would use the processor time that the worker needs.
    if (!inputs.back().reading.fresh) std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  return true;
}

bool DeviceRig::come_free() {
  goal_ = glm::dvec3(0.0, 0.0, kFree_m);
  run_period();
  return turn_until([&] {
    return hand_ == goal_ && inputs.back().reading.fault == DeviceFault::kNone &&
           outputs.back().cause == Cause::kNone;
  });
}

bool DeviceRig::touch() {
  if (!come_free()) return false;
  run_periods(30);  // the start ramp
  goal_ = glm::dvec3(0.0, 0.0, kDeep_m);
  return turn_until([&] {
    return hand_ == goal_ && outputs.back().cause == Cause::kNone &&
           force_n(outputs.size() - 1) > kFelt_n && pushes();
  });
}

void DeviceRig::stall_host(int milliseconds, const std::function<bool()>& also) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
  if (also && !wait_for(also))
    watched->wrong.emplace_back("waited in vain while the host was away");
  time.oversleep_ns = int64_t(milliseconds) * 1'000'000;
}

}  // namespace palpate::devices::test
