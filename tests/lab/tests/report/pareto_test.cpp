#include "tests/lab/report/pareto.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace palpate::report {
namespace {

std::vector<Costs> drawn_choices(uint32_t seed) {
  test::Random random(seed);
  std::vector<Costs> choices(size_t(random.draw(0.0, 40.0)));
  // Few different values, so that equal ones occur.
  for (Costs& c : choices)
    c = {std::round(random.draw(0.0, 12.0)), std::round(random.draw(0.0, 12.0))};
  return choices;
}

TEST(ParetoFront, HoldsExactlyTheChoicesThatNoOtherBeats) {
  for (uint32_t seed = 1; seed <= 500; ++seed) {
    const auto choices = drawn_choices(seed);
    const auto front = pareto_front(choices);
    for (size_t n = 0; n < choices.size(); ++n) {
      const bool on_it = std::find(front.begin(), front.end(), n) != front.end();
      const bool beaten = std::any_of(choices.begin(), choices.end(),
                                      [&](const Costs& c) { return beats(c, choices[n]); });
      const bool repeated =
          std::any_of(choices.begin(), choices.begin() + std::ptrdiff_t(n), [&](const Costs& c) {
            return c.first == choices[n].first && c.second == choices[n].second;
          });
      EXPECT_EQ(on_it, !beaten && !repeated) << "seed " << seed << ", choice " << n;
    }
  }
}

TEST(ParetoFront, CostsMoreOfTheFirstForLessOfTheSecond) {
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    const auto choices = drawn_choices(seed);
    const auto front = pareto_front(choices);
    for (size_t k = 1; k < front.size(); ++k) {
      EXPECT_GT(choices[front[k]].first, choices[front[k - 1]].first) << "seed " << seed;
      EXPECT_LT(choices[front[k]].second, choices[front[k - 1]].second) << "seed " << seed;
    }
  }
}

TEST(ParetoFront, LeavesOutWhatIsNoNumber) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(pareto_front({{nan, 0.0}, {0.0, nan}, {inf, -1.0}, {1.0, 2.0}}),
            (std::vector<size_t>{3}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(Beats, AsksForAsMuchAsTheMarginSays) {
  EXPECT_TRUE(beats({0.9, 1.0}, {1.0, 1.0}));
  EXPECT_FALSE(beats({1.0, 1.0}, {1.0, 1.0}));
  EXPECT_FALSE(beats({0.9, 1.1}, {1.0, 1.0}));
  EXPECT_FALSE(beats({0.96, 0.5}, {1.0, 1.0}, 0.05));
  EXPECT_TRUE(beats({0.94, 0.5}, {1.0, 1.0}, 0.05));
}

}  // namespace
}  // namespace palpate::report
