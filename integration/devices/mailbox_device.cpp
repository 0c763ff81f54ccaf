#include "integration/devices/mailbox_device.h"

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>

#include "integration/devices/answer_judge.h"
#include "integration/devices/wake.h"
#include "module/haptics/force_vector.h"
#include "module/haptics/servo/mailbox.h"
#include "module/haptics/servo/monotonic.h"
#include "module/haptics/servo/real_time.h"

namespace palpate::devices {
namespace {

constexpr int kRetryMs = 500;
// After a loss its fault is reported until the servo thread has called so often (it may call twice
// in a period, and may ignore the second answer), or for so many ms.
constexpr uint32_t kHeard = 3;
constexpr int kHeardMs = 2000;
constexpr std::chrono::seconds kCloses{2};

}  // namespace

/// What both threads share, and the half of the one that speaks with the device.
class MailboxDevice::Worker {
 public:
  /// What the servo thread wants.
  struct ForceRequest {
    glm::dvec3 force_n{0.0}, torque_n_m{0.0};
    bool trusts = false;  ///< it has been told that the device works
  };

  Worker(std::unique_ptr<DeviceLink> link, const MailboxOptions& options)
      : options_(options), link_(std::move(link)), info_(link_->info()) {
    alive_ns_ = monotonic_ns();
  }

  void run() {
    if (options_.priority > 0) {
      ServoReport report;
      prepare_thread({.priority = options_.priority, .lock_memory = false, .cores_awake = false},
                     report);
    }
    while (!stop_) {
      if (is_open_)
        serve_command();
      else
        search();
    }
    close();
    ended_.set_value();
  }

  DeviceInfo info() const {
    const std::lock_guard lock(info_mutex_);
    return info_;
  }

  MailboxCounts counts() const noexcept { return {served_, exchanges_, missed_, opened_, cuts_}; }

  void stop() noexcept {
    stop_ = true;
    command_wake_.wake();
    stop_wake_.wake();
  }
  std::future<void> ended() { return ended_.get_future(); }

  // For the servo thread.
  Newest<ForceRequest> commands;
  Newest<DeviceReading> readings;
  std::atomic<uint32_t> asked = 0;  ///< exchanges of the servo thread
  void wake() noexcept { command_wake_.wake(); }
  bool is_silent() const noexcept {
    return monotonic_ns() - alive_ns_.load(std::memory_order_acquire) > options_.silence_ns;
  }

 private:
  /// While there is no device: one look for it.
  void search() {
    const DeviceFault fault = link_->open();
    alive_ns_.store(monotonic_ns(), std::memory_order_release);
    if (fault == DeviceFault::kNone) {
      begin();
      return;
    }
    searched_ = true;
    learn();  // it may know by now what it is, though not whether it works
    const bool was_there = opened_ > 0 && fault == DeviceFault::kNotOpened;
    publish(judge_.frozen(was_there ? DeviceFault::kUnplugged : fault));
    if (!stop_) stop_wake_.sleep(kRetryMs);
  }

  void learn() {
    DeviceInfo info = link_->info();
    const std::lock_guard lock(info_mutex_);
    info_ = std::move(info);
  }

  void begin() {
    is_open_ = true;
    learn();
    if (opened_ == 0) judge_ = AnswerJudge(info_.workspace_centre_m, info_.workspace_radius_m);
    // It is opened again at once: the earlier fault remains the better explanation.
    const DeviceFault fault = searched_ ? DeviceFault::kStarting : judge_.fault();
    searched_ = false;
    judge_.restart();
    if (fault != DeviceFault::kStarting) judge_.fail(fault);
    publish(judge_.frozen(fault));
    sent_n_ = sent_n_m_ = glm::dvec3(0.0);
    last_command_ns_ = monotonic_ns();
    opened_.fetch_add(1, std::memory_order_relaxed);
  }

  /// One command of the servo thread, or none for away_ns.
  void serve_command() {
    const int64_t left_ns = last_command_ns_ + options_.away_ns - monotonic_ns();
    command_wake_.sleep(int(std::max<int64_t>(0, left_ns / 1'000'000 + 1)));
    if (stop_) return;
    ForceRequest command;
    const bool came = commands.get(command);
    // A wake-up may be left of a command that has been dealt with.
    if (!came && monotonic_ns() - last_command_ns_ < options_.away_ns) return;
    last_command_ns_ = monotonic_ns();
    if (!came && is_pushing()) {
      judge_.fail(DeviceFault::kTimeout);
      cuts_.fetch_add(1, std::memory_order_release);
    }
    const bool allowed = came && command.trusts && judge_.fault() == DeviceFault::kNone;
    const LinkAnswer answer = send(allowed ? command : ForceRequest());
    const DeviceReading reading = came ? judged(answer) : unasked(answer);
    // Force zero is sent to a device that is not trusted before its fault is reported.
    if (reading.fault != DeviceFault::kNone && is_pushing() && !answer.lost) send(ForceRequest());
    const bool was_open = is_open_;
    if (answer.lost || judge_.hopeless()) close();
    alive_ns_.store(monotonic_ns(), std::memory_order_release);
    publish(reading);
    if (came) served_.fetch_add(1, std::memory_order_release);
    // The servo thread must see why the device was lost before another search reports something
    // else.
    const uint32_t from = asked;
    for (int n = 0; was_open && !is_open_ && asked - from < kHeard && !stop_ && n < kHeardMs; ++n)
      stop_wake_.sleep(1);
  }

