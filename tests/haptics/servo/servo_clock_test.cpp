#include "module/haptics/servo/servo_clock.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/support/wait_for.h"

namespace palpate {
namespace {

constexpr int64_t kStep_ns = 1'000'000;

TEST(ComputedClock, PassesAsFastAsItIsSleptOnAndNoFartherThanItIsLet) {
  ComputedClock clock;
  const int64_t start_ns = clock.now_ns();
  std::atomic<int> wakes{0};
  std::thread loop([&] {
    for (int k = 1; k <= 300'000; ++k) {
      clock.sleep_until(start_ns + k * kStep_ns);
      ++wakes;
    }
  });
  clock.let_pass(100 * kStep_ns);
  EXPECT_TRUE(wait_for([&] { return wakes == 100; }));
  EXPECT_EQ(clock.now_ns(), start_ns + 100 * kStep_ns);
  clock.let_pass(0);
  EXPECT_EQ(wakes, 100);
  // Five minutes, which nobody waits for.
  clock.let_go();
  loop.join();
  EXPECT_EQ(wakes, 300'000);
  EXPECT_EQ(clock.now_ns(), start_ns + 300'000 * kStep_ns);
  // A time that has passed already ends at once, and the clock does not go back.
  clock.sleep_until(start_ns);
  EXPECT_EQ(clock.now_ns(), start_ns + 300'000 * kStep_ns);
}

}  // namespace
}  // namespace palpate
