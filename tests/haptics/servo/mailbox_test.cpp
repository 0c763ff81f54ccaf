// Values that pass between two threads. Oracle: the order in which they were sent. The cases with
// two threads are mainly for the thread sanitizer.
#include "module/haptics/servo/mailbox.h"

#include <gtest/gtest.h>

#include <thread>

namespace palpate {
namespace {

TEST(Ring, KeepsOrderAndRefusesWhatDoesNotFit) {
  Ring<int, 4> ring;
  int item = -1;
  EXPECT_FALSE(ring.pop(item));
  for (int round = 0; round < 5; ++round) {
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(ring.push(k));
    EXPECT_FALSE(ring.push(99));
    EXPECT_EQ(ring.dropped(), uint64_t(round + 1));
    for (int k = 0; k < 4; ++k) {
      ASSERT_TRUE(ring.pop(item));
      EXPECT_EQ(item, k);
    }
    EXPECT_FALSE(ring.pop(item));
  }
}

TEST(Ring, CarriesEveryAcceptedItemFromOneThreadToAnother) {
  struct Item {
    uint64_t number, twice;
  };
  Ring<Item, 64> ring;
  constexpr uint64_t kItems = 100'000;
  std::thread writer([&] {
    for (uint64_t n = 0; n < kItems;) {
      if (ring.push({n, 2 * n}))
        ++n;
      else
        std::this_thread::yield();
    }
  });
  for (uint64_t n = 0; n < kItems;) {
    Item item;
    if (!ring.pop(item)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(item.number, n);
    ASSERT_EQ(item.twice, 2 * n);
    ++n;
  }
  writer.join();
}

TEST(Newest, GivesTheLastValueOnceAsNew) {
  Newest<int> newest;
  int value = 7;
  EXPECT_FALSE(newest.get(value));
  EXPECT_EQ(value, 7);
  for (int k = 0; k < 10; ++k) newest.put(k);
  EXPECT_TRUE(newest.get(value));
  EXPECT_EQ(value, 9);
  value = 0;
  EXPECT_FALSE(newest.get(value));
  EXPECT_EQ(value, 9);
}

TEST(Newest, IsNeverTornAndNeverGoesBack) {
  struct Wide {
    std::array<uint64_t, 32> same;
  };
  Newest<Wide> newest;
  constexpr uint64_t kLast = 50'000;
  std::thread writer([&] {
    Wide wide;
    for (uint64_t n = 1; n <= kLast; ++n) {
      wide.same.fill(n);
      newest.put(wide);
    }
  });
  uint64_t last = 0;
  while (last < kLast) {
    Wide wide{};
    if (!newest.get(wide)) {
      std::this_thread::yield();
      continue;
    }
    for (uint64_t part : wide.same) ASSERT_EQ(part, wide.same[0]);
    ASSERT_GT(wide.same[0], last);
    last = wide.same[0];
  }
  writer.join();
}

/// Counts its living objects.
struct Counted {
  explicit Counted(std::atomic<int>& counter, int value) : alive(counter), number(value) {
    ++alive;
  }
  ~Counted() {
    --alive;
    number = -1;
  }
  std::atomic<int>& alive;
  int number;
};

TEST(Handover, DeletesOnlyInTheOwnersThreadWhatTheLoopRetired) {
  std::atomic<int> alive = 0;
  {
    Handover<Counted> handover;
    EXPECT_EQ(handover.take(), nullptr);
    auto first = std::make_unique<Counted>(alive, 1);
    EXPECT_TRUE(handover.offer(first));
    EXPECT_EQ(first, nullptr);
    Counted* using_now = handover.take();
    ASSERT_NE(using_now, nullptr);
    EXPECT_EQ(using_now->number, 1);
    EXPECT_EQ(handover.take(), nullptr);
    auto second = std::make_unique<Counted>(alive, 2);
    EXPECT_TRUE(handover.offer(second));
    EXPECT_EQ(alive, 2);
    Counted* next = handover.take();
    handover.retire(using_now);
    EXPECT_EQ(alive, 2) << "retiring must not delete";
    handover.collect();
    EXPECT_EQ(alive, 1);
    EXPECT_EQ(next->number, 2);
  }
  EXPECT_EQ(alive, 0) << "what the loop still had is the owner's at the end";
}

TEST(Handover, ReplacesAnOfferThatNobodyTook) {
  std::atomic<int> alive = 0;
  Handover<Counted> handover;
  for (int k = 0; k < 5; ++k) {
    auto fresh = std::make_unique<Counted>(alive, k);
    EXPECT_TRUE(handover.offer(fresh));
    EXPECT_EQ(alive, 1);
  }
  EXPECT_EQ(handover.take()->number, 4);
}

TEST(Handover, RefusesWhenTooManyAreOutAndTakesAgainAfterOneIsBack) {
  std::atomic<int> alive = 0;
  Handover<Counted, 3> handover;
  std::array<Counted*, 3> held{};
  for (int k = 0; k < 3; ++k) {
    auto fresh = std::make_unique<Counted>(alive, k);
    ASSERT_TRUE(handover.offer(fresh));
    held[size_t(k)] = handover.take();
  }
  auto more = std::make_unique<Counted>(alive, 3);
  EXPECT_FALSE(handover.offer(more));
  ASSERT_NE(more, nullptr);
  handover.retire(held[1]);
  EXPECT_TRUE(handover.offer(more));
  EXPECT_EQ(handover.out(), 3u);
}

TEST(Handover, PassesObjectsBetweenThreads) {
  std::atomic<int> alive = 0;
  Handover<Counted> handover;
  constexpr int kLast = 5000;
  std::thread loop([&] {
    Counted* current = nullptr;
    for (int number = 0; number != kLast;) {
      if (Counted* fresh = handover.take()) {
        handover.retire(current);
        current = fresh;
        ASSERT_GT(current->number, number);
        number = current->number;
      } else {
        if (current) {
          ASSERT_EQ(current->number, number);
        }
        std::this_thread::yield();
      }
    }
  });
  for (int number = 1; number <= kLast;) {
    auto fresh = std::make_unique<Counted>(alive, number);
    while (!handover.offer(fresh)) std::this_thread::yield();
    ++number;
  }
  loop.join();
  handover.collect();
  EXPECT_EQ(alive, 1);
}

}  // namespace
}  // namespace palpate
