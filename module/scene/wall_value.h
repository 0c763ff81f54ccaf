#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// The iso-value of a surface in a frame, and how soft its edge is.
struct WallValue {
  double iso_value = 0.0;
  double width = 0.0;
};

/// The value that parts a frame best into two groups (Otsu 1979), and how soft the edge between
/// them is taken: a quarter of the distance of their means. For data with one value only, that.
WallValue value_between_groups(const Volume& frame);

/// The same of the values below `below` only: the next surface around what is brighter.
WallValue value_between_groups(const Volume& frame, double below);

/// What a surface of equal value is as a wall.
struct WallQuality {
  WallValue at;
  /// Mean slope of the values where the surface is, per mm.
  double slope_per_mm = 0.0;
  /// The share of the places on it (0 to 1) from which a hand that moves `aside_mm` aside loses it:
  /// the surface ends there, or has a hole.
  double ends = 1.0;
  double aside_mm = 5.0;
};

/// The lengths that make a wall for a hand (how far it strokes, what it does not care for) are
/// meant for data of 100 mm and more. Of smaller ones, which are shown larger, they are this share,
/// longest edge / 100 mm. At most 1.
double wall_scale(const Grid& grid);

/// Looks at a surface of equal value where the values rise above it, 5 mm times wall_scale() aside.
/// deeper: it is lost, too, where the values behind it do not rise to iso_value + deeper, >= 0.
/// Reads the frame once, and along some thousand lines. Any thread.
WallQuality wall_quality(const Volume& frame, WallValue at, double deeper = 0.0);

/// The surface to feel in a frame: Otsu's, if hardly any other between the two main groups of
/// values ends more seldom; else, of those that do, the one where the values are steepest.
WallQuality wall_of(const Volume& frame);

/// A surface of equal value that ends at more than this share of its places is no closed wall: real
/// CT, PET and teeth have 3 to 15 %, MR and ultrasound 33 to 38 %, and hardly less at any other
/// value.
constexpr double kClosedWall = 0.25;

}  // namespace palpate
