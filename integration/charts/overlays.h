#pragma once

#include "integration/charts/contents.h"

namespace palpate::charts {

/// By how much arrows are drawn longer or shorter than the motion, so that the longest common ones
/// just clear each other: a round number, 1 where that fits.
double arrow_stretch(double long_motion_mm, double px_per_mm);

struct ArrowLook {
  Range range_mm;               ///< of the colours
  double stretch = 1.0;         ///< as from arrow_stretch()
  const Mask* mask = nullptr;   ///< no arrow starts outside of it
  const Grid* where = nullptr;  ///< nor outside of this grid
};

/// Arrows from x to x + stretch u(x), in-plane part, coloured by the whole length of u; a dot where
/// the motion goes through the plane. The field must outlive the overlay.
PanelOverlay arrows(const Field& field, ArrowLook look);

/// A square lattice carried by the field, x to x + u(x), in-plane part; red dots where det(1 +
/// du/dx) <= 0 in 3-D. are filled red.
PanelOverlay carried_lattice(const Field& field, const Grid& where, Color color);

/// R, L, A, P, S, I at the edges.
PanelOverlay orientation_letters(bool light);

/// A bar of a round length with its label, in a lower corner.
PanelOverlay scale_bar(bool light);

}  // namespace palpate::charts
