#include "tests/lab/studies/motion_case.h"

#include <algorithm>

#include <fmt/format.h>

#include "compute/volume/phantom.h"

namespace palpate::studies {
namespace {

/// Means of blocks: the image of a scanner of lower resolution, without aliasing.
Volume block_means(const Volume& volume, const Grid& onto, glm::ivec3 block) {
  Volume result{onto, std::vector<float>(onto.count())};
  const glm::ivec3 last = volume.grid.size - 1;
  for (int k = 0; k < onto.size.z; ++k) {
    for (int j = 0; j < onto.size.y; ++j) {
      for (int i = 0; i < onto.size.x; ++i) {
        double sum = 0.0;
        for (int c = 0; c < block.z; ++c)
          for (int b = 0; b < block.y; ++b)
            for (int a = 0; a < block.x; ++a) {
              const glm::ivec3 at =
                  glm::min(block * glm::ivec3(i, j, k) + glm::ivec3(a, b, c), last);
              sum += double(volume.at(at.x, at.y, at.z));
            }
        result.values[onto.offset(i, j, k)] = float(sum / (block.x * block.y * block.z));
      }
    }
  }
  return result;
}

}  // namespace

Mask nearest(const Mask& mask, const Grid& onto) {
  Mask result{onto, std::vector<uint8_t>(onto.count())};
  for (int k = 0; k < onto.size.z; ++k) {
    for (int j = 0; j < onto.size.y; ++j) {
      for (int i = 0; i < onto.size.x; ++i) {
        const glm::dvec3 index = mask.grid.index_from_lps(onto.lps_from_index({i, j, k}));
        const glm::ivec3 at =
            glm::clamp(glm::ivec3(glm::round(index)), glm::ivec3(0), mask.grid.size - 1);
        result.values[onto.offset(i, j, k)] = mask.values[mask.grid.offset(at.x, at.y, at.z)];
      }
    }
  }
  return result;
}

std::string grid_text(const Grid& grid) {
  const glm::dvec3 mm = grid.spacing_mm;
  const bool cubes = std::abs(mm.x - mm.y) < 1e-6 && std::abs(mm.x - mm.z) < 1e-6;
  return fmt::format("{} x {} x {} voxels of {}", grid.size.x, grid.size.y, grid.size.z,
                     cubes ? fmt::format("{:.3g} mm", mm.x)
                           : fmt::format("{:.3g} x {:.3g} x {:.3g} mm", mm.x, mm.y, mm.z));
}

MotionCase heart_case(int size) {
  Sequence heart = shell_phantom(size);
  const Grid grid = heart.frames[0].grid;
  MotionCase result;
  result.id = "heart";
  result.name = "Beating heart (made), " + grid_text(grid);
  result.fixed = std::move(heart.frames[0]);
  result.moving = std::move(heart.frames[1]);
  result.truth = shell_truth(grid, 0, 1);
  result.mask = shell_mask(grid, 0);
  return result;
}

MotionCase halved(const MotionCase& whole) {
  const Grid& grid = whole.fixed.grid;
  glm::ivec3 block(1);
  for (int a = 0; a < 3; ++a)
    if (grid.spacing_mm[a] <= 1.42 * grid.finest_mm()) block[a] = 2;
  const Grid coarse = coarsened(grid, block);
  MotionCase result = whole;
  result.fixed = block_means(whole.fixed, coarse, block);
  // The moving frame may be at another place: it keeps that of its own grid.
  result.moving = block_means(whole.moving, coarsened(whole.moving.grid, block), block);
  if (whole.truth) {
    result.truth = resampled(*whole.truth, coarse);
    if (whole.mask) result.mask = nearest(*whole.mask, coarse);
  }
  return result;
}

Result<Distances> error_of(const Field& field, const MotionCase& known) {
  if (known.truth) return endpoint_error(field, *known.truth, known.mask ? &*known.mask : nullptr);
  const auto mm =
      target_registration_error_mm(field, known.fixed_points_lps_mm, known.moving_points_lps_mm);
  if (!mm) return mm.error();
  return Distances{*mm, {}, {}};
}

}  // namespace palpate::studies
