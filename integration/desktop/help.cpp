#include "integration/desktop/help.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace palpate::desktop {
namespace {

using charts::Canvas;
using charts::Color;
using charts::TextStyle;

constexpr Color kHelpPaper{0.055, 0.065, 0.085};
constexpr Color kHelpInk{0.93, 0.94, 0.96};
constexpr Color kHelpQuiet{0.70, 0.74, 0.80};
constexpr double kRow = 19.0, kHelpEdge = 14.0, kColumn = 112.0;

using HelpLine = std::pair<const char*, const char*>;
constexpr std::array<HelpLine, 5> kWithProbe = {{
    {"Mouse", "moves the probe"},
    {"Left button", "lays a stream tube"},
    {"Wheel", "probe in and out"},
    {"Right drag", "turn the view"},
    {"Right + wheel, \u00b1", "closer, further"},
}};
constexpr std::array<HelpLine, 3> kWithoutProbe = {{
    {"Drag", "turn the view"},
    {"Wheel, \u00b1", "closer, further"},
    {"\u2191  \u2193", "slices away, nearer"},
}};
constexpr HelpLine kTubes{"T  K  X", "stream tube: lay, keep, clear"};
constexpr std::array<HelpLine, 9> kKeys = {{
    {"Space", "play or pause"},
    {"\u2190  \u2192", "back, forward in time"},
    {"C", "cut open"},
    {"S", "slices on, off"},
    {"1 \u2026 8, 0", "looks, what suits the data"},
    {"Middle drag", "level, width"},
    {"R / O", "probe / view back"},
    {"H", "hide this help"},
    {"Esc", "end"},
}};

}  // namespace

charts::Bitmap draw_help(double scale, bool probe, bool hand) {
  std::vector<HelpLine> lines;
  if (probe)
    lines.assign(kWithProbe.begin(), kWithProbe.end());
  else
    lines.assign(kWithoutProbe.begin(), kWithoutProbe.end());
  if (hand) lines.push_back(kTubes);
  lines.insert(lines.end(), kKeys.begin(), kKeys.end());
  TextStyle key{.size_px = 12.0, .bold = true, .color = kHelpInk};
  TextStyle meaning{.size_px = 12.0, .color = kHelpQuiet};
  Canvas ruler(1, 1);
  double widest = 0.0;
  for (const auto& [name, does] : lines) widest = std::max(widest, ruler.text_width(does, meaning));
  const glm::dvec2 size = scale * glm::dvec2(std::ceil(widest) + 2.0 * kHelpEdge + kColumn,
                                             2.0 * kHelpEdge - 5.0 + kRow * double(lines.size()));
  key.size_px *= scale;
  meaning.size_px *= scale;
  Canvas canvas(int(size.x), int(size.y));
  canvas.fill_box({0.0, 0.0}, size, kHelpPaper, 0.80, 9.0 * scale);
  double y = kHelpEdge + 10.0;
  for (const auto& [name, does] : lines) {
    canvas.draw_text(name, scale * glm::dvec2(kHelpEdge, y), key);
    canvas.draw_text(does, scale * glm::dvec2(kHelpEdge + kColumn, y), meaning);
    y += kRow;
  }
  return canvas.raster();
}

OverlayCorners place_corners(glm::ivec2 window, glm::ivec2 help, glm::ivec2 plot, int top,
                             int edge) {
  OverlayCorners corners;
  corners.plot = window - plot - edge;
  corners.help = {edge, window.y - help.y - edge};
  if (corners.help.x + help.x + edge <= corners.plot.x) return corners;
  const int above = corners.plot.y - edge - help.y;
  corners.shows_plot = above >= top;
  if (corners.shows_plot) corners.help.y = above;
  return corners;
}

charts::Bitmap draw_note(const std::string& title, const std::vector<std::string>& lines,
                         double scale) {
  const TextStyle head{.size_px = 14.0 * scale, .bold = true, .color = kHelpInk};
  const TextStyle quiet{.size_px = 12.0 * scale, .color = kHelpQuiet};
  Canvas ruler(1, 1);
  double widest = ruler.text_width(title, head);
  for (const std::string& line : lines) widest = std::max(widest, ruler.text_width(line, quiet));
  const glm::dvec2 size(std::ceil(widest) + 2.0 * kHelpEdge * scale,
                        scale * (2.0 * kHelpEdge + 3.0 + kRow * double(lines.size())));
  Canvas canvas(int(size.x), int(size.y));
  canvas.fill_box({0.0, 0.0}, size, kHelpPaper, 0.80, 9.0 * scale);
  canvas.draw_text(title, scale * glm::dvec2(kHelpEdge, kHelpEdge + 10.0), head);
  double y = kHelpEdge + 10.0 + kRow;
  for (const std::string& line : lines) {
    canvas.draw_text(line, scale * glm::dvec2(kHelpEdge, y), quiet);
    y += kRow;
  }
  return canvas.raster();
}

}  // namespace palpate::desktop
