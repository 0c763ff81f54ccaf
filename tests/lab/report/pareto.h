#pragma once

#include <cstddef>
#include <vector>

/// The Pareto front: choices worth considering if less of two costs is better.
namespace palpate::report {

/// Two costs of one choice, for example seconds and error; less is better in both.
struct Costs {
  double first = 0.0, second = 0.0;
};

/// Whether a is at least as good as b in both costs, by the given shares of b's, and better in one.
/// A margin is for the scatter of measurements: with 0.05 a cost must be below 95 % of the other.
bool beats(const Costs& a, const Costs& b, double first_margin = 0.0, double second_margin = 0.0);

/// The choices that no other one beats, as indices in increasing order of the first cost. Of equal
/// choices the first in the list is kept. Choices with a cost that is not finite are never on it.
std::vector<size_t> pareto_front(const std::vector<Costs>& choices);

}  // namespace palpate::report
