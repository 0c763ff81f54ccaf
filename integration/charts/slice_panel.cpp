#include "integration/charts/slice_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integration/charts/range.h"

namespace palpate::charts {
namespace {

constexpr Color kGround{0.055, 0.065, 0.085}, kSliceInk{0.93, 0.95, 0.97}, kFaint{0.62, 0.67, 0.74};
constexpr Color kCross{0.30, 0.78, 0.98};
constexpr double kEdgeShare = 0.28;     // of the panel's height: three slices and their text
constexpr double kSliceGap = 4.0;       // between slices, at a height of kUsualHeight
constexpr double kUsualHeight = 768.0;  // at which sizes below are pixels
constexpr double kLeastScale = 0.7;     // of text that can be read
constexpr double kSliceLine = 17.0, kSwatch = 10.0, kLongestBar = 0.4;
constexpr double kSlicePad = 6.0, kColourBar = 9.0;
constexpr double kColourLines = 2.3;     // that a bar of colours takes: its name, then the bar
constexpr double kSmallestSlice = 0.75;  // of the usual edge

/// The slice as a raster of this size, values read linearly between the centres of its pixels.
Bitmap raster_of(const Slice& slice, const OrthogonalSlices& all, glm::ivec2 size) {
  Bitmap raster{size.x, size.y, {}};
  raster.pixels.reserve(size_t(size.x) * size_t(size.y));
  const auto at = [&](int i, int j) {
    return double(slice.values[size_t(std::clamp(j, 0, slice.height - 1)) * size_t(slice.width) +
                               size_t(std::clamp(i, 0, slice.width - 1))]);
  };
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x) {
      const double u = (x + 0.5) * slice.width / size.x - 0.5;
      const double v = (y + 0.5) * slice.height / size.y - 0.5;
      const int i = int(std::floor(u)), j = int(std::floor(v));
      const double value = glm::mix(glm::mix(at(i, j), at(i + 1, j), u - i),
                                    glm::mix(at(i, j + 1), at(i + 1, j + 1), u - i), v - j);
      const double share = std::clamp((value - all.black) / (all.white - all.black), 0.0, 1.0);
      const auto grey = uint32_t(std::lround(255.0 * (std::isfinite(share) ? share : 0.0)));
      raster.pixels.push_back(0xff000000U | grey << 16 | grey << 8 | grey);
    }
  return raster;
}

/// The longest of 1, 2, 5, 10, 20 ... mm that is not longer than this.
double readable_mm(double most_mm) {
  const double ten = std::pow(10.0, std::floor(std::log10(most_mm)));
  for (const double step : {5.0, 2.0})
    if (step * ten <= most_mm) return step * ten;
  return ten;
}

/// One slice in its square tile.
void draw_slice(Canvas& canvas, const Slice& slice, const OrthogonalSlices& all, glm::dvec2 corner,
                int edge_px, double scale, bool has_bar) {
  const double zoom = double(edge_px) / std::max({slice.width, slice.height, 1});
  const double shared = [&] {
    int longest = 1;
    for (const Slice& one : all.planes) longest = std::max({longest, one.width, one.height});
    return double(edge_px) / longest;
  }();
  const double z = std::min(zoom, shared);
  const glm::ivec2 size =
      glm::max(glm::ivec2(glm::round(z * glm::dvec2(slice.width, slice.height))), glm::ivec2(1));
  const glm::dvec2 at = corner + glm::floor(0.5 * glm::dvec2(edge_px - size.x, edge_px - size.y));
  canvas.draw_raster(raster_of(slice, all, size), at, 0.0);
  for (size_t w = 0; w < all.walls.size(); ++w) {
    const glm::vec3 c = all.walls[w].colour;
    const auto& ends = slice.contours_px[w];
    for (size_t k = 0; k + 1 < ends.size(); k += 2)
      canvas.draw_line({at + z * ends[k], at + z * ends[k + 1]}, {c.r, c.g, c.b}, 1.6 * scale);
  }

  // The crosshair leaves the place itself open.
  const glm::dvec2 place = at + z * slice.place_px;
  const double open = 6.0 * scale;
  for (const auto& [from, to] : {std::pair{at.x, place.x - open}, {place.x + open, at.x + size.x}})
    if (from < to) canvas.draw_line({{from, place.y}, {to, place.y}}, kCross, scale, 0.7);
  for (const auto& [from, to] : {std::pair{at.y, place.y - open}, {place.y + open, at.y + size.y}})
    if (from < to) canvas.draw_line({{place.x, from}, {place.x, to}}, kCross, scale, 0.7);

  const double middle = corner.x + 0.5 * edge_px, pad = 4.0 * scale, text = 11.0 * scale;
  TextStyle side{.size_px = text, .bold = true, .color = kSliceInk, .halo = true};
  canvas.draw_text(slice.sides[0], {corner.x + pad, corner.y + 0.5 * edge_px + 0.35 * text}, side);
  side.align = Align::kRight;
  canvas.draw_text(slice.sides[1],
                   {corner.x + edge_px - pad, corner.y + 0.5 * edge_px + 0.35 * text}, side);
  side.align = Align::kCentre;
  canvas.draw_text(slice.sides[2], {middle, corner.y + pad + 0.8 * text}, side);
  canvas.draw_text(slice.sides[3], {middle, corner.y + edge_px - pad}, side);

  if (!has_bar) return;
  const double bar_mm = readable_mm(kLongestBar * edge_px / z * all.px_mm);
  const double bar = z * bar_mm / all.px_mm, y = corner.y + edge_px - 2.0 * pad;
  canvas.draw_line({{corner.x + pad, y}, {corner.x + pad + bar, y}}, kSliceInk, 2.0 * scale);
  canvas.draw_text(fmt::format("{:g} mm", bar_mm), {corner.x + pad, y - pad},
                   {.size_px = text, .color = kSliceInk, .halo = true});
}

/// The name of a range of colours and, below it, their bar between its ends; from y on,
/// kColourLines high.
void draw_colours(Canvas& canvas, const TubeColours& of, double y, double width, double scale) {
  const double pad = kSlicePad * scale, line = kSliceLine * scale, text = 12.0 * scale;
  y += line;
  canvas.draw_text(of.name + ", " + of.unit, {pad, y - 0.3 * line},
                   {.size_px = text, .color = kSliceInk, .max_width_px = width - 2.0 * pad});
  y += line;
  TextStyle end{.size_px = text, .color = kSliceInk};
  const std::string low = number(of.least), high = number(of.most);
  const double left = pad + canvas.text_width(low, end) + pad;
  const double right = width - pad - canvas.text_width(high, end) - pad;
  canvas.draw_text(low, {pad, y - 0.3 * line}, end);
  end.align = Align::kRight;
  canvas.draw_text(high, {width - pad, y - 0.3 * line}, end);
  Bitmap bar{std::max(1, int(right - left)), std::max(1, int(kColourBar * scale)), {}};
  for (int row = 0; row < bar.height; ++row)
    for (int x = 0; x < bar.width; ++x) {
      const double at = (x + 0.5) / bar.width * double(of.colours.size() - 1);
      const size_t k = std::min(size_t(at), of.colours.size() - 2);
      const glm::uvec3 c(
          glm::round(255.0 * glm::mix(of.colours[k], of.colours[k + 1], at - double(k))));
      bar.pixels.push_back(0xff000000U | c.r << 16 | c.g << 8 | c.b);
    }
  canvas.draw_raster(bar, glm::round(glm::dvec2(left, y - 0.3 * line - bar.height)), 0.0);
}

}  // namespace

