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
  double closed_mm = 0.0;  ///< of a region: radius of the ball by which it was closed, or 0
  double opened_mm = 0.0;  ///< of a region: radius of the ball by which it was opened, or 0
  /// As WallQuality::ends, of the surface distance_mm = 0; of a region it is lost, too, where it is
  /// not as deep as two thirds of half_mm.
  double ends = 1.0;
};

/// half_mm below, >= 0, is half the thickness that a wall needs so that it holds a hand
/// (half_thickness_mm()). The other lengths are times wall_scale() of the frame.

/// The border of what is brighter than the iso-value (none: wall_of()'s there) in the frame
/// smoothed by a Gaussian, without its pieces and holes of less than (10 mm)^3. The Gaussian (none
/// given): the weakest of 1, 2, 3 and 4 mm with which a stroking hand meets an end of the wall at
/// no more than a tenth of the places, else the one with the fewest ends. A hand falls through a
/// wall where a notch or a gap is beside it, and where it is thinner than its spring is long. So
/// the region is closed by a ball of 1.5 half_mm (it grows by this and shrinks again). Then it is
/// opened by one of half_mm (the other way round), which leaves a body around which a ball of
/// half_mm can be moved everywhere. Where less than half of it would be left, both balls are
/// smaller. At the ends of the data there is no wall. Empty where nothing is brighter, or all. Uses
/// all cores; about a second for 2 million voxels and each Gaussian.
std::optional<DerivedWall> region_wall(const Volume& frame, double half_mm,
                                       std::optional<double> iso_value = {},
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
std::optional<DerivedWall> ridge_wall(const Volume& frame, double half_mm,
                                      std::optional<double> iso_value = {},
                                      std::optional<double> smooth_mm = {});

/// The share of the places on the surface of this value (0 to 1) that do not hold a hand: it ends
/// there (WallQuality::ends), or what is brighter behind it is not as deep as half of half_mm. Uses
/// all cores.
double thin_share(const Volume& frame, double iso_value, double half_mm);

}  // namespace palpate
