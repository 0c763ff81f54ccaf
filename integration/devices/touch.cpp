#include "integration/devices/touch.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>

#include "integration/devices/touch_library.h"
#include "integration/devices/wake.h"
#include "module/haptics/servo/mailbox.h"
#include "module/haptics/servo/monotonic.h"

namespace palpate::devices {
namespace {

constexpr uint64_t kFramesOfALook = 100;
// Of the warmest motor, which the library predicts. It ends the force with a step at a temperature
// that it does not state, at most 1: so the force is brought down a little before.
constexpr double kHotFrom = 0.95, kCoolBelow = 0.85;

/// What the device says about itself, once. Not finite, or 0: it does not say.
struct TouchFacts {
  double max_force_n = 0.0, continuous_force_n = 0.0, stiffness_n_per_mm = 0.0;
  std::array<double, 6> workspace_mm{};  ///< the least x, y, z, then the most
  int input_dof = 0, output_dof = 0, styles = 0, update_rate_hz = 0;
  bool has_temperatures = false, has_rotation = false;
  std::array<char, 64> vendor{}, model{};
};

/// What the scheduler's thread is to do from now on.
struct TouchOrder {
  uint64_t number = 0;
  int64_t time_ns = 0;
  glm::dvec3 force_n{0.0};
  bool ends = false;  ///< the motors go to zero and the frames end
};

/// What one frame brought.
struct TouchFrame {
  uint64_t order = 0;  ///< that it carried out
  bool ended = false;  ///< it was the last
  LinkAnswer answer;
};

/// The frames of one device, which the library's scheduler has run, 1,000 a second.
///
/// Why a callback, and frames of a thread of our own are none: the documents allow those only to
/// who replaces the scheduler, and do not say what the motors do then. Why it is asynchronous: a
/// synchronous one waits for ever if the scheduler stands; here its missing frame is noticed after
/// a few milliseconds, as with any device that does not answer. A force lasts until the next order,
/// but not longer than order_ns: the frames go on although all other threads may be stopped.
class TouchFrames {
 public:
  TouchFrames(const hd::HdLibrary& library, hd::HdHandle device, int64_t order_ns)
      : library_(library), device_(device), order_ns_(order_ns) {}

  // One thread, which is not the scheduler's.
  void put(const TouchOrder& order) noexcept { orders_.put(order); }
  /// The frame that carried out that order, waiting for it. False: none came.
  bool await(uint64_t order, int wait_ms, TouchFrame& frame) {
    const int64_t end_ns = monotonic_ns() + int64_t(wait_ms) * 1'000'000;
    while (true) {
      frames_.get(frame);
      if (frame.order >= order) return true;
      const int64_t left_ns = end_ns - monotonic_ns();
      if (left_ns <= 0) return false;
      wake_.sleep(int(left_ns / 1'000'000 + 1));
    }
  }
  /// After the first frame.
  const TouchFacts& facts() const noexcept { return facts_; }

  /// For the scheduler. No lock and no allocation of ours.
  static unsigned callback(void* frames) noexcept {
    return static_cast<TouchFrames*>(frames)->run();
  }

 private:
  unsigned run() noexcept {
    orders_.get(order_);
    TouchFrame frame;
    frame.order = order_.number;
    library_.begin_frame(device_);
    const hd::HdVerdict at_begin = library_.take_errors();
    if (count_ == 0) learn();
    if (count_++ % kFramesOfALook == 0) look();
    read(frame.answer);
    const glm::dvec3 force_n = force_to_send();
    library_.set_doubles(hd::kForce, &force_n.x);
    library_.end_frame(device_);
    judge(worse(at_begin, library_.take_errors()), frame.answer);
    if (order_.ends) {
      library_.disable(hd::kForceOutput);
      library_.take_errors();
      frame.ended = true;
    }
    frames_.put(frame);
    wake_.wake();
    return frame.ended ? hd::kCallbackDone : hd::kCallbackContinue;
  }

