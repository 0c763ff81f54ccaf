#include "integration/charts/overlays.h"

#include <algorithm>
#include <cmath>

namespace palpate::charts {
namespace {

constexpr double kArrowSpacingPx = 19.0;
constexpr double kLatticeSpacingPx = 15.0;
constexpr double kShortestArrowPx = 3.0;  // less motion is not drawn, less in the plane is a dot
constexpr double kFoldStepPx = 3.0;
constexpr Color kFoldColor{0.86, 0.10, 0.12};

// Points of a square lattice on the page, symmetric about the middle of the panel.
std::vector<double> lattice(double corner_px, double size_px, double spacing_px) {
  std::vector<double> positions;
  const int half = int(0.5 * size_px / spacing_px);
  for (int n = -half; n <= half; ++n) {
    positions.push_back(corner_px + 0.5 * size_px + n * spacing_px);
  }
  return positions;
}

void draw_arrow(Canvas& canvas, glm::dvec2 from, glm::dvec2 step, Color color) {
  const double length = glm::length(step);
  const glm::dvec2 along = step / length;
  const glm::dvec2 across(-along.y, along.x);
  const double head = std::min(6.5, 0.6 * length + 1.2);
  const glm::dvec2 tip = from + step;
  const glm::dvec2 neck = tip - along * head;
  const std::vector<glm::dvec2> head_shape = {tip, neck + across * (0.45 * head),
                                              neck + along * (0.22 * head),
                                              neck - across * (0.45 * head)};
  const std::vector<glm::dvec2> shaft = {from, neck + along * (0.22 * head)};
  // The dark edge keeps yellow arrows readable on bright tissue.
  canvas.draw_line(shaft, {0, 0, 0}, 3.2, 0.35);
  std::vector<glm::dvec2> edge = head_shape;
  edge.push_back(tip);
  canvas.draw_line(edge, {0, 0, 0}, 1.8, 0.35);
  canvas.draw_line(shaft, color, 1.7);
  canvas.fill_polygon(head_shape, color);
}

// det(1 + du/dx) at a point, from steps so short that they stay in one cell of the trilinear field.
double determinant_at(const Field& field, glm::dvec3 lps_mm) {
  const double step_mm = 1e-3 * field.grid.finest_mm();
  glm::dmat3 jacobian(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 step(0.0);
    step[axis] = step_mm;
    jacobian[axis] += (sample_at_lps(field, lps_mm + step) - sample_at_lps(field, lps_mm - step)) /
                      (2.0 * step_mm);
  }
  return glm::determinant(jacobian);
}

void draw_folds(Canvas& canvas, const Panel& panel, const Field& field, const Grid& where) {
  for (double y = 0.5 * kFoldStepPx; y < panel.size_px.y; y += kFoldStepPx) {
    for (double x = 0.5 * kFoldStepPx; x < panel.size_px.x; x += kFoldStepPx) {
      const glm::dvec2 px = panel.corner_px + glm::dvec2(x, y);
      const glm::dvec3 lps_mm = panel.lps_at(px);
      if (!covers(where, lps_mm) || determinant_at(field, lps_mm) > 0.0) continue;
      canvas.fill_dot(px + panel.px_step(sample_at_lps(field, lps_mm)), 2.4, kFoldColor);
    }
  }
}

}  // namespace

double arrow_stretch(double long_motion_mm, double px_per_mm) {
  if (!(long_motion_mm > 1e-9)) return 1.0;
  const double fitting = 1.7 * kArrowSpacingPx / (long_motion_mm * px_per_mm);
  if (fitting >= 0.8 && fitting < 2.0) return 1.0;
  return round_down_125(fitting);
}

PanelOverlay arrows(const Field& field, ArrowLook look) {
  return [&field, look](Canvas& canvas, const Panel& panel) {
    for (const double y : lattice(panel.corner_px.y, panel.size_px.y, kArrowSpacingPx)) {
      for (const double x : lattice(panel.corner_px.x, panel.size_px.x, kArrowSpacingPx)) {
        const glm::dvec3 lps_mm = panel.lps_at({x, y});
        if (look.where && !covers(*look.where, lps_mm)) continue;
        if (!inside(look.mask, lps_mm)) continue;
        const glm::dvec3 u_mm = sample_at_lps(field, lps_mm);
        const double whole_px = glm::length(u_mm) * panel.px_per_mm * look.stretch;
        if (!(whole_px >= kShortestArrowPx) || !std::isfinite(whole_px)) continue;
        const double t = look.range_mm.fraction(glm::length(u_mm));
        const Color color = color_at(ColorMap::kMotion, t);
        const glm::dvec2 step = look.stretch * panel.px_step(u_mm);
        if (glm::length(step) >= kShortestArrowPx) {
          draw_arrow(canvas, {x, y}, step, color);
        } else {
          canvas.fill_dot({x, y}, 2.2, {0, 0, 0}, 0.3);
          canvas.fill_dot({x, y}, 1.6, color);
        }
      }
    }
  };
}

PanelOverlay carried_lattice(const Field& field, const Grid& where, Color color) {
  return [&field, where, color](Canvas& canvas, const Panel& panel) {
    const auto xs = lattice(panel.corner_px.x, panel.size_px.x, kLatticeSpacingPx);
    const auto ys = lattice(panel.corner_px.y, panel.size_px.y, kLatticeSpacingPx);
    const auto carried = [&](double x, double y) {
      return glm::dvec2(x, y) + panel.px_step(sample_at_lps(field, panel.lps_at({x, y})));
    };
    const auto shown = [&](double x, double y) { return covers(where, panel.lps_at({x, y})); };
    draw_folds(canvas, panel, field, where);
    // Lines are followed at a third of the lattice, so that they bend smoothly.
    const auto draw = [&](double fixed_px, double low, double high, bool upright) {
      std::vector<glm::dvec2> line;
      for (double s = low; s <= high; s += kLatticeSpacingPx / 3.0) {
        const double x = upright ? fixed_px : s;
        const double y = upright ? s : fixed_px;
        if (shown(x, y)) line.push_back(carried(x, y));
      }
      if (line.size() > 1) canvas.draw_line(line, color, 0.9, 0.8);
    };
    const glm::dvec2 far = panel.corner_px + panel.size_px;
    for (const double x : xs) draw(x, panel.corner_px.y, far.y, true);
    for (const double y : ys) draw(y, panel.corner_px.x, far.x, false);
  };
}

PanelOverlay orientation_letters(bool light) {
  return [light](Canvas& canvas, const Panel& panel) {
    const ViewAxes& axes = axes_of(panel.view);
    TextStyle style{14.0,           true, light ? Color{1, 1, 1} : Color{0.35, 0.38, 0.43},
                    Align::kCentre, 1e9,  light};
    const glm::dvec2 middle = panel.corner_px + 0.5 * panel.size_px;
    const glm::dvec2 far = panel.corner_px + panel.size_px;
    canvas.draw_text(axes.left_letter, {panel.corner_px.x + 13.0, middle.y + 5.0}, style);
    canvas.draw_text(axes.right_letter, {far.x - 13.0, middle.y + 5.0}, style);
    canvas.draw_text(axes.top_letter, {middle.x, panel.corner_px.y + 19.0}, style);
    canvas.draw_text(axes.bottom_letter, {middle.x, far.y - 9.0}, style);
  };
}

PanelOverlay scale_bar(bool light) {
  return [light](Canvas& canvas, const Panel& panel) {
    const double length_mm = round_down_125(0.34 * panel.size_px.x / panel.px_per_mm);
    const double length_px = length_mm * panel.px_per_mm;
    const glm::dvec2 from(panel.corner_px.x + 14.0, panel.corner_px.y + panel.size_px.y - 13.0);
    const glm::dvec2 to(from.x + length_px, from.y);
    const Color color = light ? Color{1, 1, 1} : Color{0.35, 0.38, 0.43};
    if (light) canvas.draw_line({from, to}, {0, 0, 0}, 5.0, 0.5);
    canvas.draw_line({from, to}, color, 2.5);
    TextStyle style{13.0, false, color, Align::kLeft, 1e9, light};
    canvas.draw_text(number(length_mm) + " mm", {from.x, from.y - 7.0}, style);
  };
}

}  // namespace palpate::charts
