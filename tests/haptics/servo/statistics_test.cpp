#include "module/haptics/servo/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

namespace palpate {
namespace {

TEST(Histogram, PutsEveryTimeIntoTheBinThatEndsAtOrAboveIt) {
  int64_t before = -1;
  for (int bin = 0; bin < Histogram::kBins - 1; ++bin) {
    const int64_t last = Histogram::last_of(bin);
    ASSERT_GT(last, before) << bin;
    ASSERT_EQ(Histogram::bin_of(before + 1), bin);
    ASSERT_EQ(Histogram::bin_of(last), bin);
    // The width of a bin is at most a 64th of its times: a value read from it is right within 1.6
    // %.
    ASSERT_LE(double(last - before - 1), double(before + 1) / 64.0) << bin;
    before = last;
  }
  EXPECT_EQ(Histogram::bin_of(-5), 0);
  EXPECT_EQ(Histogram::bin_of(int64_t(1) << 50), Histogram::kBins - 1);
}

TEST(Histogram, ReadsQuantilesLikeASortedList) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    auto histogram = std::make_unique<Histogram>();
    std::vector<int64_t> times;
    for (int k = 0; k < 5000; ++k) {
      const double exponent = 9.0 * double(random()) * 0x1p-32;
      times.push_back(int64_t(std::pow(10.0, exponent)));
      histogram->add(times.back());
    }
    std::sort(times.begin(), times.end());
    for (double q : {0.5, 0.99, 0.999, 0.9999, 1.0}) {
      const int64_t exact = times[size_t(std::ceil(q * double(times.size()))) - 1];
      const int64_t read = histogram->quantile_ns(q);
      ASSERT_GE(read, exact) << "seed " << seed << ", q " << q;
      ASSERT_LE(double(read), double(exact) * (1.0 + 1.0 / 64.0)) << "seed " << seed << ", q " << q;
    }
    EXPECT_EQ(histogram->most_ns(), times.back());
    EXPECT_EQ(histogram->count(), times.size());
  }
}

TEST(Histogram, IsZeroWhenEmpty) {
  auto histogram = std::make_unique<Histogram>();
  EXPECT_EQ(histogram->quantile_ns(0.5), 0);
  EXPECT_EQ(histogram->most_ns(), 0);
  EXPECT_EQ(histogram->mean_ns(), 0.0);
}

TEST(Histogram, IsReadWhileItIsWritten) {
  auto histogram = std::make_unique<Histogram>();
  std::thread writer([&] {
    for (int k = 0; k < 100'000; ++k) histogram->add(1000);
  });
  uint64_t before = 0;
  while (before < 100'000) {
    const uint64_t now = histogram->count();
    ASSERT_GE(now, before);
    if (now > 0) {
      const int64_t median = histogram->quantile_ns(0.5);
      ASSERT_LE(median, Histogram::last_of(Histogram::bin_of(1000)));
    }
    before = now;
  }
  writer.join();
  EXPECT_DOUBLE_EQ(histogram->mean_ns(), 1000.0);
}

}  // namespace
}  // namespace palpate
