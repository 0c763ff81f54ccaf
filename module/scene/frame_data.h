#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>

#include "compute/volume/volume.h"
#include "module/scene/grid_place.h"

namespace palpate {

/// A value and what it does nearby.
struct ScalarSample {
  double value = 0.0;
  glm::dvec3 gradient{0.0};  ///< per m
};

/// The samples of a scalar frame; empty for a frame that is not sampled.
struct ScalarSamples {
  const GridPlace* place = nullptr;
  std::span<const float> values;  ///< coefficients of its spline, shape (nz, ny, nx)
  /// Of the finite samples, which coefficients go beyond: beside a step by 31/240 of it along each
  /// axis. Lowest above highest where there are no such samples.
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -std::numeric_limits<float>::infinity();
};

/// One frame of data as functions of a place in volume space (m, y up): sampled or analytic, scalar
/// or vector. Immutable; all reads are real-time safe, any thread. Outside the data everything is
/// zero-gradient: the border value is clamped. A scalar source gives its gradient as vector(); a
/// vector source gives its magnitude as scalar().
class FrameData {
 public:
  virtual ~FrameData() = default;
  virtual bool is_vector() const noexcept = 0;
  virtual double scalar(glm::dvec3 x_m) const noexcept = 0;
  /// d scalar / dx, per m; continuous in x.
  virtual glm::dvec3 scalar_gradient(glm::dvec3 x_m) const noexcept = 0;
  /// Both at once, for what it costs to read one.
  virtual ScalarSample scalar_and_gradient(glm::dvec3 x_m) const noexcept {
    return {scalar(x_m), scalar_gradient(x_m)};
  }
  virtual glm::dvec3 vector(glm::dvec3 x_m) const noexcept = 0;
  /// Column j is d vector / dx_j, per m.
  virtual glm::dmat3 vector_jacobian(glm::dvec3 x_m) const noexcept = 0;
  /// Edge of its smallest detail (the finest spacing), m: a path through it is sampled as finely as
  /// this.
  virtual double detail_m() const noexcept = 0;
  /// Box in which there are data, m.
  virtual glm::dvec3 low_m() const noexcept = 0;
  virtual glm::dvec3 high_m() const noexcept = 0;
  /// For those that copy the data, as the renderer does.
  virtual ScalarSamples samples() const noexcept { return {}; }
};

/// A sampled scalar frame, read by a cubic B-spline (see spline.h for why, and
/// spline_coefficients.h for its coefficients): value and gradient belong together and are smooth
/// everywhere; beyond the outermost samples the last one is repeated. The volume is moved in, not
/// copied; it must have samples. Uses all cores: not for the servo thread.
std::shared_ptr<const FrameData> sampled_scalar(Volume volume);

/// A vector frame on a grid, e.g. a flow: `values` along the patient's LPS axes, one per sample,
/// shape (nz, ny, nx); given out along volume space's axes. Read by the same spline.
std::shared_ptr<const FrameData> sampled_vector(Grid grid, std::vector<glm::vec3> values);

}  // namespace palpate
