#pragma once

#include "module/scene/frame_data.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// Properties of a frame of data that a mode can read as its scalar or its vector. Of a scalar
/// frame the vector is the gradient, so that its magnitude is the gradient's, its divergence the
/// Laplacian and its curl zero but for rounding; of a vector frame the value is the magnitude. All
/// points in volume space, m. Real-time safe, any thread.

/// The property at x, in the data's unit; divergence, curl and gradient magnitude per m.
double scalar_of(const FrameData& data, ScalarProperty property, glm::dvec3 x_m) noexcept;

/// d property / dx, per m. In closed form for the value and the magnitude, and for the gradient
/// magnitude of scalar data; otherwise by central differences with a step of half the data's
/// detail_m() to either side, which smooths over one voxel.
glm::dvec3 gradient_of(const FrameData& data, ScalarProperty property, glm::dvec3 x_m) noexcept;

/// The vector at x, along volume space's axes.
glm::dvec3 vector_of(const FrameData& data, VectorProperty property, glm::dvec3 x_m) noexcept;

}  // namespace palpate
