// A child process feels a force of 2 N when something goes wrong in it. Its device writes the
// forces that it gets into memory shared with the parent. After the child's death the parent checks
// that the last force is zero and that the force fell along the ramp.
#include "module/haptics/servo/emergency.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <new>
#include <stdexcept>

#include "module/haptics/servo/servo.h"

namespace palpate {
namespace {

/// Steps of the tick's ramp; the loop's own ramp, which it uses if the tick does not stop, has as
/// many.
constexpr int kSteps = 20;

struct Seen {
  std::atomic<int> count{0};
  std::atomic<bool> tick_crashes{false}, device_crashes{false};
  std::array<double, 200'000> forces_n;
};

class SharedDevice : public ForceDevice {
 public:
  explicit SharedDevice(Seen& seen) : seen_(seen) {}
  DeviceInfo info() const override { return {}; }
  DeviceReading exchange(const DeviceCommand& command) noexcept override {
    const int n = seen_.count.load();
    if (n < int(seen_.forces_n.size())) {
      seen_.forces_n[size_t(n)] = command.force_n.y;
      seen_.count.store(n + 1);
    }
    if (seen_.device_crashes) raise(SIGSEGV);
    DeviceReading reading;
    reading.fresh = true;
    return reading;
  }

 private:
  Seen& seen_;
};

class SharedTicker : public Ticker {
 public:
  SharedTicker(Seen& seen, bool obeys) : seen_(seen), obeys_(obeys) {}
  TickOutput tick(const TickInput& input) noexcept override {
    if (seen_.tick_crashes) raise(SIGSEGV);
    if (input.stop && obeys_ && left_ > 0) --left_;
    TickOutput output;
    output.command.force_n.y = 2.0 * left_ / kSteps;
    return output;
  }

