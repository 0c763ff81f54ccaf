#include "module/scene/sequence_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <mutex>

#include "compute/volume/parallel.h"
#include "compute/volume/volume.h"
#include "module/scene/spline_coefficients.h"

namespace palpate {
namespace {

// The most samples that are read in the search for folds; where it would be more, only the times of
// the frames are searched.
constexpr double kMostSamples = 2e7;

/// The weighted sum of a sample's summands, and its confidence.
lanes::Float4 summed(const float* summands, size_t floats, const TimeWeights& time) noexcept {
  lanes::Float4 sum{};
  for (int n = 0; n < time.count; ++n) {
    // The fourth float is the next one's, or the confidence: it is replaced below.
    lanes::Float4 term;
    std::memcpy(&term, summands + 3 * time.term[size_t(n)], sizeof term);
    sum += time.weight[size_t(n)] * term;
  }
  sum[3] = summands[floats - 1];
  return sum;
}

lanes::Quad widened(const lanes::Float4& f) noexcept {
  glm::vec4 v;
  std::memcpy(&v, &f, sizeof v);
  return lanes::load(v);
}

MotionSample sample_of(const GridPlace& place, const spline::Blend<lanes::Quad>& at) {
  const glm::dmat3 per_index(lanes::xyz(at.x), lanes::xyz(at.y), lanes::xyz(at.z));
  return {lanes::xyz(at.value), per_index * place.index_from_volume, at.value.zw[1]};
}

/// One component of a summand as spline coefficients.
std::vector<float> component(const Field& term, int axis) {
  Volume values{term.grid, std::vector<float>(term.u_mm.size())};
  for (size_t s = 0; s < values.values.size(); ++s)
    values.values[s] = float(volume_from_lps(glm::dvec3(term.u_mm[s]))[axis]);
  return spline_coefficients(std::move(values)).values;
}

bool is_fine(glm::vec3 u_mm) {
  return std::abs(u_mm.x) + std::abs(u_mm.y) + std::abs(u_mm.z) < 1e3F * kAbsurdM;
}

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
  std::vector<float> trust(grid.count(), 1.0F);
  if (confidence) trust = resampled(*confidence, grid).values;
  for (float& w : trust) w = w > 0.0F ? std::min(w, 1.0F) : 0.0F;
  // A term that is not finite makes its sample stand still at all times.
  for (size_t s = 0; s < grid.count(); ++s)
    for (const Field& term : motion.terms)
      if (!is_fine(term.u_mm[s])) trust[s] = -1.0F;
  const size_t stride = map->floats_per_sample();
  map->coefficients_.resize(grid.count() * stride);
  for (size_t n = 0; n < motion.basis.summands(); ++n) {
    Field term = motion.summand(n);
    for (size_t s = 0; s < grid.count(); ++s)
      if (trust[s] < 0.0F) term.u_mm[s] = glm::vec3(0.0F);
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<float> of_axis = component(term, axis);
      for (size_t s = 0; s < grid.count(); ++s)
        map->coefficients_[stride * s + 3 * n + size_t(axis)] = of_axis[s];
    }
  }
  for (size_t s = 0; s < grid.count(); ++s)
    map->coefficients_[stride * s + stride - 1] = std::max(trust[s], 0.0F);
  // The spline at a sample takes a share of its neighbours.
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        if (trust[grid.offset(i, j, k)] >= 0.0F) continue;
        const glm::ivec3 low = glm::max(glm::ivec3(i, j, k) - 1, 0);
        const glm::ivec3 high = glm::min(glm::ivec3(i, j, k) + 1, grid.size - 1);
        for (int c = low.z; c <= high.z; ++c)
          for (int b = low.y; b <= high.y; ++b)
            for (int a = low.x; a <= high.x; ++a)
              map->coefficients_[stride * grid.offset(a, b, c) + stride - 1] = 0.0F;
      }
  map->look_for_folds();
  return map;
}

