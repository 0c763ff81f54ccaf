#include "compute/motion/frame_order.h"

#include <algorithm>
#include <cmath>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr size_t kMostPoints = 250'000;

double product(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double sum = 0.0;
  for (size_t n = 0; n < a.size(); ++n) sum += double(glm::dot(a[n], b[n]));
  return sum;
}

}  // namespace

FrameOrderMeter::FrameOrderMeter(const Grid& grid, const Mask* mask, double voxel_mm)
    : grid_(grid), voxel_mm_(voxel_mm) {
  const size_t count = grid.count(), stride = 1 + count / kMostPoints;
  for (size_t n = 0; n < count; n += stride)
    if (!mask || mask->values[n]) samples_.push_back(n);
}

void FrameOrderMeter::follow(const Field& u) {
  const auto row = size_t(grid_.size.x), slice = row * size_t(grid_.size.y);
  if (places_mm_.empty())
    for (const size_t n : samples_)
      places_mm_.push_back(
          grid_.lps_from_index({n % row, n / row % size_t(grid_.size.y), n / slice}));
  std::vector<glm::vec3> step_mm(samples_.size());
  parallel_ranges(int(samples_.size()), 100.0, [&](int begin, int end) {
    for (auto n = size_t(begin); n < size_t(end); ++n) {
      const glm::dvec3 by_mm = sample_at_lps(u, places_mm_[n]);
      step_mm[n] = glm::vec3(by_mm);
      places_mm_[n] += by_mm;
    }
  });
  add(std::move(step_mm));
}

void FrameOrderMeter::take(const Field& from, const Field& to) {
  std::vector<glm::vec3> step_mm;
  step_mm.reserve(samples_.size());
  for (const size_t n : samples_) step_mm.push_back(to.u_mm[n] - from.u_mm[n]);
  add(std::move(step_mm));
}

void FrameOrderMeter::add(std::vector<glm::vec3> step_mm) {
  squares_.push_back(product(step_mm, step_mm));
  if (squares_.size() > 1) products_.push_back(product(last_, step_mm));
  if (first_.empty()) first_ = step_mm;
  last_ = std::move(step_mm);
}

FrameOrder FrameOrderMeter::found(bool cyclic) const {
  FrameOrder order;
  const size_t steps = squares_.size();
  order.frames = steps + (cyclic ? 0 : 1);
  order.voxel_mm = voxel_mm_;
  if (steps < 2 || samples_.empty()) return order;
  std::vector<double> back;  // -d_k d_{k+1}
  for (const double onward : products_) back.push_back(-onward);
  if (cyclic) back.push_back(-product(last_, first_));
  double square = 0.0, reversed = 0.0, onward = 0.0;
  for (const double of_step : squares_) square += of_step;
  for (const double of_step : products_) onward += of_step;
  for (size_t k = 0; k + 1 < back.size() + (cyclic ? 1 : 0); ++k)
    reversed += std::max(0.0, std::min(back[k], back[(k + 1) % back.size()]));
  if (!(square > 0.0)) return order;
  order.to_and_fro = reversed / square;
  order.onward = onward / square;
  const auto worst = size_t(std::max_element(back.begin(), back.end()) - back.begin());
  const double count = double(samples_.size()), before = squares_[worst] / count,
               after = squares_[(worst + 1) % steps] / count;
  order.frame = (worst + 1) % order.frames;
  order.before_mm = std::sqrt(before);
  order.after_mm = std::sqrt(after);
  order.apart_mm = std::sqrt(std::max(0.0, before + after - 2.0 * back[worst] / count));
  return order;
}

}  // namespace palpate