  bool is_pushing() const noexcept {
    return sent_n_ != glm::dvec3(0.0) || sent_n_m_ != glm::dvec3(0.0);
  }

  LinkAnswer send(const ForceRequest& request) {
    const auto within = [](glm::dvec3 v, double most) {
      return is_finite(v) ? shortened(v, most) : glm::dvec3(0.0);
    };
    sent_n_ = within(request.force_n, info_.max_force_n);
    sent_n_m_ = within(request.torque_n_m, info_.max_torque_n_m);
    link_->set_torque(sent_n_m_);
    const int64_t start_ns = monotonic_ns();
    const LinkAnswer answer = link_->exchange(sent_n_);
    exchanges_.fetch_add(1, std::memory_order_relaxed);
    if (!answer.answered) missed_.fetch_add(1, std::memory_order_relaxed);
    // The call took so long that the servo thread was given a fault.
    if (monotonic_ns() - start_ns > options_.silence_ns) judge_.fail(DeviceFault::kTimeout);
    return answer;
  }

  DeviceReading judged(const LinkAnswer& answer) noexcept {
    AnswerJudge::Exchange seen;
    seen.answered = answer.answered;
    seen.garbage = answer.garbage;
    seen.said = answer.said;
    seen.position_m = answer.position_m;
    seen.buttons = answer.buttons;
    seen.grip = answer.grip;
    seen.moved = answer.position_m != place_m_;
    seen.time_ns = monotonic_ns();
    seen.force_n = sent_n_;
    if (answer.answered) place_m_ = answer.position_m;
    const DeviceReading reading = judge_.judge(seen);
    // A fault without an answer is a fault of the link.
    return answer.answered && !answer.lost ? reading : unasked(answer);
  }

  /// A reading for when the servo thread did not call: only its fault counts. A fault must not end
  /// unnoticed meanwhile, and the hand may have moved far.
  DeviceReading unasked(const LinkAnswer& answer) noexcept {
    const bool lost = answer.lost && answer.said == DeviceFault::kNone;
    if (lost || answer.said != DeviceFault::kNone)
      judge_.fail(lost ? DeviceFault::kUnplugged : answer.said);
    return judge_.frozen(judge_.fault());
  }

  void close() noexcept {
    if (is_open_) link_->close();
    is_open_ = false;
    sent_n_ = sent_n_m_ = glm::dvec3(0.0);
  }

  void publish(const DeviceReading& reading) noexcept { readings.put(reading); }

  const MailboxOptions options_;
  std::unique_ptr<DeviceLink> link_;
  bool is_open_ = false;
  bool searched_ = false;  ///< in vain, since it was open
  int64_t last_command_ns_ = 0;
  AnswerJudge judge_{glm::dvec3(0.0), 0.0};
  glm::dvec3 sent_n_{0.0}, sent_n_m_{0.0};  ///< that the device was told last
  glm::dvec3 place_m_{0.0};                 ///< of the last answer

  mutable std::mutex info_mutex_;  ///< never taken by the servo thread; written by the other only
  DeviceInfo info_;

  std::atomic<int64_t> alive_ns_ = 0;
  std::atomic<uint64_t> served_ = 0, exchanges_ = 0, missed_ = 0, opened_ = 0, cuts_ = 0;
  std::atomic<bool> stop_ = false;
  Wake command_wake_, stop_wake_;
  std::promise<void> ended_;
};

MailboxDevice::MailboxDevice(std::unique_ptr<DeviceLink> link, const MailboxOptions& options)
    : worker_(std::make_shared<Worker>(std::move(link), options)) {
  last_.position_m = worker_->info().workspace_centre_m;
  last_.fault = DeviceFault::kNotOpened;
  thread_ = std::thread([worker = worker_] { worker->run(); });
}

MailboxDevice::~MailboxDevice() {
  const std::future<void> ended = worker_->ended();
  worker_->stop();
  if (ended.wait_for(kCloses) == std::future_status::ready)
    thread_.join();
  else
    thread_.detach();
}

DeviceInfo MailboxDevice::info() const {
  return worker_->info();
}

DeviceReading MailboxDevice::exchange(const DeviceCommand& command) noexcept {
  worker_->commands.put({command.force_n, command.torque_n_m, last_.fault == DeviceFault::kNone});
  worker_->wake();
  if (!worker_->readings.get(last_)) last_.fresh = false;
  worker_->asked.fetch_add(1, std::memory_order_release);
  if (last_.fault == DeviceFault::kNone && worker_->is_silent()) {
    last_.fault = DeviceFault::kTimeout;
    last_.fresh = false;
  }
  return last_;
}

MailboxCounts MailboxDevice::counts() const noexcept {
  return worker_->counts();
}

}  // namespace palpate::devices