  /// What does not change. An error means that this library or device does not know it.
  void learn() noexcept {
    const auto ask = [&](hd::HdQuery query, double* values) {
      library_.get_doubles(query, values);
      return library_.take_errors().fault == DeviceFault::kNone;
    };
    const auto ask_number = [&](hd::HdQuery query, int& value) {
      library_.get_integers(query, &value);
      if (library_.take_errors().fault != DeviceFault::kNone) value = 0;
    };
    const auto ask_text = [&](hd::HdQuery query, auto& text) {
      const char* given = library_.get_string(query);
      if (library_.take_errors().fault == DeviceFault::kNone && given)
        std::strncpy(text.data(), given, text.size() - 1);
    };
    if (!ask(hd::kMaxForce, &facts_.max_force_n)) facts_.max_force_n = 0.0;
    if (!ask(hd::kMaxContinuousForce, &facts_.continuous_force_n)) facts_.continuous_force_n = 0.0;
    if (!ask(hd::kMaxStiffness, &facts_.stiffness_n_per_mm)) facts_.stiffness_n_per_mm = 0.0;
    if (!ask(hd::kWorkspace, facts_.workspace_mm.data())) facts_.workspace_mm = {};
    facts_.has_temperatures = ask(hd::kMotorTemperatures, temperatures_.data());
    std::array<double, 16> unused{};
    facts_.has_rotation =
        ask(hd::kTransform, unused.data()) && ask(hd::kAngularVelocity, unused.data());
    ask_number(hd::kInputDof, facts_.input_dof);
    ask_number(hd::kOutputDof, facts_.output_dof);
    ask_number(hd::kCalibrationStyles, facts_.styles);
    ask_number(hd::kUpdateRate, facts_.update_rate_hz);
    ask_text(hd::kVendor, facts_.vendor);
    ask_text(hd::kModel, facts_.model);
    library_.enable(hd::kForceClamping);
    library_.take_errors();
    for (size_t k = 0; k < switches_.size(); ++k) {
      unsigned char is_on[8] = {};
      library_.get_booleans(switches_[k].query, is_on);
      switches_[k].is_there = library_.take_errors().fault == DeviceFault::kNone;
    }
  }

  /// What changes slowly.
  void look() noexcept {
    if (facts_.has_temperatures) {
      library_.get_doubles(hd::kMotorTemperatures, temperatures_.data());
      const double warmest = *std::max_element(temperatures_.begin(), temperatures_.end());
      is_hot_ = warmest >= (is_hot_ ? kCoolBelow : kHotFrom);
    }
    switch (library_.check_calibration()) {
      case hd::kCalibrated:
        is_calibrated_ = true;
        break;
      case hd::kNeedsUpdate:
        update_calibration();
        break;
      default:
        is_calibrated_ = false;
    }
  }

  /// With a reset of encoders the arm has to be in a certain pose, which only its user can know.
  /// The others know by themselves that they are ready. The position may change by it: not in
  /// contact.
  void update_calibration() noexcept {
    const unsigned style = facts_.styles & hd::kAutomatic ? hd::kAutomatic : hd::kInkwell;
    if (!(facts_.styles & (hd::kAutomatic | hd::kInkwell))) {
      is_calibrated_ = false;
    } else if (sent_n_ == glm::dvec3(0.0)) {
      library_.update_calibration(style);
      is_calibrated_ = library_.check_calibration() != hd::kNeedsManualInput;
    }
  }

  /// Where the pen is, how it is held, and what is pressed.
  void read(LinkAnswer& answer) noexcept {
    glm::dvec3 position_mm(std::nan(""));
    library_.get_doubles(hd::kPosition, &position_mm.x);
    // Its axes are palpate's: x right, y up, z towards the user.
    answer.position_m = 1e-3 * position_mm;
    if (facts_.has_rotation) {
      glm::dmat4 device_from_pen(1.0);
      library_.get_doubles(hd::kTransform, &device_from_pen[0].x);
      // The pen's own z goes from its tip along its shaft.
      answer.grip.device_from_grip = glm::quat_cast(glm::dmat3(device_from_pen));
      library_.get_doubles(hd::kAngularVelocity, &answer.grip.angular_velocity_rad_per_s.x);
      answer.grip.turns = true;
    }
    int buttons = 0;
    library_.get_integers(hd::kButtons, &buttons);
    answer.buttons = uint32_t(buttons);
    is_held_ = true;
    for (TouchSwitch& one : switches_) {
      if (!one.is_there) continue;
      unsigned char is_on[8] = {};
      library_.get_booleans(one.query, is_on);
      one.was_on |= is_on[0] != 0;
      // A device may have no such switch, and the documents do not say what it tells then.
      if (one.was_on && !is_on[0]) is_held_ = false;
    }
  }

