#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "integration/charts/canvas.h"

namespace palpate::desktop {

/// Mouse and keys, for the corner of the window: what they do in the window. scale: pixels per
/// unit. probe: the mouse moves a probe; otherwise every button turns the view. hand: there is
/// something to feel.
charts::Bitmap draw_help(double scale, bool probe = true, bool hand = true);

/// Where help and force plot stand in a window, px from its top left corner: in the lower corners,
/// or, where the window is too narrow for both, the help above the plot. Too low for that, the help
/// hides the plot: H brings it back.
struct OverlayCorners {
  glm::ivec2 help{0}, plot{0};
  bool shows_plot = true;
};
/// top: the height that is used at the window's top, its edge included. All sizes in pixels.
OverlayCorners place_corners(glm::ivec2 window, glm::ivec2 help, glm::ivec2 plot, int top,
                             int edge);

/// A title with a few quiet lines below it, on a dark plate.
charts::Bitmap draw_note(const std::string& title, const std::vector<std::string>& lines,
                         double scale);

}  // namespace palpate::desktop
