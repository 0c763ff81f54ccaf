#pragma once

#include <string>

#include "integration/charts/canvas.h"
#include "module/scene/playback.h"
#include "module/session/segment_sizes.h"

namespace palpate::charts {

/// Pictures and windows narrower than this have no bar of frames, px at a scale of 1.
inline constexpr int kNarrowestWithBar_px = 256;

/// A sequence and the time that is shown.
struct FrameBar {
  FrameTimes times;
  double time_s = 0.0;
  std::string text;  ///< above the bar; may be empty
};

/// Its height, px. scale: pixels per unit.
int frame_bar_height_px(const FrameBar& bar, double scale);
/// The whole sequence from the left to the right, with a mark at each frame (where there is room)
/// and one at the time that is shown, on a dark plate.
Bitmap draw_frame_bar(const FrameBar& bar, int width_px, double scale);
/// The share of the sequence, 0 to 1, at x_px from the left edge of such a bar; beyond the ends
/// theirs.
double frame_bar_share(double x_px, int width_px, double scale);

/// Whether something is known at two frames or more.
bool has_sizes(const SegmentSizes& sizes);
/// The volume of the cavity (ml) and the thickness of its wall (mm) over a sequence; where no
/// segment encloses another one, the volumes of the first three. In the segments' colours, with the
/// numbers at the time that is shown and a mark there, on a dark plate; along the same axis as a
/// bar of frames of this width.
Bitmap draw_sizes(const SegmentSizes& sizes, const FrameTimes& times, double time_s,
                  glm::ivec2 size_px, double scale);

}  // namespace palpate::charts
