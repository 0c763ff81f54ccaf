#pragma once

#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/canvas.h"
#include "integration/charts/timeline.h"

namespace palpate::charts {

/// A view for two eyes. Rasters of one size.
struct StereoView {
  Bitmap left, right;
  std::string label;     ///< "phase 1.25"
  std::string sublabel;  ///< "2.1 N"
};

/// What was seen and felt, on one page: stereo views side by side (to be looked at with crossed
/// eyes: the right eye's picture is on the left), and curves over time below.
struct FeltPage {
  std::string title, subtitle;
  std::vector<StereoView> views;
  Timeline timeline;  ///< its title and subtitle are not shown
};

/// Writes the page as PNG, whole or not at all. Errors as write_timeline's.
Status write_felt_page(const std::string& path, const FeltPage& page);

}  // namespace palpate::charts
