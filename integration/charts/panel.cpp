#include "integration/charts/panel.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate::charts {
namespace {

// A view whose shorter side is under this share of the volume's longest is too thin to show
// anything.
constexpr double kSliver = 0.04;

}  // namespace

const ViewAxes& axes_of(View view) {
  // LPS: +x to the patient's left, +y to the back, +z to the head. The letters follow from the
  // vectors.
  static const std::array<ViewAxes, 3> axes = {{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, "Axial", "z", "R", "L", "A", "P"},
      {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, "Coronal", "y", "R", "L", "S", "I"},
      {{0, 1, 0}, {0, 0, -1}, {1, 0, 0}, "Sagittal", "x", "A", "P", "S", "I"},
  }};
  return axes[static_cast<size_t>(view)];
}

BoundingBox box_of(const Grid& grid) {
  BoundingBox box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 far(corner & 1, (corner >> 1) & 1, corner >> 2);
    const glm::dvec3 lps_mm = grid.lps_from_index(far * glm::dvec3(grid.size) - 0.5);
    box.low_mm = glm::min(box.low_mm, lps_mm);
    box.high_mm = glm::max(box.high_mm, lps_mm);
  }
  return box;
}

glm::dvec2 extent_on(View view, const BoundingBox& box) {
  const ViewAxes& axes = axes_of(view);
  const glm::dvec3 extent = box.extent_mm();
  return {std::abs(glm::dot(axes.right, extent)), std::abs(glm::dot(axes.down, extent))};
}

std::vector<View> views_of(const BoundingBox& box) {
  const glm::dvec3 extent = box.extent_mm();
  const double longest = std::max({extent.x, extent.y, extent.z});
  std::vector<View> views;
  View widest = View::kAxial;
  double widest_area = -1.0;
  for (const View view : kViews) {
    const glm::dvec2 size = extent_on(view, box);
    if (std::min(size.x, size.y) >= kSliver * longest) views.push_back(view);
    if (size.x * size.y > widest_area) {
      widest_area = size.x * size.y;
      widest = view;
    }
  }
  if (views.empty()) views.push_back(widest);
  return views;
}

glm::dvec3 Panel::lps_at(glm::dvec2 px) const {
  const ViewAxes& axes = axes_of(view);
  const glm::dvec2 mm = (px - corner_px - 0.5 * size_px) / px_per_mm;
  return middle_lps_mm + axes.right * mm.x + axes.down * mm.y;
}

glm::dvec2 Panel::px_at(glm::dvec3 lps_mm) const {
  return corner_px + 0.5 * size_px + px_step(lps_mm - middle_lps_mm);
}

glm::dvec2 Panel::px_step(glm::dvec3 mm) const {
  const ViewAxes& axes = axes_of(view);
  return px_per_mm * glm::dvec2(glm::dot(axes.right, mm), glm::dot(axes.down, mm));
}

std::string place_of(View view, glm::dvec3 lps_mm) {
  const ViewAxes& axes = axes_of(view);
  const double mm = glm::dot(axes.normal, lps_mm);
  const char* sign = mm < -0.05 ? "\u2212" : "";
  return fmt::format("{} = {}{:.1f} mm", axes.normal_name, sign, std::abs(mm));
}

}  // namespace palpate::charts
