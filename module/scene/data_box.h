#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>

#include "module/scene/frame_data.h"

namespace palpate {

/// A box in volume space (m), along axes of its own: those of the data that fill it.
struct DataBox {
  glm::dvec3 corner_m{0.0};
  glm::dmat3 axes{1.0};  ///< unit vectors
  glm::dvec3 edges_m{0.0};

  /// The place at these shares of its edges, 0 to 1.
  glm::dvec3 at(glm::dvec3 share) const noexcept { return corner_m + axes * (share * edges_m); }
  /// A corner by bits (first, second, third axis: 1 at its end).
  glm::dvec3 corner(int bits) const noexcept { return at({bits & 1, bits >> 1 & 1, bits >> 2}); }
  std::array<glm::dvec3, 8> corners() const noexcept;
};

/// The box along volume space's axes between two corners.
DataBox straight_box(glm::dvec3 low_m, glm::dvec3 high_m);

/// The box that a frame fills, out to the faces of its outermost voxels: along the axes of its
/// samples; of data without samples, and of vectors, along volume space's.
DataBox box_of(const FrameData& frame);

/// The patient's side in a direction of volume space (unit; x = L, y = S, z = A): its letters, the
/// main one first, as SP for a direction between superior and posterior.
std::string side_of(glm::dvec3 direction);

}  // namespace palpate
