#pragma once

#include <string>
#include <vector>

#include "integration/charts/canvas.h"

namespace palpate::desktop {

/// Mouse and keys, for the corner of the window: what the window itself means by them. scale:
/// pixels per unit.
charts::Raster draw_help(double scale);

/// A title with a few quiet lines below it, on a dark plate.
charts::Raster draw_note(const std::string& title, const std::vector<std::string>& lines,
                         double scale);

}  // namespace palpate::desktop