  glm::dvec3 force_to_send() noexcept {
    const bool wants_force = order_.force_n != glm::dvec3(0.0);
    const bool is_old = order_.number > 0 && monotonic_ns() - order_.time_ns > order_ns_;
    is_cut_ = is_cut_ ? wants_force : wants_force && is_old;
    const bool is_off = is_cut_ || order_.ends || !is_calibrated_;
    sent_n_ = is_off ? glm::dvec3(0.0) : order_.force_n;
    // It is off at first, and may be after an error; it comes back from zero only.
    is_output_on_ = library_.is_enabled(hd::kForceOutput) != 0;
    if (!is_output_on_ && is_calibrated_ && !wants_force && !order_.ends)
      library_.enable(hd::kForceOutput);
    return sent_n_;
  }

  void judge(const hd::HdVerdict& verdict, LinkAnswer& answer) noexcept {
    // The motors that it names are warm in the next frame, too, whether it names them again or not.
    if (verdict.fault == DeviceFault::kHot && facts_.has_temperatures) is_hot_ = true;
    answer.answered = verdict.positions;
    answer.lost = verdict.lost;
    answer.said = verdict.fault;
    if (answer.said != DeviceFault::kNone) return;
    if (!is_calibrated_)
      answer.said = DeviceFault::kNotHomed;
    else if (is_cut_)
      answer.said = DeviceFault::kTimeout;
    else if (is_hot_)
      answer.said = DeviceFault::kHot;
    else if (!is_held_)
      answer.said = DeviceFault::kNoHand;
    else if (!is_output_on_)
      answer.said = DeviceFault::kForceOff;
  }

  /// On while a hand has the pen: the safety switch is on while its grip is held, and the inkwell's
  /// while the pen is out of it.
  struct TouchSwitch {
    hd::HdQuery query;
    bool is_there = false;
    bool was_on = false;
  };

  const hd::HdLibrary& library_;
  const hd::HdHandle device_;
  const int64_t order_ns_;
  Newest<TouchOrder> orders_;
  Newest<TouchFrame> frames_;
  Wake wake_;

  // The scheduler's thread alone, but for facts_.
  TouchFacts facts_;
  TouchOrder order_;
  uint64_t count_ = 0;
  std::array<double, 8> temperatures_{};  ///< 3 or 6 are used
  std::array<TouchSwitch, 2> switches_{TouchSwitch{hd::kSafetySwitch},
                                       TouchSwitch{hd::kInkwellSwitch}};
  glm::dvec3 sent_n_{0.0};
  bool is_calibrated_ = false, is_held_ = true, is_hot_ = false, is_cut_ = false,
       is_output_on_ = false;
};

class TouchLink final : public DeviceLink {
 public:
  explicit TouchLink(const TouchOptions& options) : options_(options) {
    info_.kind = "touch";
    info_.name = "3D Systems Touch";
    info_.address = options_.configuration;
    // Of the smallest, a Touch, until the device tells its own.
    info_.max_force_n = 3.3;
    info_.continuous_force_n = 0.88;
    info_.max_stiffness_n_per_m = 500.0;
    info_.workspace_radius_m = 0.035;
    // A position is used in the next period of the servo loop, and its force in the next frame.
    info_.delay_s = 2e-3;
    info_.buttons = 2;
  }

