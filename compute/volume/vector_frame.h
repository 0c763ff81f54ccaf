#pragma once

#include <vector>

#include "compute/volume/grid.h"

namespace palpate {

/// One frame of vectors, of a flow for example: three components per sample along the physical LPS
/// axes, in the data's own unit. Shape (nz, ny, nx).
struct VectorFrame {
  Grid grid;
  std::vector<glm::vec3> values;
};

}  // namespace palpate