int slice_edge_px(int height_px) {
  return int(kEdgeShare * height_px);
}

std::vector<std::string> time_lines(const FrameTimes& times, double time_s) {
  if (times.times_s.size() < 2) return {};
  const FramePointer at = pointer_at(times, time_s);
  const double now_s =
      times.cyclic() ? time_s - times.cycle_s * std::floor(time_s / times.cycle_s) : time_s;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("frame {:.1f} of {}", at.frame + at.phase, times.times_s.size()));
  const double share = 100.0 * now_s / times.length_s();
  const std::string of = times.cyclic() ? "cycle" : "sequence";
  lines.push_back(times.assumed ? fmt::format("{:.0f} % of the {}", share, of)
                                : fmt::format("{:.0f} of {:.0f} ms, {:.0f} %", 1e3 * now_s,
                                              1e3 * times.length_s(), share));
  if (times.cyclic() && !times.assumed)
    lines.push_back(fmt::format("{:.0f} cycles a minute", 60.0 / times.cycle_s));
  return lines;
}

int first_moving(const Scene& scene, int count) {
  for (int v = 0; v < std::min(int(scene.volumes.size()), count); ++v)
    if (!scene.volumes[size_t(v)].data->is_still()) return v;
  return -1;
}

std::vector<std::string> time_lines(const Scene& scene, const SceneSnapshot& snapshot) {
  const int v = first_moving(scene, snapshot.volume_count);
  if (v < 0) return {};
  const VolumeSnapshot& of = snapshot.volumes[size_t(v)];
  std::vector<std::string> lines = time_lines(scene.volumes[size_t(v)].data->times, of.time_s);
  if (of.rate == 0.0 && !lines.empty()) lines.front() += ", paused";
  return lines;
}

