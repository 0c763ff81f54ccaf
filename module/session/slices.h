#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "module/scene/moving_volume.h"

namespace palpate {

/// A wall that slices show as a contour: a segment, or a surface of equal value.
struct SliceWall {
  std::string name;
  glm::vec3 colour{1.0F};  ///< red, green, blue, sRGB, 0 to 1
  double iso_value = 0.0;  ///< of a surface of equal value
  int segment = -1;        ///< index of the volume's segment; -1: a surface of equal value
};

/// A picture of a plane through a volume, along two of the data's own axes. It lies as radiologists
/// expect it: superior above, in planes across the body anterior above; the patient's left, or
/// posterior, is on the right.
struct Slice {
  int width = 0, height = 0;         ///< px
  std::vector<float> values;         ///< at the centres of pixels, row by row from the top
  glm::dvec2 place_px{0.0};          ///< of the place that the slices go through
  std::array<std::string, 4> sides;  ///< the patient's at the left, right, upper and lower edge
  /// Contours of each wall: ends of straight pieces, two for each, px from the upper left corner.
  std::vector<std::vector<glm::dvec2>> contours_px;
};

/// Three slices through a place of a volume at one time, across its third, second and first axis.
struct OrthogonalSlices {
  std::array<Slice, 3> planes;
  double time_s = 0.0;              ///< of the sequence
  double px_mm = 1.0;               ///< edge of a pixel, in the data
  double black = 0.0, white = 1.0;  ///< values
  std::vector<SliceWall> walls;     ///< in the order of Slice::contours_px
};

/// Samples the planes as the volume is felt at this time of the sequence (MovedReader). The longest
/// edge of the data has edge_px pixels, and all planes the same scale; a place outside is moved to
/// the nearest inside. black and white are left to the caller. Uses one core: 130 to 280 ms for
/// 65,000 pixels of a beating heart while pictures and the estimation shared two cores. Any thread
/// but the servo thread.
OrthogonalSlices slices_through(const MovingVolume& volume, double time_s, glm::dvec3 place_m,
                                int edge_px, std::vector<SliceWall> walls);

/// The straight pieces of the line on which a picture has this value, px: two ends for each. values
/// are at the centres of pixels, row by row; what is not finite has no line beside it.
std::vector<glm::dvec2> contour(std::span<const float> values, int width, double iso_value);

}  // namespace palpate
