// Properties of balance() for any set of primitives, on seeded random sets. Oracle: an optimality
// check that uses only the proxy (balance_check.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "module/haptics/proxy/balance.h"
#include "module/haptics/proxy/balance_convex.h"
#include "tests/haptics/proxy/balance_check.h"
#include "tests/haptics/proxy/balance_sets.h"
#include "tests/support/random.h"

namespace palpate::test {
namespace {

/// More are counted as so many.
constexpr int kMaxIterations = 2 * ConvexBalance::kMaxIterations;

/// Sum over primitives of strength times the round-off of places that balance_check.h allows: the
/// uncertainty of Phi, in J.
double slack_j(const BalanceCase& made, glm::dvec3 proxy) {
  double place = std::max(largest_of(made.probe), largest_of(proxy)), strength = 0.0;
  for (const Primitive& p : made.primitives) {
    place = std::max({place, largest_of(p.position), p.strength_n / made.stiffness_n_per_m});
    strength += p.strength_n;
  }
  return kPlaceSlack * std::max(place, kSmallestPlace) *
         (strength + made.stiffness_n_per_m * place);
}

/// How far apart two proxies of the same case can be if Phi has the uncertainty slack_j and the
/// residual is 1e-9 N: Phi grows by k/2 |d|^2 from its minimum.
double apart_m(const BalanceCase& made, glm::dvec3 proxy) {
  return 2e-9 / made.stiffness_n_per_m +
         std::sqrt(4.0 * slack_j(made, proxy) / made.stiffness_n_per_m);
}

Balance solve(const BalanceCase& made) {
  return balance(made.primitives, made.probe, made.stiffness_n_per_m);
}

/// PALPATE_BALANCE_SETS: how many sets to test; a million takes about half a minute.
unsigned set_count() {
  const char* wanted = std::getenv("PALPATE_BALANCE_SETS");
  return wanted ? unsigned(std::stoul(wanted)) : 100000U;
}

TEST(BalanceSets, AreSolvedToANanonewton) {
  std::array<long, kMaxIterations + 1> histogram{};
  int failures = 0;
  const unsigned count = set_count();
  for (unsigned seed = 0; seed < count && failures < 20; ++seed) {
    const BalanceCase made = random_set(seed);
    const Balance got = solve(made);
    ++histogram[size_t(std::min(got.iterations, kMaxIterations))];
    const double residual =
        residual_n(made.primitives, made.probe, made.stiffness_n_per_m, got.proxy);
    if (got.converged && got.residual_n <= 1e-9 && residual <= 1e-9) continue;
    ++failures;
    ADD_FAILURE() << "seed " << seed << ": " << made.primitives.count() << " primitives, residual "
                  << residual << " N, reported " << got.residual_n << " N, converged "
                  << got.converged << " after " << got.iterations;
  }
  long sum = 0;
  std::string text;
  for (size_t k = 0; k < histogram.size(); ++k) {
    sum += histogram[k];
    if (histogram[k] > 0)
      text += std::to_string(k) + ":" + std::to_string(double(sum) / double(count)) + " ";
  }
  RecordProperty("share_solved_within_iterations", text);
}

TEST(BalanceSets, AreTheSameWithAHintOfWhatHeldLast) {
  // A hand that moves a little, then a lot, and then meets a different set.
  BalanceHint hint;
  for (unsigned seed = 0; seed < 4000; ++seed) {
    BalanceCase made = random_set(seed);
    const glm::dvec3 start = made.probe;
    for (const double share : {0.0, 1e-4, 3e-4, 1e-2, 0.5, 0.5}) {
      made.probe = start + share * glm::dvec3(start.y, -start.z, start.x);
      const glm::dvec3 cold = solve(made).proxy;
      const Balance got = balance(made.primitives, made.probe, made.stiffness_n_per_m, &hint);
      ASSERT_TRUE(got.converged) << "seed " << seed << ", share " << share;
      ASSERT_LE(residual_n(made.primitives, made.probe, made.stiffness_n_per_m, got.proxy), 1e-9)
          << "seed " << seed << ", share " << share;
      ASSERT_LE(glm::distance(got.proxy, cold), apart_m(made, cold))
          << "seed " << seed << ", share " << share;
    }
  }
}

TEST(BalanceSets, AreNeverAboveASlowReference) {
  for (unsigned seed = 0; seed < 3000; ++seed) {
    const BalanceCase made = random_set(seed);
    const glm::dvec3 got = solve(made).proxy;
    const glm::dvec3 slow = slow_balance(made.primitives, made.probe, made.stiffness_n_per_m, 1000);
    const auto phi = [&](glm::dvec3 x) {
      return objective_j(made.primitives, made.probe, made.stiffness_n_per_m, x);
    };
    const long double above = phi(slow) - phi(got);
    const double slack = slack_j(made, got);
    EXPECT_GE(double(above), -slack) << "seed " << seed;
    // By strong convexity the reference is not farther away than the difference of Phi allows.
    const double apart = glm::distance(slow, got);
    EXPECT_LE(0.5 * made.stiffness_n_per_m * apart * apart, 2.0 * double(above) + 4.0 * slack)
        << "seed " << seed;
  }
}

TEST(BalanceSets, NeverMoveTheProxyFurtherThanTheProbe) {
  Random random(7);
  for (unsigned seed = 0; seed < 20000; ++seed) {
    BalanceCase made = random_set(seed);
    const glm::dvec3 first = solve(made).proxy;
    const glm::dvec3 probe = made.probe;
    made.probe += random.vector(std::exp(random.draw(std::log(1e-6), 0.0)));
    const glm::dvec3 second = solve(made).proxy;
    EXPECT_LE(glm::distance(first, second),
              glm::distance(probe, made.probe) + 2.0 * apart_m(made, second))
        << "seed " << seed;
  }
}

TEST(BalanceSets, DoNotDependOnTheOrderOfPrimitives) {
  Random random(11);
  for (unsigned seed = 0; seed < 20000; ++seed) {
    BalanceCase made = random_set(seed);
    const glm::dvec3 first = solve(made).proxy;
    for (int i = made.primitives.count() - 1; i > 0; --i)
      std::swap(made.primitives.begin()[i],
                made.primitives.begin()[int(random.draw(0.0, double(i + 1)))]);
    EXPECT_LE(glm::distance(first, solve(made).proxy), apart_m(made, first)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace palpate::test
