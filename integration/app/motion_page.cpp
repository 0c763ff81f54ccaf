#include "integration/app/motion_page.h"

#include <algorithm>
#include <cmath>

#include "integration/charts/range.h"

namespace palpate::app {
namespace {

using web::VolumeRole;
using web::WebPage;
using web::WebPlot;
using web::WebVolume;

/// det(I + grad u) at every sample, by central differences (one-sided at the border).
std::vector<float> determinants(const Field& field) {
  const Grid& grid = field.grid;
  const glm::dmat3 index_from_lps = glm::transpose(grid.direction);
  std::vector<float> result(grid.count());
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::ivec3 at(i, j, k);
        glm::dmat3 along(0.0);  // column a: du per mm along axis a of the grid
        for (int a = 0; a < 3; ++a) {
          glm::ivec3 low = at, high = at;
          low[a] = std::max(0, at[a] - 1);
          high[a] = std::min(grid.size[a] - 1, at[a] + 1);
          if (low[a] == high[a]) continue;
          const glm::dvec3 change(field.at(high.x, high.y, high.z) - field.at(low.x, low.y, low.z));
          along[a] = change / (grid.spacing_mm[a] * (high[a] - low[a]));
        }
        result[grid.offset(i, j, k)] =
            float(glm::determinant(glm::dmat3(1.0) + along * index_from_lps));
      }
  return result;
}

/// About 100,000 of the values of all frames.
std::vector<double> sampled(const std::vector<std::vector<float>>& frames) {
  size_t count = 0;
  for (const auto& frame : frames) count += frame.size();
  const size_t stride = std::max<size_t>(1, count / 100'000);
  std::vector<double> values;
  for (const auto& frame : frames)
    for (size_t n = 0; n < frame.size(); n += stride) values.push_back(double(frame[n]));
  return values;
}

WebVolume web_volume(VolumeRole role, std::string title, const Grid& grid, charts::Range range,
                     const std::vector<std::vector<float>>& frames) {
  WebVolume volume;
  volume.role = role;
  volume.title = std::move(title);
  volume.grid = grid;
  volume.low = range.low;
  volume.high = range.high;
  for (const auto& frame : frames)
    volume.frames.push_back(web::codes_of(frame, range.low, range.high));
  return volume;
}

}  // namespace

MotionPage::MotionPage(const Grid& grid, size_t frames)
    : frame_steps_(web::page_grids(grid, frames, web::kMostFrameVoxels)),
      overlay_steps_(web::page_grids(grid, frames, web::kMostOverlayVoxels)),
      frame_grid_(frame_steps_.empty() ? grid : frame_steps_.back()),
      overlay_grid_(overlay_steps_.empty() ? grid : overlay_steps_.back()) {}

void MotionPage::add_frame(const Volume& frame) {
  frames_.push_back(web::reduced(frame, frame_steps_).values);
}

void MotionPage::add_step(const Field& field, const Confidence& confidence) {
  const Field u = resampled(field, overlay_grid_);
  std::vector<float> lengths(u.u_mm.size());
  std::transform(u.u_mm.begin(), u.u_mm.end(), lengths.begin(),
                 [](const glm::vec3& v) { return glm::length(v); });
  motion_mm_.push_back(std::move(lengths));
  determinant_.push_back(determinants(u));
  confidence_.push_back(resampled(confidence, overlay_grid_).values);
  if (confidence.deviation.mm.empty()) return;
  const Deviation deviation = resampled(confidence.deviation, overlay_grid_);
  std::vector<float> off_mm(deviation.mm.size());
  // One direction along the image gradient, two across it.
  std::transform(deviation.mm.begin(), deviation.mm.end(), off_mm.begin(),
                 [](glm::vec2 sd) { return std::sqrt(sd.x * sd.x + 2.0F * sd.y * sd.y); });
  off_mm_.push_back(std::move(off_mm));
}

Status MotionPage::write(const PageWords& words, const std::filesystem::path& path) const {
  WebPage page;
  page.title = words.title;
  page.subtitle = words.subtitle;
  if (words.verdict) {
    page.verdict = word(words.verdict->trust);
    page.reasons =
        words.verdict->trust == Trust::kOk ? words.verdict->passed : words.verdict->reasons;
  }

  const std::string unit = web::set_frames(page, frames_.size(), words.times_s, words.cycle_s);
  if (!words.names.empty()) page.frame_labels = words.names;

  // Volumes.
  const charts::Range window = charts::window_of({frame_grid_, frames_.front()});
  page.volumes.push_back(web_volume(VolumeRole::kFrames, "value", frame_grid_, window, frames_));
  page.volumes.back().colormap = "gray";
  const auto overlay = [&](std::string title, std::string of_unit, std::string colormap,
                           std::string note, charts::Range range,
                           const std::vector<std::vector<float>>& frames) {
    WebVolume volume =
        web_volume(VolumeRole::kOverlay, std::move(title), overlay_grid_, range, frames);
    volume.unit = std::move(of_unit);
    volume.colormap = std::move(colormap);
    volume.note = std::move(note);
    page.volumes.push_back(std::move(volume));
  };
  if (!motion_mm_.empty()) {
    overlay("motion", "mm", "plasma", "How far the material moves to the next frame.",
            charts::round_range(sampled(motion_mm_)), motion_mm_);
    overlay("confidence", "", "viridis",
            "How probable it is that the motion is right here: 0 not at all, 1 certain.",
            {0.0, 1.0}, confidence_);
    if (off_mm_.size() == motion_mm_.size())
      overlay("deviation", "mm", "inferno",
              "How far the motion may be off here: the standard deviation of its error.",
              charts::round_range(sampled(off_mm_)), off_mm_);
    std::vector<double> changes = sampled(determinant_);
    for (double& change : changes) change = std::abs(change - 1.0);
    const double width = std::min(1.0, charts::round_range(changes).high);
    overlay("volume change", "", "decrease-increase",
            "By which factor the volume of the material changes to the next frame (determinant of "
            "the Jacobian): below 1 it shrinks, at 0 and below it folds.",
            {1.0 - width, 1.0 + width}, determinant_);
  }

  // Plots: curves of one title together.
  for (const FrameCurve& curve : words.curves) {
    auto plot = std::find_if(page.plots.begin(), page.plots.end(),
                             [&](const WebPlot& other) { return other.title == curve.title; });
    if (plot == page.plots.end()) {
      page.plots.push_back({curve.title, unit, true, true, {}});
      plot = page.plots.end() - 1;
    }
    plot->curves.push_back({curve.name, page.frame_times, curve.y});
  }

  page.facts = words.facts;
  if (!frame_steps_.empty())
    page.facts.push_back({"This page", "frames with fewer voxels than the files have"});
  return web::write_web_page(page, path);
}

}  // namespace palpate::app
