#include "module/scene/sequence_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "compute/volume/parallel.h"
#include "compute/volume/volume.h"
#include "module/scene/cell_read.h"
#include "module/scene/lanes.h"

namespace palpate {
namespace {

// No data move by a kilometre.
constexpr float kAbsurdM = 1e3F;

/// The weighted sum of a sample's terms, and its confidence.
class TermSum {
 public:
  TermSum(std::span<const float> samples, size_t floats_per_sample, const TimeWeights& time)
      : samples_(samples.data()), stride_(floats_per_sample), time_(time) {}

  lanes::Quad operator()(size_t sample) const noexcept {
    const float* terms = samples_ + stride_ * sample;
    lanes::Float4 sum{};
    for (int n = 0; n < time_.count; ++n) {
      // The fourth float is the next term's, or the confidence: it is replaced below.
      lanes::Float4 term;
      std::memcpy(&term, terms + 3 * time_.term[size_t(n)], sizeof term);
      sum += time_.weight[size_t(n)] * term;
    }
    return lanes::load({sum[0], sum[1], sum[2], terms[stride_ - 1]});
  }

 private:
  const float* samples_;
  size_t stride_;
  const TimeWeights& time_;
};

}  // namespace

std::shared_ptr<const SequenceMap> SequenceMap::of(const SequenceMotion& motion,
                                                   const Confidence* confidence) {
  const Grid& grid = motion.terms.front().grid;
  assert(motion.terms.size() == motion.basis.terms() && grid.count() > 0);
  std::shared_ptr<SequenceMap> map(new SequenceMap);
  map->place_ = GridPlace(grid);
  map->basis_ = motion.basis;
  map->reference_ = motion.reference;
  map->cell_m_ = 1e-3 * grid.finest_mm();
  std::vector<float> trust;
  if (confidence) trust = resampled(Volume{confidence->grid, confidence->values}, grid).values;
  const size_t terms = motion.terms.size(), stride = map->floats_per_sample();
  map->samples_.resize(grid.count() * stride);
  parallel_ranges(grid.size.z, 5.0 * double(terms) * grid.size.x * grid.size.y,
                  [&](int begin, int end) {
                    for (size_t s = grid.offset(0, 0, begin); s < grid.offset(0, 0, end); ++s) {
                      float* sample = map->samples_.data() + stride * s;
                      bool fine = true;
                      for (size_t n = 0; n < terms; ++n) {
                        const glm::vec3 u(volume_from_lps(glm::dvec3(motion.terms[n].u_mm[s])));
                        fine = fine && std::abs(u.x) + std::abs(u.y) + std::abs(u.z) < kAbsurdM;
                        std::memcpy(sample + 3 * n, &u.x, sizeof u);
                      }
                      const float w = confidence ? std::clamp(trust[s], 0.0F, 1.0F) : 1.0F;
                      sample[stride - 1] = fine && w >= 0.0F ? w : 0.0F;
                      if (!fine) std::fill(sample, sample + stride, 0.0F);
                    }
                  });
  for (int k = 0; k < int(motion.frames()); ++k)
    for (const double phase : {0.0, 0.5}) {
      const auto now = MotionMap::of(combined(motion.terms, motion.basis.at(k, phase)));
      map->worst_contraction_ = std::max(map->worst_contraction_, now->worst_contraction());
      map->worst_determinant_ = std::min(map->worst_determinant_, now->worst_determinant());
      map->folded_cells_ = std::max(map->folded_cells_, now->folded_cells());
      map->largest_u_m_ = std::max(map->largest_u_m_, now->largest_u_m());
      map->moving_share_ = std::max(map->moving_share_, now->moving_share());
    }
  return map;
}

MotionSample SequenceMap::sample(glm::dvec3 x_m, const TimeWeights& time) const noexcept {
  return CellRead(place_, x_m)
      .value_and_jacobian(place_, TermSum(samples_, floats_per_sample(), time));
}

glm::dvec3 SequenceMap::displacement(glm::dvec3 x_m, const TimeWeights& time) const noexcept {
  return lanes::xyz(CellRead(place_, x_m).value(TermSum(samples_, floats_per_sample(), time)));
}

}  // namespace palpate
