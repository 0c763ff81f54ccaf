#pragma once

#include <optional>

#include "compute/volume/volume.h"
#include "module/scene/wall_value.h"

namespace palpate {

/// A wall derived from the values of a frame, for data whose iso-surface is no closed wall: a
/// smooth signed distance to it, mm, above 0 inside, which is felt like a segment.
struct DerivedWall {
  Volume distance_mm;
  double iso_value = 0.0;
  double smooth_mm = 0.0;  ///< standard deviation of the Gaussian before it
  double ends = 1.0;       ///< as WallQuality::ends, of the surface distance_mm = 0
};

/// All lengths below are times wall_scale() of the frame.

/// The border of what is brighter than the iso-value (none: wall_of()'s there) in the frame
/// smoothed by a Gaussian (none: the weakest of 1, 2, 3 and 4 mm with which a stroking hand meets
/// an end of the wall at no more than a tenth of the places, else the one with the fewest ends),
/// without its pieces and holes of less than (10 mm)^3. At the ends of the data there is no wall.
/// Bright things thinner than about twice the Gaussian are lost. Empty where nothing is brighter,
/// or all. Uses all cores; about a second for 2 million voxels and each Gaussian.
std::optional<DerivedWall> region_wall(const Volume& frame, std::optional<double> iso_value = {},
                                       std::optional<double> smooth_mm = {});

/// Where the values v rise most steeply, whatever they are there. At a blurred step, v = erf(x /
/// (sqrt(2) s)), the distance to the steepest place is -s^2 v'' / v': here n the direction of the
/// gradient,
///   d = -s^2 (n . H n) / |grad v|,   s^2 = smooth^2 + (finest voxel edge)^2,
/// joined to a closed surface by the f that makes the sum over voxels of
///   w (f - d)^2 + w0 (f - c)^2 + (1 mm)^2 |grad f|^2
/// least: w is the gradient's square over its 90 % quantile, at most 1, and 0 where |d| > 3 mm;
/// c = +-3 mm says which side of the iso-value (none: wall_of()'s there) the value is on, w0 =
/// 0.003. The Gaussian before it (none) as for region_wall(). Empty where all values are equal.
/// Uses all cores.
std::optional<DerivedWall> ridge_wall(const Volume& frame, std::optional<double> iso_value = {},
                                      std::optional<double> smooth_mm = {});

}  // namespace palpate
