#include "tests/lab/report/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate::report {

bool beats(const Costs& a, const Costs& b, double first_margin, double second_margin) {
  const double first = b.first * (1.0 - first_margin), second = b.second * (1.0 - second_margin);
  return a.first <= first && a.second <= second && (a.first < first || a.second < second);
}

std::vector<size_t> pareto_front(const std::vector<Costs>& choices) {
  std::vector<size_t> order;
  for (size_t n = 0; n < choices.size(); ++n)
    if (std::isfinite(choices[n].first) && std::isfinite(choices[n].second)) order.push_back(n);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    if (choices[a].first != choices[b].first) return choices[a].first < choices[b].first;
    return choices[a].second < choices[b].second;
  });
  // In this order a choice is beaten exactly if an earlier one is as good in the second cost.
  std::vector<size_t> front;
  double best = std::numeric_limits<double>::infinity();
  for (const size_t n : order) {
    if (choices[n].second >= best) continue;
    best = choices[n].second;
    front.push_back(n);
  }
  return front;
}

}  // namespace palpate::report