Bitmap draw_slices(const SlicePanel& panel, int height_px) {
  const int edge_px = slice_edge_px(height_px);
  const double scale = std::max(height_px / kUsualHeight, kLeastScale);
  Canvas canvas(edge_px, height_px, kGround);
  const double pad = kSlicePad * scale, line = kSliceLine * scale, gap = kSliceGap * scale;
  const double text_px = line * (0.6 + double(panel.lines.size() + panel.slices.walls.size()) +
                                 kColourLines * double(panel.colours.size()));
  const int tile_px =
      std::clamp(int((height_px - text_px) / 3.0 - gap), int(kSmallestSlice * edge_px), edge_px);
  double y = 0.0;
  for (size_t n = 0; n < panel.slices.planes.size(); ++n) {
    draw_slice(canvas, panel.slices.planes[n], panel.slices,
               {std::floor(0.5 * (edge_px - tile_px)), y}, tile_px, scale, n == 0);
    y += tile_px + gap;
  }

  // Text, as much as there is room for.
  const auto room = [&](double lines = 1.0) { return y + lines * line <= height_px; };
  y += 0.3 * line;
  for (const std::string& text : panel.lines) {
    if (!room()) break;
    y += line;
    canvas.draw_text(text, {pad, y - 0.3 * line},
                     {.size_px = 12.0 * scale, .color = kFaint, .max_width_px = edge_px - 2 * pad});
  }
  for (const TubeColours& of : panel.colours) {
    if (!room(kColourLines)) break;
    draw_colours(canvas, of, y, edge_px, scale);
    y += kColourLines * line;
  }
  for (const SliceWall& wall : panel.slices.walls) {
    if (!room()) break;
    y += line;
    const double swatch = kSwatch * scale;
    canvas.fill_box({pad, y - 0.3 * line - 0.9 * swatch}, {swatch, swatch},
                    {wall.colour.r, wall.colour.g, wall.colour.b});
    const double left = pad + 1.7 * swatch;
    canvas.draw_text(
        wall.name, {left, y - 0.3 * line},
        {.size_px = 12.0 * scale, .color = kSliceInk, .max_width_px = edge_px - left - pad});
  }
  return canvas.raster();
}

Bitmap draw_tube_colours(const std::vector<TubeColours>& colours, int height_px) {
  if (colours.empty()) return {};
  const double scale = std::max(height_px / kUsualHeight, kLeastScale);
  const double height = kSliceLine * scale * (0.3 + kColourLines * double(colours.size()));
  Canvas canvas(slice_edge_px(height_px), int(height));
  canvas.fill_box({0.0, 0.0}, {slice_edge_px(height_px), height}, kGround, 0.80, 9.0 * scale);
  double y = 0.0;
  for (const TubeColours& of : colours) {
    draw_colours(canvas, of, y, slice_edge_px(height_px), scale);
    y += kColourLines * kSliceLine * scale;
  }
  return canvas.raster();
}

}  // namespace palpate::charts
