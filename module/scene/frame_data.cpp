#include "module/scene/frame_data.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "module/scene/lanes.h"
#include "module/scene/spline.h"
#include "module/scene/spline_coefficients.h"

namespace palpate {
namespace {

using lanes::Quad;

/// What sampled scalars and vectors have in common: where they are.
class OnGrid : public FrameData {
 public:
  explicit OnGrid(const Grid& grid) : place_(grid), detail_m_(1e-3 * grid.finest_mm()) {
    low_ = glm::dvec3(std::numeric_limits<double>::infinity());
    high_ = -low_;
    for (int c = 0; c < 8; ++c) {
      const glm::dvec3 end(c & 1, c >> 1 & 1, c >> 2);
      const glm::dvec3 x = volume_from_lps(grid.lps_from_index(end * glm::dvec3(grid.size) - 0.5));
      low_ = glm::min(low_, x);
      high_ = glm::max(high_, x);
    }
  }
  double detail_m() const noexcept final { return detail_m_; }
  glm::dvec3 low_m() const noexcept final { return low_; }
  glm::dvec3 high_m() const noexcept final { return high_; }

 protected:
  const GridPlace place_;

 private:
  double detail_m_;
  glm::dvec3 low_, high_;
};

class SampledScalar final : public OnGrid {
 public:
  explicit SampledScalar(Volume samples) : OnGrid(samples.grid) {
    for (const float value : samples.values) {
      if (!std::isfinite(value)) continue;
      read_.lowest = std::min(read_.lowest, value);
      read_.highest = std::max(read_.highest, value);
    }
    values_ = spline_coefficients(std::move(samples)).values;
    read_.place = &place_;
    read_.values = values_;
  }

  bool is_vector() const noexcept override { return false; }
  ScalarSamples samples() const noexcept override { return read_; }
  double scalar(glm::dvec3 x_m) const noexcept override { return read(x_m).value; }
  glm::dvec3 scalar_gradient(glm::dvec3 x_m) const noexcept override {
    return scalar_and_gradient(x_m).gradient;
  }
  ScalarSample scalar_and_gradient(glm::dvec3 x_m) const noexcept override {
    const auto at = read(x_m);
    return {at.value, place_.gradient({at.x, at.y, at.z})};
  }
  glm::dvec3 vector(glm::dvec3 x_m) const noexcept override { return scalar_gradient(x_m); }
  glm::dmat3 vector_jacobian(glm::dvec3 x_m) const noexcept override {
    const double step = 0.5 * detail_m();
    glm::dmat3 jacobian;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 aside(0.0);
      aside[a] = step;
      jacobian[a] = (scalar_gradient(x_m + aside) - scalar_gradient(x_m - aside)) / (2.0 * step);
    }
    return jacobian;
  }

 private:
  spline::Blend<double> read(glm::dvec3 x_m) const noexcept {
    return spline::read(spline::Around(place_, place_.index(x_m)), values_.data());
  }
  std::vector<float> values_;
  ScalarSamples read_;
};

class SampledVector final : public OnGrid {
 public:
  SampledVector(const Grid& grid, const std::vector<glm::vec3>& lps) : OnGrid(grid) {
    values_.reserve(lps.size());
    // The axes turn as those of volume space do; the data keep their unit.
    for (const glm::vec3& v : lps) values_.emplace_back(v.x, v.z, -v.y, 0.0F);
  }

  bool is_vector() const noexcept override { return true; }
  double scalar(glm::dvec3 x_m) const noexcept override { return glm::length(vector(x_m)); }
  glm::dvec3 scalar_gradient(glm::dvec3 x_m) const noexcept override {
    return scalar_and_gradient(x_m).gradient;
  }
  ScalarSample scalar_and_gradient(glm::dvec3 x_m) const noexcept override {
    const auto at = read(x_m);
    const glm::dvec3 v = lanes::xyz(at.value);
    const double length = glm::length(v);
    return {length, length > 0.0 ? (v / length) * jacobian_of(at) : glm::dvec3(0.0)};
  }
  glm::dvec3 vector(glm::dvec3 x_m) const noexcept override { return lanes::xyz(read(x_m).value); }
  glm::dmat3 vector_jacobian(glm::dvec3 x_m) const noexcept override {
    return jacobian_of(read(x_m));
  }

 private:
  spline::Blend<Quad> read(glm::dvec3 x_m) const noexcept {
    const spline::Around around(place_, place_.index(x_m));
    return spline::read<Quad>(around, [this](size_t at) { return lanes::load(values_[at]); });
  }
  glm::dmat3 jacobian_of(const spline::Blend<Quad>& at) const noexcept {
    const glm::dmat3 per_index(lanes::xyz(at.x), lanes::xyz(at.y), lanes::xyz(at.z));
    return per_index * place_.index_from_volume;
  }
  std::vector<glm::vec4> values_;
};

}  // namespace

std::shared_ptr<const FrameData> sampled_scalar(Volume volume) {
  assert(volume.values.size() == volume.grid.count() && volume.grid.count() > 0);
  return std::make_shared<SampledScalar>(std::move(volume));
}

std::shared_ptr<const FrameData> sampled_vector(Grid grid, std::vector<glm::vec3> values) {
  assert(values.size() == grid.count() && grid.count() > 0);
  return std::make_shared<SampledVector>(grid, values);
}

}  // namespace palpate