void SequenceMap::look_for_folds() {
  const glm::ivec3 size = place_.size;
  const size_t count = size_t(size.x) * size_t(size.y) * size_t(size.z);
  const int frames = int(basis_.times_s.size());
  const int per_frame = 2.0 * frames * double(count) > kMostSamples ? 1 : 2;
  std::vector<glm::vec4> now(count);
  for (int sample = 0; sample < per_frame * frames; ++sample) {
    const TimeWeights time = basis_.at(sample / per_frame, sample % per_frame == 0 ? 0.0 : 0.5);
    size_t folded = 0, moving = 0;
    std::mutex guard;
    parallel_ranges(size.z, double(time.count) * size.x * size.y, [&](int begin, int end) {
      const size_t slice = size_t(size.x) * size_t(size.y);
      for (size_t s = slice * size_t(begin); s < slice * size_t(end); ++s) {
        const lanes::Float4 u =
            summed(coefficients_.data() + floats_per_sample() * s, floats_per_sample(), time);
        std::memcpy(&now[s], &u, sizeof u);
      }
    });
    parallel_ranges(size.z, 100.0 * size.x * size.y, [&](int begin, int end) {
      size_t folds = 0, moves = 0;
      double least = 1.0, largest = 0.0;
      for (int k = begin; k < end; ++k)
        for (int j = 0; j < size.y; ++j)
          for (int i = 0; i < size.x; ++i) {
            const spline::Around around(place_, glm::dvec3(i, j, k));
            const MotionSample at = sample_of(
                place_, spline::read<lanes::Quad>(
                            around, [&](size_t offset) { return lanes::load(now[offset]); }));
            const double determinant = glm::determinant(glm::dmat3(1.0) + at.jacobian);
            const double u_m = glm::length(at.u_m);
            least = std::min(least, determinant);
            largest = std::max(largest, u_m);
            folds += !(determinant > 0.0);
            moves += u_m > 0.01 * cell_m_;
          }
      const std::lock_guard lock(guard);
      least_determinant_ = std::min(least_determinant_, least);
      largest_u_m_ = std::max(largest_u_m_, largest);
      folded += folds;
      moving += moves;
    });
    folded_ = std::max(folded_, folded);
    moving_share_ = std::max(moving_share_, double(moving) / double(count));
  }
}

SequenceMap::Samples SequenceMap::samples(int factor) const {
  Samples samples;
  samples.place = place_;
  samples.place.index_from_volume *= double(factor);
  samples.place.offset *= double(factor);
  samples.place.size = (place_.size - 1) * factor + 1;
  const glm::ivec3 size = samples.place.size;
  const size_t row = size_t(size.x), slice = row * size_t(size.y), summands = basis_.summands();
  const size_t count = slice * size_t(size.z);
  samples.u_m.resize(summands * count);
  parallel_ranges(size.z, 100.0 * double(summands) * double(slice), [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) {
          const spline::Around around(place_, glm::dvec3(i, j, k) / double(factor));
          for (size_t n = 0; n < summands; ++n) {
            const auto at = spline::read<lanes::Quad>(around, [&](size_t offset) {
              const float* u = coefficients_.data() + floats_per_sample() * offset + 3 * n;
              return lanes::load({u[0], u[1], u[2], 0.0F});
            });
            samples.u_m[n * count + size_t(i) + row * size_t(j) + slice * size_t(k)] =
                glm::vec3(lanes::xyz(at.value));
          }
        }
  });
  return samples;
}

glm::dvec3 SequenceMap::displacement(glm::dvec3 x_m, const TimeWeights& time) const noexcept {
  return SequenceSnapshot(*this, time).displacement(x_m);
}

const SequenceSnapshot::CoefficientBlock& SequenceSnapshot::block(
    const spline::Around& around) noexcept {
  const glm::ivec3 cell(around.x.low, around.y.low, around.z.low);
  for (const int b : {newest_, 1 - newest_})
    if (blocks_[size_t(b)].known && blocks_[size_t(b)].cell == cell) {
      newest_ = b;
      return blocks_[size_t(b)];
    }
  newest_ = 1 - newest_;
  CoefficientBlock& block = blocks_[size_t(newest_)];
  block.known = true;
  block.cell = cell;
  const size_t floats = map_.floats_per_sample();
  const float* all = map_.coefficients_.data();
  for (size_t k = 0, at = 0; k < 4; ++k)
    for (size_t j = 0; j < 4; ++j)
      for (size_t i = 0; i < 4; ++i, ++at)
        block.u[at] =
            summed(all + floats * (around.x.offset[i] + around.y.offset[j] + around.z.offset[k]),
                   floats, time_);
  return block;
}

spline::Blend<lanes::Quad> SequenceSnapshot::read(glm::dvec3 x_m) noexcept {
  const spline::Around around(map_.place_, map_.place_.index(x_m));
  const CoefficientBlock& values = block(around);
  size_t at = 0;
  // spline::read goes through the 64 in this order.
  return spline::read<lanes::Quad>(around, [&](size_t) { return widened(values.u[at++]); });
}

MotionSample SequenceSnapshot::sample(glm::dvec3 x_m) noexcept {
  MotionSample at = sample_of(map_.place_, read(x_m));
  if (!before_) return at;
  const MotionSample was = before_->sample(x_m);
  const double left = 1.0 - share_;
  at.u_m = share_ * at.u_m + left * was.u_m;
  at.jacobian = share_ * at.jacobian + left * was.jacobian;
  at.confidence = share_ * at.confidence + left * was.confidence;
  return at;
}

glm::dvec3 SequenceSnapshot::displacement(glm::dvec3 x_m) noexcept {
  const glm::dvec3 u_m = lanes::xyz(read(x_m).value);
  return before_ ? share_ * u_m + (1.0 - share_) * before_->displacement(x_m) : u_m;
}

}  // namespace palpate
