#pragma once

#include <cstddef>
#include <vector>

/// What is worth choosing when less of two things is better.
namespace palpate::report {

/// Two costs of one choice, for example seconds and error; less is better in both.
struct Costs {
  double first = 0.0, second = 0.0;
};

/// a is at least as good as b in both costs, by the given shares of b's, and better in one: where
/// measurements scatter, `margin` says how much of a difference counts (0.05: below 95 % of it).
bool beats(const Costs& a, const Costs& b, double first_margin = 0.0, double second_margin = 0.0);

/// The choices that no other one beats, as indices in rising order of the first cost. Of equal
/// choices the first in the list stays. Choices with a cost that is no finite number are never on
/// it.
std::vector<size_t> pareto_front(const std::vector<Costs>& choices);

}  // namespace palpate::report
