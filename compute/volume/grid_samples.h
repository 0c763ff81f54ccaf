#pragma once

#include "compute/volume/grid.h"
#include "compute/volume/parallel.h"

namespace palpate {

/// Calls set(offset, lps_mm) for every sample of a grid, on all cores. cost: of one call, in
/// elementary steps. set must not throw.
template <class Set>
void for_each_sample(const Grid& grid, double cost, const Set& set) {
  parallel_ranges(grid.size.z, cost * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      for (int j = 0; j < grid.size.y; ++j) {
        for (int i = 0; i < grid.size.x; ++i) {
          set(grid.offset(i, j, k), grid.lps_from_index(glm::dvec3(i, j, k)));
        }
      }
    }
  });
}

}  // namespace palpate
