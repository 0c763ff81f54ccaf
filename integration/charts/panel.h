#pragma once

#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "compute/volume/grid.h"
#include "integration/charts/canvas.h"

namespace palpate::charts {

/// The three planes of the patient, drawn the way radiologists hang them: axial as seen from the
/// feet, coronal as seen from the front, sagittal with the front to the left.
enum class View { kAxial, kCoronal, kSagittal };

inline constexpr View kViews[] = {View::kAxial, View::kCoronal, View::kSagittal};

/// How a view's plane lies in LPS: unit vectors to the right and down on the page, and out of the
/// plane.
struct ViewAxes {
  glm::dvec3 right;
  glm::dvec3 down;
  glm::dvec3 normal;
  const char* name;         ///< "Axial"
  const char* normal_name;  ///< the LPS coordinate that is constant on the plane, "z"
  const char* left_letter;
  const char* right_letter;
  const char* top_letter;
  const char* bottom_letter;
};

const ViewAxes& axes_of(View view);

/// The smallest box along LPS that holds a grid with all of its voxels.
struct BoundingBox {
  glm::dvec3 low_mm;
  glm::dvec3 high_mm;

  glm::dvec3 extent_mm() const { return high_mm - low_mm; }
  glm::dvec3 centre_mm() const { return 0.5 * (low_mm + high_mm); }
};

BoundingBox box_of(const Grid& grid);

/// The extent in mm of a box on a view: across and down.
glm::dvec2 extent_on(View view, const BoundingBox& box);

/// The views on which a box is more than a sliver: three for a volume, one for a single slice.
std::vector<View> views_of(const BoundingBox& box);

/// A plane of the patient on the page. Oblique volumes are cut along LPS all the same, so that
/// letters, lengths and angles on the page are true.
struct Panel {
  View view = View::kAxial;
  glm::dvec2 corner_px{0.0};
  glm::dvec2 size_px{0.0};
  double px_per_mm = 1.0;
  glm::dvec3 middle_lps_mm{0.0};  ///< the point of the plane that is at the middle of the panel

  glm::dvec3 lps_at(glm::dvec2 px) const;
  glm::dvec2 px_at(glm::dvec3 lps_mm) const;
  /// A displacement in mm as a step on the page, through-plane part dropped.
  glm::dvec2 px_step(glm::dvec3 mm) const;
};

/// "y = 12.0 mm": where the plane of a view through this point lies.
std::string place_of(View view, glm::dvec3 lps_mm);

}  // namespace palpate::charts
