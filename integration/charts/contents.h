#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "integration/charts/canvas.h"
#include "integration/charts/color.h"
#include "integration/charts/panel.h"
#include "integration/charts/range.h"

namespace palpate::charts {

/// Draws on top of a panel.
using PanelOverlay = std::function<void(Canvas&, const Panel&)>;

/// What a panel shows: a colour for each point of space (none where there are no data), and what is
/// drawn over it. Refers to the volumes and fields it was made from: they must outlive it.
struct Content {
  std::function<std::optional<Color>(glm::dvec3 lps_mm)> color;
  std::vector<PanelOverlay> overlays;
  bool dark = true;  ///< whether letters on it must be light
};

/// True if the point lies in a voxel of the grid.
bool covers(const Grid& grid, glm::dvec3 lps_mm);

/// A frame in greys.
Content frame_content(const Volume& frame, Range window);

/// |u| in mm.
Content motion_content(const Field& field, const Grid& where, Range range_mm);

/// |u - truth| in mm, inside the mask if there is one.
Content error_content(const Field& field, const Field& truth, const Mask* mask, Range range_mm);

/// Confidence from 0 to 1.
Content confidence_content(const Confidence& confidence, const Grid& where);

/// moving(x + u(x)) - fixed(x), or moving(x) - fixed(x) without a field. Symmetric range.
Content difference_content(const Volume& fixed, const Volume& moving, const Field* field,
                           Range range);

/// The difference that difference_content shows, at one point; NaN outside the fixed frame.
double difference_at(const Volume& fixed, const Volume& moving, const Field* field,
                     glm::dvec3 lps_mm);

/// True if there is no mask or its voxel at this point counts.
bool inside(const Mask* mask, glm::dvec3 lps_mm);

/// Samples a content at the middle of every pixel of a panel; transparent where it has no data.
Bitmap rasterised(const Content& content, const Panel& panel);

}  // namespace palpate::charts
