#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// Where in the values of a frame a surface is put, and how soft its edge is.
struct WallValue {
  double level = 0.0;
  double width = 0.0;
};

/// The value that parts a frame best into two groups (Otsu 1979), and how soft the edge between
/// them is taken: a quarter of the distance of their means. For data with one value only, that.
WallValue value_between_groups(const Volume& frame);

}  // namespace palpate
