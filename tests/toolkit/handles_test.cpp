// Handles that several threads use and close at the same time. Oracle: the guarantee in palpate.h:
// a call with a handle that another thread has closed fails, and closing waits for calls that are
// running.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "integration/toolkit/handles.h"

namespace palpate::test {
namespace {

using namespace std::chrono_literals;
using toolkit::Use;

/// The object behind a handle. It counts living objects, and is marked when it is destroyed.
struct Probe {
  static constexpr int kAlive = 4711;
  static inline std::atomic<int> living{0};
  std::atomic<int> mark{kAlive};
  Probe() { ++living; }
  ~Probe() {
    mark = 0;
    --living;
  }
};

/// Sometimes lets other threads run before an access. Without this two accesses of a thread are
/// nanoseconds apart, and a wrong order of them would hardly ever show.
void give_way() {
  thread_local uint32_t state = 1;
  state = 1664525 * state + 1013904223;
  if (state >> 30 == 0) std::this_thread::sleep_for(std::chrono::microseconds(state >> 24 & 31));
  if (state >> 30 == 1) std::this_thread::yield();
}

template <class Value>
class GivingWay {
 public:
  GivingWay(Value value) : value_(value) {}
  Value load() const { return give_way(), value_.load(); }
  void store(Value value) { give_way(), value_.store(value); }
  Value exchange(Value value) { return give_way(), value_.exchange(value); }
  Value fetch_add(Value value) { return give_way(), value_.fetch_add(value); }
  Value fetch_sub(Value value) { return give_way(), value_.fetch_sub(value); }

 private:
  std::atomic<Value> value_;
};

using Handle = toolkit::Handle<Probe, GivingWay>;

/// Makes two threads begin at the same time, round after round.
class Pair {
 public:
  /// Waits for the other thread.
  void meet() {
    const int round = round_.load();
    if (arrived_.fetch_add(1) == 1) {
      arrived_.store(0);
      round_.store(round + 1);
      return;
    }
    for (int spin = 0; round_.load() == round; ++spin)
      if (spin > 2000) std::this_thread::yield();
  }

 private:
  std::atomic<int> arrived_{0}, round_{0};
};

TEST(Handles, WaitWithClosingForTheCallThatRuns) {
  auto* const handle = Handle::make(std::make_shared<Probe>());
  std::atomic<bool> in_use{false}, closing{false}, closed{false};
  std::thread call([&] {
    const Use use(handle);
    ASSERT_TRUE(use);
    in_use = true;
    while (!closing) std::this_thread::yield();
    // While this call runs the handle's object must not be destroyed, however long the call takes.
    for (int k = 0; k < 50; ++k) {
      std::this_thread::sleep_for(1ms);
      EXPECT_FALSE(closed);
      EXPECT_EQ(Probe::living, 1);
    }
  });
  while (!in_use) std::this_thread::yield();
  closing = true;
  handle->close().reset();
  closed = true;
  call.join();
  EXPECT_EQ(Probe::living, 0);
}

TEST(Handles, RefuseCallsWhileTheyAreClosed) {
  auto* const handle = Handle::make(std::make_shared<Probe>());
  std::atomic<bool> in_use{false}, closing{false};
  std::thread call([&] {
    const Use use(handle);
    in_use = true;
    while (!closing) std::this_thread::yield();
    // The close waits for this call, and no other call can begin.
    for (int tries = 0; Use(handle); ++tries) {
      std::this_thread::sleep_for(1ms);
      ASSERT_LT(tries, 10'000);
    }
  });
  while (!in_use) std::this_thread::yield();
  closing = true;
  handle->close().reset();
  call.join();
  EXPECT_FALSE(Use(handle));
  EXPECT_FALSE(handle->close());
}

TEST(Handles, AreClosedByOneOfTwoThreads) {
  constexpr int kRounds = 5'000;
  Pair pair;
  Handle* handle = nullptr;
  std::atomic<int> got{0};
  std::thread other([&] {
    for (int round = 0; round < kRounds; ++round) {
      pair.meet();
      got += handle->close() != nullptr;
      pair.meet();
    }
  });
  int wrong = 0;
  for (int round = 0; round < kRounds; ++round) {
    handle = Handle::make(std::make_shared<Probe>());
    got = 0;
    pair.meet();
    got += handle->close() != nullptr;
    pair.meet();
    wrong += got != 1;
  }
  other.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(Probe::living, 0);
  // A handle that was freed twice would soon stand for two objects.
  std::set<Handle*> open;
  for (size_t k = 0; k < 4 * Handle::kRest; ++k) {
    open.insert(Handle::make(std::make_shared<Probe>()));
    ASSERT_EQ(open.size(), k + 1);
  }
  for (Handle* one : open) one->close();
}

TEST(Handles, StandForSomethingInEveryCallThatIsNotRefused) {
  constexpr int kRounds = 5'000;
  Pair pair;
  Handle* handle = nullptr;
  std::atomic<int> refused{0}, wrong{0};
  std::thread caller([&] {
    for (int round = 0; round < kRounds; ++round) {
      pair.meet();
      // The close comes at once, except on a busy machine.
      const auto give_up = std::chrono::steady_clock::now() + 20s;
      for (bool open = true; open && wrong == 0;) {
        wrong += std::chrono::steady_clock::now() > give_up;
        const Use use(handle);
        open = bool(use);
        refused += !open;
        if (!open) break;
        // The close has taken the object out; it must have waited for this.
        const std::shared_ptr<Probe> content = use.shared();
        wrong += !content || content->mark != Probe::kAlive;
      }
      pair.meet();
    }
  });
  for (int round = 0; round < kRounds; ++round) {
    handle = Handle::make(std::make_shared<Probe>());
    pair.meet();
    // At a different point of the caller's loop in each round.
    for (int spin = 0; spin < round % 97; ++spin)
      std::atomic_signal_fence(std::memory_order_seq_cst);
    handle->close().reset();
    pair.meet();
  }
  caller.join();
  EXPECT_EQ(refused, kRounds);
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace palpate::test