  DeviceFault open() override {
    loaded_ = hd::loaded_hd(options_.library);
    if (!loaded_) return DeviceFault::kNoLibrary;
    const hd::HdLibrary& library = loaded_->functions;
    library.take_errors();
    const std::string& name = options_.configuration;
    device_ = library.init_device(name.empty() ? nullptr : name.c_str());
    const hd::HdVerdict verdict = library.take_errors();
    if (device_ == hd::kNoDevice) return reason_of(verdict.fault);
    if (!verdict.positions) {
      library.disable_device(device_);
      return reason_of(verdict.fault);
    }
    frames_ = std::make_shared<TouchFrames>(library, device_, options_.order_ns);
    const DeviceFault fault =
        loaded_->scheduler.add(TouchFrames::callback, frames_.get(), operation_);
    if (fault != DeviceFault::kNone) {
      frames_.reset();
      library.disable_device(device_);
      return fault;
    }
    TouchFrame frame;
    const bool runs = give({}, options_.opening_wait_ms, frame);
    if (!runs || frame.answer.lost) {
      close();
      return runs ? frame.answer.said : DeviceFault::kTimeout;
    }
    tell(frames_->facts());
    return DeviceFault::kNone;
  }

  DeviceInfo info() const override { return info_; }

  LinkAnswer exchange(glm::dvec3 force_n) override {
    TouchFrame frame;
    return give({.force_n = force_n}, options_.answer_wait_ms, frame) ? frame.answer : LinkAnswer();
  }

  void close() noexcept override {
    TouchFrame frame;
    const bool has_ended = give({.ends = true}, options_.answer_wait_ms, frame);
    loaded_->scheduler.remove(operation_, has_ended, std::move(frames_));
    loaded_->functions.disable_device(device_);
    loaded_->functions.take_errors();
  }

 private:
  bool give(TouchOrder order, int wait_ms, TouchFrame& frame) {
    order.number = ++number_;
    order.time_ns = monotonic_ns();
    frames_->put(order);
    return frames_->await(order.number, wait_ms, frame);
  }

  /// Why there is no device: what else the library reports then is that none was found.
  static DeviceFault reason_of(DeviceFault fault) {
    const bool says_more = fault == DeviceFault::kBusy || fault == DeviceFault::kNoPermission ||
                           fault == DeviceFault::kTimeout;
    return says_more ? fault : DeviceFault::kNotOpened;
  }

  void tell(const TouchFacts& facts) {
    const auto take = [](double value, double& known, double scale = 1.0) {
      if (std::isfinite(value) && value > 0.0) known = scale * value;
    };
    take(facts.max_force_n, info_.max_force_n);
    take(facts.continuous_force_n, info_.continuous_force_n);
    info_.continuous_force_n = std::min(info_.continuous_force_n, info_.max_force_n);
    take(facts.stiffness_n_per_mm, info_.max_stiffness_n_per_m, 1e3);
    const std::array<double, 6>& box = facts.workspace_mm;
    const glm::dvec3 least(box[0], box[1], box[2]), most(box[3], box[4], box[5]);
    const glm::dvec3 half_m = 0.5e-3 * (most - least);
    const double radius_m = std::min({half_m.x, half_m.y, half_m.z});
    if (std::isfinite(half_m.x + half_m.y + half_m.z) && radius_m > 0.0) {
      info_.workspace_radius_m = radius_m;
      info_.workspace_centre_m = 0.5e-3 * (least + most);
    }
    if (facts.input_dof > 0) info_.sensed_dof = facts.input_dof;
    if (facts.output_dof > 0) info_.actuated_dof = facts.output_dof;
    if (facts.update_rate_hz > 0) info_.delay_s = 1e-3 + 1.0 / facts.update_rate_hz;
    const std::string vendor = facts.vendor.data(), model = facts.model.data();
    if (!model.empty()) info_.name = vendor.empty() ? model : vendor + " " + model;
  }

  const TouchOptions options_;
  hd::LoadedHd* loaded_ = nullptr;
  DeviceInfo info_;
  hd::HdHandle device_ = hd::kNoDevice;
  unsigned long operation_ = 0;
  std::shared_ptr<TouchFrames> frames_;
  uint64_t number_ = 0;
};

}  // namespace

std::unique_ptr<DeviceLink> make_touch_link(const TouchOptions& options) {
  return std::make_unique<TouchLink>(options);
}

bool touch_library_is_there(const TouchOptions& options) {
  return hd::loaded_hd(options.library) != nullptr;
}

}  // namespace palpate::devices
