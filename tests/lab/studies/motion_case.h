#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compute/motion/quality.h"
#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate::studies {

/// A pair of frames with known motion: a field, or landmarks.
struct MotionCase {
  std::string id;    ///< for files: "heart"
  std::string name;  ///< for people: "Beating heart (made), 64 x 64 x 64 voxels of 2 mm"
  Volume fixed, moving;
  std::optional<Field> truth;  ///< on the fixed grid or any other
  std::optional<Mask> mask;    ///< where the error counts, on truth's grid
  std::vector<glm::dvec3> fixed_points_lps_mm, moving_points_lps_mm;  ///< used without a truth

  double voxel_mm() const { return fixed.grid.finest_mm(); }
};

/// Two frames of the synthetic heart, of size^3 voxels, scored on its wall.
MotionCase heart_case(int size);

/// The case on a grid with half as many voxels along each axis that is finer than 1.42 times the
/// finest: the same motion, about an eighth of the work.
MotionCase halved(const MotionCase& whole);

/// The nearest value of a mask at every sample of another grid.
Mask nearest(const Mask& mask, const Grid& onto);

/// Endpoint error relative to the truth inside the mask, or target registration error at the
/// landmarks, the latter in mm only. Errors: kBadInput as endpoint_error() and
/// target_registration_error_mm().
Result<Distances> error_of(const Field& field, const MotionCase& known);

/// "115 x 157 x 129 voxels of 1.37 x 1.37 x 2.5 mm".
std::string grid_text(const Grid& grid);

}  // namespace palpate::studies
