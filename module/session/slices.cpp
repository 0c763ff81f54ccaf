#include "module/session/slices.h"

#include <algorithm>
#include <cmath>

#include "module/scene/data_box.h"
#include "module/session/moved_volume.h"

namespace palpate {
namespace {

constexpr double kUpright = 0.35;  // component of an axis that can be shown upright

/// The two axes of a picture, as radiologists turn it.
struct SliceAxes {
  int across = 0, along = 0;        ///< of the box: to the right, downwards
  double to_right = 1.0, down = 1;  ///< signs
};

SliceAxes axes_of(const DataBox& box, int normal) {
  const int a = normal == 0 ? 1 : 0, b = normal == 2 ? 1 : 2;
  const auto up = [&](int axis, int component) { return std::abs(box.axes[axis][component]); };
  // Upright is superior, or where neither axis is, anterior.
  const bool is_axial = std::max(up(a, 1), up(b, 1)) < kUpright;
  const int upright = is_axial ? 2 : 1;
  SliceAxes axes;
  axes.along = up(a, upright) > up(b, upright) ? a : b;
  axes.across = axes.along == a ? b : a;
  axes.down = box.axes[axes.along][upright] > 0.0 ? -1.0 : 1.0;
  const glm::dvec3 way = box.axes[axes.across];
  const bool is_sideways = std::abs(way.x) >= std::abs(way.z);
  axes.to_right = (is_sideways ? way.x : -way.z) < 0.0 ? -1.0 : 1.0;
  return axes;
}

}  // namespace

std::vector<glm::dvec2> contour(std::span<const float> values, int width, double iso_value) {
  std::vector<glm::dvec2> ends;
  const int height = width > 0 ? int(values.size()) / width : 0;
  // Marching squares: where the value crosses the edges of a square of four pixels. Where it
  // crosses all four, two pairs of pieces are possible, less than a pixel apart: one of them is
  // taken.
  constexpr int kEnds[4][2] = {{0, 1}, {1, 3}, {3, 2}, {2, 0}};  // corners of edges, round about
  for (int j = 0; j + 1 < height; ++j)
    for (int i = 0; i + 1 < width; ++i) {
      std::array<double, 4> v{};
      for (int c = 0; c < 4; ++c)
        v[size_t(c)] = double(values[size_t((j + c / 2) * width + i + c % 2)]) - iso_value;
      if (!std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); })) continue;
      for (const auto& [from, to] : kEnds) {
        const double a = v[size_t(from)], b = v[size_t(to)];
        if ((a > 0.0) == (b > 0.0)) continue;
        const double share = a / (a - b);
        const glm::dvec2 first(from % 2, from / 2), last(to % 2, to / 2);
        ends.push_back(glm::dvec2(i, j) + 0.5 + glm::mix(first, last, share));
      }
    }
  return ends;
}

OrthogonalSlices slices_through(const MovingVolume& volume, double time_s, glm::dvec3 place_m,
                                int edge_px, std::vector<SliceWall> walls) {
  const DataBox box = box_of(*volume.frames.front());
  const double px_m = std::max({box.edges_m.x, box.edges_m.y, box.edges_m.z}) / edge_px;
  const glm::dvec3 place =
      glm::clamp(glm::transpose(box.axes) * (place_m - box.corner_m), glm::dvec3(0.0), box.edges_m);
  OrthogonalSlices slices;
  slices.time_s = time_s;
  slices.px_mm = 1e3 * px_m;
  slices.walls = std::move(walls);
  MovedReader reader(volume, time_s);
  std::vector<std::vector<float>> distances(slices.walls.size());
  for (int n = 0; n < 3; ++n) {
    const int normal = 2 - n;
    const SliceAxes axes = axes_of(box, normal);
    Slice& slice = slices.planes[size_t(n)];
    slice.width = std::max(1, int(std::lround(box.edges_m[axes.across] / px_m)));
    slice.height = std::max(1, int(std::lround(box.edges_m[axes.along] / px_m)));
    const auto count = size_t(slice.width) * size_t(slice.height);
    slice.values.resize(count);
    for (auto& one : distances) one.resize(count);
    const glm::dvec3 right = axes.to_right * box.axes[axes.across];
    const glm::dvec3 down = axes.down * box.axes[axes.along];
    slice.sides = {side_of(-right), side_of(right), side_of(-down), side_of(down)};

    // From the corner of the picture, which is one of the box.
    const auto start = [&](int axis, double sign) { return sign > 0.0 ? 0.0 : box.edges_m[axis]; };
    glm::dvec3 corner(0.0);
    corner[normal] = place[normal];
    corner[axes.across] = start(axes.across, axes.to_right);
    corner[axes.along] = start(axes.along, axes.down);
    slice.place_px = {std::abs(place[axes.across] - corner[axes.across]) / px_m,
                      std::abs(place[axes.along] - corner[axes.along]) / px_m};
    const glm::dvec3 corner_m = box.corner_m + box.axes * corner;
    size_t v = 0;
    for (int j = 0; j < slice.height; ++j)
      for (int i = 0; i < slice.width; ++i, ++v) {
        const glm::dvec3 y = corner_m + px_m * ((i + 0.5) * right + (j + 0.5) * down);
        const glm::dvec3 x = reader.material_at(y);
        slice.values[v] = float(reader.value(x));
        for (size_t w = 0; w < slices.walls.size(); ++w)
          if (const int s = slices.walls[w].segment; s >= 0)
            distances[w][v] = float(reader.distance_mm(volume.segments[size_t(s)], x));
      }
    for (size_t w = 0; w < slices.walls.size(); ++w) {
      const SliceWall& wall = slices.walls[w];
      slice.contours_px.push_back(wall.segment >= 0
                                      ? contour(distances[w], slice.width, 0.0)
                                      : contour(slice.values, slice.width, wall.iso_value));
    }
  }
  return slices;
}

}  // namespace palpate
