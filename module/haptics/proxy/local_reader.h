#pragma once

#include <cmath>

#include "module/haptics/mode.h"
#include "module/scene/frame_data.h"
#include "module/scene/motion_map.h"
#include "module/scene/property.h"

namespace palpate {

/// Value and gradient of a frame at the point where they were last read: the modes of a carrier
/// read at one point. Frames do not change, so it holds until another point is asked for.
class LastRead {
 public:
  const ScalarSample& at(const FrameData& frame, glm::dvec3 x) noexcept {
    if (frame_ == &frame && x_ == x) return sample_;
    frame_ = &frame;
    x_ = x;
    return sample_ = frame.scalar_and_gradient(x);
  }

 private:
  const FrameData* frame_ = nullptr;
  glm::dvec3 x_{0.0};
  ScalarSample sample_;
};

/// A mode's properties of one frame at one point. Value and gradient, which most modes want
/// together, are read together and once, by all modes that share `last`.
class PointReader {
 public:
  PointReader(const FrameData& frame, const ModeSpec& mode, glm::dvec3 x, LastRead& last)
      : frame_(frame), mode_(mode), x_(x), last_(last) {}

  double scalar() const noexcept {
    return mode_.scalar == ScalarProperty::kValue ? both().value
                                                  : noted(scalar_of(frame_, mode_.scalar, x_));
  }
  glm::dvec3 scalar_gradient() const noexcept {
    return mode_.scalar == ScalarProperty::kValue ? both().gradient
                                                  : noted(gradient_of(frame_, mode_.scalar, x_));
  }
  glm::dvec3 vector() const noexcept {
    return mode_.vector == VectorProperty::kGradient ? both().gradient
                                                     : noted(vector_of(frame_, mode_.vector, x_));
  }
  /// False if something that was read is not finite.
  bool is_finite() const noexcept { return is_finite_; }

 private:
  double noted(double v) const noexcept {
    is_finite_ = is_finite_ && std::isfinite(v);
    return v;
  }
  glm::dvec3 noted(glm::dvec3 v) const noexcept {
    is_finite_ = is_finite_ && std::isfinite(v.x + v.y + v.z);
    return v;
  }
  const ScalarSample& both() const noexcept {
    const ScalarSample& both = last_.at(frame_, x_);
    noted(both.value);
    noted(both.gradient);
    return both;
  }
  const FrameData& frame_;
  const ModeSpec& mode_;
  glm::dvec3 x_;
  LastRead& last_;
  mutable bool is_finite_ = true;
};

/// Data of one frame, as a mode sees them.
class StillReader final : public LocalData {
 public:
  StillReader(const FrameData& frame, const ModeSpec& mode, glm::dvec3 x, LastRead& last)
      : here_(frame, mode, x, last) {}
  double scalar() const noexcept override { return here_.scalar(); }
  glm::dvec3 scalar_gradient() const noexcept override { return here_.scalar_gradient(); }
  glm::dvec3 vector() const noexcept override { return here_.vector(); }
  bool is_finite() const noexcept { return here_.is_finite(); }

 private:
  PointReader here_;
};

/// Data between two frames, equations (23) to (25): the material's value in the one and in the
/// other, blended by the phase. Everything is given in the data frame's space: a gradient of the
/// next frame is pulled back as a covector (with the transpose of I + du/dx), a vector as an arrow
/// (with its inverse).
class BlendedReader final : public LocalData {
 public:
  BlendedReader(const FrameData& frame, const FrameData& next, const ModeSpec& mode, glm::dvec3 x,
                glm::dvec3 x_next, const glm::dmat3& jacobian, double phase, LastRead& last,
                LastRead& last_next)
      : here_(frame, mode, x, last),
        there_(next, mode, x_next, last_next),
        mode_(mode),
        jacobian_(jacobian),
        phase_(phase) {}

  double scalar() const noexcept override {
    return (1.0 - phase_) * here_.scalar() + phase_ * there_.scalar();
  }
  glm::dvec3 scalar_gradient() const noexcept override {
    return (1.0 - phase_) * here_.scalar_gradient() + phase_ * covector(there_.scalar_gradient());
  }
  glm::dvec3 vector() const noexcept override {
    const glm::dvec3 there = there_.vector();
    return (1.0 - phase_) * here_.vector() +
           phase_ * (mode_.vector == VectorProperty::kGradient ? covector(there) : arrow(there));
  }
  bool is_finite() const noexcept { return here_.is_finite() && there_.is_finite(); }

 private:
  glm::dvec3 covector(glm::dvec3 v) const {
    return v + v * jacobian_;
  }  // v * M is M transposed times v
  glm::dvec3 arrow(glm::dvec3 v) const {
    const glm::dmat3 step = glm::dmat3(1.0) + jacobian_;
    return glm::determinant(step) > 0.0 ? glm::inverse(step) * v : v;
  }

  PointReader here_, there_;
  const ModeSpec& mode_;
  const glm::dmat3& jacobian_;
  double phase_;
};

}  // namespace palpate