 private:
  Seen& seen_;
  bool obeys_;
  int left_ = kSteps;
};

class Emergency : public testing::Test {
 protected:
  void SetUp() override {
    void* memory =
        mmap(nullptr, sizeof(Seen), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    seen_ = new (memory) Seen;
  }
  void TearDown() override { munmap(seen_, sizeof(Seen)); }

  /// Runs a servo loop in a child until it feels the force, then calls `harm` there. Returns the
  /// status from waitpid().
  int child(const std::function<void(Servo&)>& harm, bool obeys = true) {
    const pid_t pid = fork();
    if (pid == 0) live(harm, obeys);
    int status = 0;
    EXPECT_EQ(waitpid(pid, &status, 0), pid);
    return status;
  }

  /// The last force is zero, the full force was reached, and no step down was larger than a 20th of
  /// it.
  void expect_ramp_to_zero(double largest_step_n = 2.0 / kSteps) {
    const int count = seen_->count;
    ASSERT_GT(count, kSteps);
    EXPECT_EQ(seen_->forces_n[size_t(count - 1)], 0.0);
    double most = 0.0;
    for (int k = 1; k < count; ++k) {
      const double before = seen_->forces_n[size_t(k - 1)], now = seen_->forces_n[size_t(k)];
      most = std::max(most, now);
      ASSERT_LE(before - now, largest_step_n + 1e-12) << "exchange " << k << " of " << count;
    }
    EXPECT_EQ(most, 2.0);
  }

  Seen* seen_ = nullptr;

 private:
  [[noreturn]] void live(const std::function<void(Servo&)>& harm, bool obeys) {
    // Ends a child that hangs, so that the test does not hang.
    alarm(60);
    // A shell starts background programs with SIGINT ignored, and a child inherits this.
    signal(SIGINT, SIG_DFL);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    emergency::install();
    // Never destroyed: the loop still uses them while the program exits.
    auto& device = *new SharedDevice(*seen_);
    auto& ticker = *new SharedTicker(*seen_, obeys);
    ServoOptions options;
    options.real_time = {.priority = 0, .core = -1, .lock_memory = false, .cores_awake = false};
    // Longer than a busy machine may sleep, so that the loop's own ramp is what acts.
    options.loop.stop_ns = 100'000'000;
    if (!obeys) options.loop.ramp_ns = 300'000'000;
    auto servo = Servo::start(device, ticker, options);
    if (!servo) _exit(90);
    while (seen_->count < 50) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    harm(**servo);
    _exit(91);
  }
};

/// Ended by this signal. A sanitizer's own handler may change a crash into an exit status of its
/// own.
void expect_death_by(int number, int status) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  EXPECT_TRUE(WIFSIGNALED(status) || (WEXITSTATUS(status) != 0 && WEXITSTATUS(status) < 90));
  (void)number;
#else
  ASSERT_TRUE(WIFSIGNALED(status)) << "exit code " << WEXITSTATUS(status);
  EXPECT_EQ(WTERMSIG(status), number);
#endif
}

void in_another_thread(const std::function<void()>& harm) {
  std::thread(harm).join();
}

/// The system must report this error, not the sanitizer.
__attribute__((no_sanitize("undefined", "address"))) void write_where_nothing_is() {
  volatile int* volatile nowhere = nullptr;
  *nowhere = 1;
}

TEST_F(Emergency, RampsToZeroWhenAnotherThreadReadsWhereNothingIs) {
  const int status = child([](Servo&) { in_another_thread(write_where_nothing_is); });
  expect_death_by(SIGSEGV, status);
  expect_ramp_to_zero();
}

TEST_F(Emergency, RampsToZeroWhenAnotherThreadAborts) {
  expect_death_by(SIGABRT, child([](Servo&) { in_another_thread([] { std::abort(); }); }));
  expect_ramp_to_zero();
}

TEST_F(Emergency, RampsToZeroWhenNobodyCatchesAnException) {
  const int status = child([](Servo&) {
    in_another_thread([] { throw std::runtime_error("as expected by this test"); });
  });
  expect_death_by(SIGABRT, status);
  expect_ramp_to_zero();
}

TEST_F(Emergency, RampsToZeroForEverySignalOfACrash) {
  for (int number : {SIGBUS, SIGFPE, SIGILL}) {
    seen_->count = 0;
    expect_death_by(number, child([=](Servo&) { in_another_thread([=] { raise(number); }); }));
    expect_ramp_to_zero();
  }
}

TEST_F(Emergency, RampsToZeroAndKeepsTheCodeWhenAnotherThreadExits) {
  const int status = child([](Servo&) { in_another_thread([] { std::quick_exit(7); }); });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
  expect_ramp_to_zero();

  seen_->count = 0;
  const int second = child([](Servo&) { in_another_thread([] { std::exit(8); }); });
  ASSERT_TRUE(WIFEXITED(second));
  EXPECT_EQ(WEXITSTATUS(second), 8);
  expect_ramp_to_zero();
}

TEST_F(Emergency, TellsTheProgramOfASignalAndRampsMeanwhile) {
  for (int number : {SIGINT, SIGTERM}) {
    seen_->count = 0;
    const int status = child([=](Servo& servo) {
      kill(getpid(), number);
      while (!emergency::is_asked()) std::this_thread::yield();
      servo.stop();
      _exit(5);
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 5);
    expect_ramp_to_zero();
  }
}

TEST_F(Emergency, EndsAProgramThatDoesNotListenAtTheSecondSignal) {
  const int status = child([](Servo&) {
    raise(SIGTERM);
    raise(SIGTERM);
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
  expect_ramp_to_zero();
}

TEST_F(Emergency, RampsByTheLoopItselfWhenTheTickDoesNotObey) {
  expect_death_by(SIGABRT, child([](Servo&) { std::abort(); }, false));
  const int count = seen_->count;
  ASSERT_GT(count, 50);
  EXPECT_EQ(seen_->forces_n[size_t(count - 1)], 0.0);
  int between = 0;
  for (int k = 50; k < count; ++k)
    between += seen_->forces_n[size_t(k)] > 0.0 && seen_->forces_n[size_t(k)] < 2.0;
  EXPECT_GT(between, 1) << "300 ms of ramp have more than one exchange";
}

TEST_F(Emergency, RampsToZeroWhenTheTickItselfCrashes) {
  const int status = child([this](Servo&) {
    seen_->tick_crashes = true;
    std::this_thread::sleep_for(std::chrono::seconds(30));
  });
  expect_death_by(SIGSEGV, status);
  expect_ramp_to_zero();
}

TEST_F(Emergency, DoesNotCallADeviceAgainThatCrashed) {
  const int status = child([this](Servo&) {
    seen_->device_crashes = true;
    std::this_thread::sleep_for(std::chrono::seconds(30));
  });
  expect_death_by(SIGSEGV, status);
  EXPECT_EQ(seen_->forces_n[size_t(seen_->count - 1)], 2.0);
}

}  // namespace
}  // namespace palpate
