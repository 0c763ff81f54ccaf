#include "module/session/repetition.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr int kBlocks = 12;       // along each axis
constexpr int kFewestFrames = 4;  // in a cycle
constexpr double kAlike = 0.3;    // of the largest difference within a cycle

std::vector<float> means_of(const Volume& frame) {
  const glm::ivec3 n = frame.grid.size, blocks = glm::min(n, glm::ivec3(kBlocks));
  std::vector<double> sum(size_t(blocks.x * blocks.y * blocks.z), 0.0);
  std::vector<int> count(sum.size(), 0);
  size_t v = 0;
  for (int k = 0; k < n.z; ++k)
    for (int j = 0; j < n.y; ++j)
      for (int i = 0; i < n.x; ++i, ++v) {
        const int b =
            i * blocks.x / n.x + blocks.x * (j * blocks.y / n.y + blocks.y * (k * blocks.z / n.z));
        sum[size_t(b)] += double(frame.values[v]);
        ++count[size_t(b)];
      }
  std::vector<float> means(sum.size());
  for (size_t b = 0; b < means.size(); ++b) means[b] = float(sum[b] / std::max(count[b], 1));
  return means;
}

double distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += (double(a[i]) - b[i]) * (double(a[i]) - b[i]);
  return std::sqrt(sum / double(a.size()));
}

}  // namespace

void Repetition::clear() {
  *this = {};
}

std::optional<int> Repetition::add(const Volume& frame) {
  std::vector<float> means = means_of(frame);
  if (!means_.empty() && means_.back().size() != means.size()) clear();
  std::vector<double> to;
  for (auto before = means_.rbegin(); before != means_.rend() && to.size() <= kMostFrames; ++before)
    to.push_back(distance(means, *before));
  means_.push_back(std::move(means));
  distances_.push_back(std::move(to));
  if (means_.size() > 2 * kMostFrames + 2) {
    means_.pop_front();
    distances_.pop_front();
  }
  // m(k) for the k for which there are 2 k frames; infinite beyond.
  const int count = int(means_.size());
  const auto m = [&](int k) {
    if (2 * k > count) return INFINITY;
    double sum = 0.0;
    for (int i = 0; i < k; ++i) sum += distances_[size_t(count - 1 - i)][size_t(k - 1)];
    return float(sum / k);
  };
  double most = 0.0;
  std::optional<int> found;
  for (int k = 1; k <= kMostFrames && 2 * (k + 1) <= count && !found; ++k) {
    const double here = m(k);
    if (k >= kFewestFrames && most > 0.0 && here <= kAlike * most && here <= m(k + 1) &&
        here <= m(k - 1))
      found = k;
    else
      most = std::max(most, here);
  }
  in_a_row_ = found && std::abs(*found - found_) <= 1 ? in_a_row_ + 1 : int(found.has_value());
  found_ = found.value_or(0);
  if (in_a_row_ < std::max(3, found_ / 4)) return std::nullopt;
  contrast_ = most;
  return found;
}

std::vector<std::vector<float>> Repetition::last(int k) const {
  return {means_.end() - std::min<ptrdiff_t>(k, ptrdiff_t(means_.size())), means_.end()};
}

Repetition::NearestFrame Repetition::nearest(const Volume& frame,
                                             const std::vector<std::vector<float>>& of) {
  const std::vector<float> means = means_of(frame);
  NearestFrame best{0, INFINITY};
  for (size_t f = 0; f < of.size(); ++f) {
    if (of[f].size() != means.size()) continue;
    const double far = distance(means, of[f]);
    if (far < best.distance) best = {int(f), far};
  }
  return best;
}

Repetition::NearestFrame Repetition::nearest(const Volume& frame,
                                             const std::vector<std::vector<float>>& of,
                                             double expected, double as_like) {
  const std::vector<float> means = means_of(frame);
  const double count = double(of.size());
  std::vector<double> far(of.size(), INFINITY);
  for (size_t f = 0; f < of.size(); ++f)
    if (of[f].size() == means.size()) far[f] = distance(means, of[f]);
  const double best = far.empty() ? INFINITY : *std::min_element(far.begin(), far.end());
  NearestFrame found{0, INFINITY};
  double nearest = INFINITY;
  for (size_t f = 0; f < of.size(); ++f) {
    const double away = std::abs(std::remainder(double(f) - expected, count));
    if (!(far[f] <= best + as_like) || away >= nearest) continue;
    nearest = away;
    found = {int(f), far[f]};
  }
  return found;
}

}  // namespace palpate
