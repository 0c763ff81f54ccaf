#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "integration/charts/canvas.h"

namespace palpate::desktop {

/// Mouse and keys, for the corner of the window: what the window itself means by them. scale:
/// pixels per unit. probe: the mouse moves a probe; otherwise every button turns the view. hand:
/// there is something to feel.
charts::Raster draw_help(double scale, bool probe = true, bool hand = true);

/// Where help and force plot stand in a window, px from its top left corner: in the lower corners,
/// or, where the window is too narrow for both, the help above the plot. Too low for that, the help
/// hides the plot: H brings it back.
struct Corners {
  glm::ivec2 help{0}, plot{0};
  bool shows_plot = true;
};
/// top: what is taken at the window's top, edge included. All sizes in pixels.
Corners place_corners(glm::ivec2 window, glm::ivec2 help, glm::ivec2 plot, int top, int edge);

/// A title with a few quiet lines below it, on a dark plate.
charts::Raster draw_note(const std::string& title, const std::vector<std::string>& lines,
                         double scale);

}  // namespace palpate::desktop
