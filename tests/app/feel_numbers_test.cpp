// The history of a run: of bounded size, without losing a peak or a cause.
#include <gtest/gtest.h>

#include <random>

#include "integration/running/feel_numbers.h"

namespace palpate::running {
namespace {

TickRow row_at(int tick, double force_n) {
  TickRow row;
  row.time_s = 1e-3 * tick;
  row.dt_s = 1e-3;
  row.force_n = {0.0, 0.0, force_n};
  row.in_contact = force_n > 0.0;
  return row;
}

TEST(TickHistory, KeepsEveryTickOfAShortRun) {
  TickHistory history;
  for (int k = 0; k < 30'000; ++k) history.add(row_at(k, 0.1));
  ASSERT_EQ(history.rows().size(), 30'000U);
  for (size_t k = 0; k < history.rows().size(); ++k)
    ASSERT_EQ(history.rows()[k].time_s, 1e-3 * double(k));
}

TEST(TickHistory, IsBoundedAndLosesNoPeakAndNoCause) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> force(0.5, 1.0);
    const int ticks = 2'000'000;
    const int peak = int(random() % ticks), fault = int(random() % ticks);
    TickHistory history;
    const TickRow* memory = history.rows().data();
    for (int k = 0; k < ticks; ++k) {
      TickRow row = row_at(k, k == peak ? 7.0 : force(random));
      if (k == fault) row.cause = Cause::kLate;
      history.add(row);
    }
    const auto& rows = history.rows();
    EXPECT_EQ(rows.data(), memory) << "no memory is allocated later";
    EXPECT_LE(rows.size(), TickHistory::kMostRows);
    EXPECT_GT(rows.size(), TickHistory::kMostRows / 4);
    bool has_peak = false, has_fault = false;
    double longest_gap_s = 0.0;
    for (size_t k = 0; k < rows.size(); ++k) {
      has_peak |= rows[k].force_n.z == 7.0;
      has_fault |= rows[k].cause == Cause::kLate;
      if (k == 0) continue;
      ASSERT_GT(rows[k].time_s, rows[k - 1].time_s) << "seed " << seed;
      longest_gap_s = std::max(longest_gap_s, rows[k].time_s - rows[k - 1].time_s);
    }
    EXPECT_TRUE(has_peak) << "seed " << seed;
    EXPECT_TRUE(has_fault) << "seed " << seed;
    EXPECT_LT(longest_gap_s, 2000.0 / 4000.0) << "not evenly spread over " << ticks << " ticks";
  }
}

TEST(FeelCounter, CountsWhatTheTicksSay) {
  FeelCounter counter;
  // A hand on a spring of 1 N whose force rises in steps: what is missing is the first contact's.
  const auto add = [&counter](const TickRow& row) {
    ForceLedger ledger;
    ledger.asked_n = row.force_n + glm::dvec3(0.0, 0.0, 0.75);
    ledger[Limiter::kFirstContact] = {0.0, 0.0, 0.75 - 1e-6 * row.time_s};
    ledger[Limiter::kHeat] = {0.0, 0.004, 0.0};
    ledger.asked_n += ledger[Limiter::kHeat];
    counter.add(row, ledger, 0.25 + row.time_s);
  };
  add(row_at(0, 0.0));
  add(row_at(1, 0.5));
  TickRow late = row_at(2, 0.2);
  late.cause = Cause::kLate;
  late.probe_m = {0.0, 0.0, -0.002};
  add(late);
  const FeelNumbers numbers = counter.numbers();
  EXPECT_DOUBLE_EQ(numbers.seconds, 3e-3);
  EXPECT_DOUBLE_EQ(numbers.touched_s, 2e-3);
  EXPECT_DOUBLE_EQ(numbers.mean_force_n, 0.35);
  EXPECT_DOUBLE_EQ(numbers.most_force_n, 0.5);
  EXPECT_DOUBLE_EQ(numbers.steepest_n_per_ms, 0.5);
  EXPECT_EQ(numbers.late_ticks, 0U);
  TickRow later = row_at(3, 1.4);
  later.dt_s = 4e-3;
  add(later);
  EXPECT_DOUBLE_EQ(counter.numbers().steepest_n_per_ms, 0.5);
  EXPECT_EQ(counter.numbers().late_ticks, 1U);
  EXPECT_DOUBLE_EQ(counter.numbers().latest_s, 4e-3);
  EXPECT_DOUBLE_EQ(counter.numbers().late_change_n, 1.2);
  EXPECT_DOUBLE_EQ(numbers.deepest_m, 0.002);
  EXPECT_DOUBLE_EQ(numbers.hand_work_j, 0.252);
  ASSERT_EQ(numbers.held.size(), 1U) << "less than 0.005 N is not told";
  EXPECT_EQ(numbers.held[0].limiter, Limiter::kFirstContact);
  EXPECT_DOUBLE_EQ(numbers.held[0].seconds, 3e-3);
  EXPECT_DOUBLE_EQ(numbers.held[0].most_n, 0.75);
  ASSERT_EQ(numbers.causes.size(), 1U);
  EXPECT_EQ(numbers.causes[0].cause, Cause::kLate);
  EXPECT_DOUBLE_EQ(numbers.causes[0].from_s, 2e-3);
}

}  // namespace
}  // namespace palpate::running
