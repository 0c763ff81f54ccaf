#pragma once

#include <string>
#include <vector>

#include "integration/charts/canvas.h"
#include "module/haptics/scene/scene.h"
#include "module/haptics/scene/scene_snapshot.h"
#include "module/session/slices.h"
#include "module/view/things.h"

namespace palpate::charts {

/// Slices one below the other, and what is to be read below them.
struct SlicePanel {
  OrthogonalSlices slices;
  std::vector<std::string> lines;
  std::vector<TubeColours> colours;  ///< of the tubes in the picture
};

/// The panel beside a picture of this height, px: its width, which is the edge of a slice.
int slice_edge_px(int height_px);
/// Pictures lower than this have no room for slices, px.
constexpr int kLowestWithSlices_px = 256;

/// Which frame of a sequence is shown, its time, and the rate of a cycle (a heart's rate) where the
/// times are known: a line each. Empty for a single frame.
std::vector<std::string> time_lines(const FrameTimes& times, double time_s);

/// The first volume with several frames of a scene's first `count`, as an index; -1: there is none.
int first_moving(const Scene& scene, int count = SceneSnapshot::kMostVolumes);

/// The same of the first moving volume as it is shown; "paused" where time stands still.
std::vector<std::string> time_lines(const Scene& scene, const SceneSnapshot& snapshot);

/// The panel, opaque: grey values, contours of walls in their colours, the patient's sides, a
/// crosshair at the place, a scale bar in mm. Below, as many as there is room for: the lines, bars
/// of the tubes' colours with the ends of their ranges and units, and the names of the walls.
/// Slices are enlarged to slice_edge_px() where they have fewer pixels, and made smaller where the
/// text needs room, by a quarter at most.
Bitmap draw_slices(const SlicePanel& panel, int height_px);

/// The bars of the tubes' colours alone, as wide as the panel of slices is, on a plate; empty
/// without tubes.
Bitmap draw_tube_colours(const std::vector<TubeColours>& colours, int height_px);

}  // namespace palpate::charts
