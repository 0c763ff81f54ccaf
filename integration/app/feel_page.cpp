#include "integration/app/feel_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <sstream>
#include <thread>

#include "integration/charts/range.h"
#include "integration/web/web_page.h"
#include "module/session/moved_volume.h"
#include "module/session/segment_sizes.h"

namespace palpate::app {
namespace {

using web::VolumeRole;
using web::WebPage;
using web::WebVolume;

/// The volume at the times of its frames.
std::vector<MovedVolume> at_frames(const MovingVolume& volume) {
  const size_t count = volume.times.times_s.size();
  std::vector<MovedVolume> frames(count);
  std::atomic<size_t> next{0};
  std::vector<std::jthread> workers;
  for (unsigned n = 0; n < std::max(1U, std::thread::hardware_concurrency()); ++n)
    workers.emplace_back([&] {
      for (size_t k = next++; k < count; k = next++)
        frames[k] = moved_volume(volume, volume.times.times_s[k],
                                 size_t(web::kMostFrameVoxels / double(count)));
    });
  workers.clear();
  return frames;
}

/// Labels at the samples of a moved frame: the innermost segment that a sample lies in, the one
/// whose surface is nearest; 1 is the first.
std::vector<uint8_t> labels_of(const MovingVolume& volume, const MovedVolume& moved, size_t frame) {
  const Grid& grid = moved.values.grid;
  std::vector<uint8_t> labels(grid.count(), 0);
  std::vector<double> nearest_mm(grid.count(), std::numeric_limits<double>::infinity());
  for (size_t s = 0; s < std::min<size_t>(volume.segments.size(), 255); ++s) {
    const auto& distances = volume.segments[s].distance_mm;
    const bool of_each = distances.size() > frame && distances.size() > 1;
    const FrameData& distance = *distances[of_each ? frame : 0];
    size_t n = 0;
    for (int k = 0; k < grid.size.z; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i, ++n) {
          glm::dvec3 lps = grid.lps_from_index({i, j, k});
          // One distance alone is carried, as the values are.
          if (!of_each) lps -= glm::dvec3(moved.moved_mm[n]);
          const double inside_mm = distance.scalar(volume_from_lps(lps));
          if (!(inside_mm > 0.0 && inside_mm < nearest_mm[n])) continue;
          nearest_mm[n] = inside_mm;
          labels[n] = uint8_t(s + 1);
        }
  }
  return labels;
}

void add_volumes(WebPage& page, const MovingVolume& volume, const std::string& unit) {
  const std::vector<MovedVolume> moved = at_frames(volume);
  if (moved.front().values.values.empty()) return;
  WebVolume frames;
  frames.title = "value";
  frames.colormap = "gray";
  frames.grid = moved.front().values.grid;
  const charts::Range window = charts::window_of(moved.front().values);
  frames.low = window.low;
  frames.high = window.high;
  WebVolume motion = frames;
  motion.role = VolumeRole::kOverlay;
  motion.title = "motion";
  motion.unit = "mm";
  motion.colormap = "plasma";
  motion.note = "How far the material is from where it is in the frame that is carried.";
  std::vector<std::vector<float>> lengths;
  std::vector<double> sampled;
  for (const MovedVolume& frame : moved) {
    frames.frames.push_back(web::codes_of(frame.values.values, frames.low, frames.high));
    std::vector<float>& of_frame = lengths.emplace_back();
    for (const glm::vec3& u : frame.moved_mm) of_frame.push_back(glm::length(u));
    for (size_t n = 0; n < of_frame.size(); n += 97) sampled.push_back(double(of_frame[n]));
  }
  page.volumes.push_back(std::move(frames));
  if (charts::quantile(sampled, 1.0) > 0.0) {
    motion.high = charts::round_range(sampled).high;
    motion.low = 0.0;
    for (const auto& of_frame : lengths)
      motion.frames.push_back(web::codes_of(of_frame, 0.0, motion.high));
    page.volumes.push_back(std::move(motion));
  }
  if (volume.segments.empty()) return;

  // Segments: outlines, and how large they are.
  WebVolume labels;
  labels.role = VolumeRole::kLabels;
  labels.title = "segments";
  labels.grid = page.volumes.front().grid;
  const SegmentSizes sizes = segment_sizes(volume);
  web::WebPlot volumes{"Volume of the segments (ml)", unit, false, true, {}};
  for (size_t s = 0; s < volume.segments.size(); ++s) {
    const Segment& segment = volume.segments[s];
    labels.labels.push_back(
        {int(s + 1), segment.name, glm::ivec3(glm::round(255.0F * segment.colour))});
    volumes.curves.push_back({segment.name, page.frame_times, sizes.volumes_ml[s].values});
  }
  for (size_t k = 0; k < moved.size(); ++k) labels.frames.push_back(labels_of(volume, moved[k], k));
  page.volumes.push_back(std::move(labels));
  page.plots.push_back(std::move(volumes));
  if (sizes.cavity >= 0)
    page.plots.push_back({"Thickness of the wall (mm)",
                          unit,
                          false,
                          true,
                          {{sizes.wall_mm.name, page.frame_times, sizes.wall_mm.values}}});
}

/// Force and depth over the run; of many ticks the largest force in each of 1,000 parts.
void add_ticks(WebPage& page, const std::vector<running::TickRow>& rows) {
  web::WebPlot force{"Force (N)", "s", true, false, {{"to the hand", {}, {}}}};
  web::WebPlot depth{"Hand behind the surface (mm)", "s", true, false, {{"depth", {}, {}}}};
  const size_t part = std::max<size_t>(1, rows.size() / 1000);
  for (size_t from = 0; from < rows.size(); from += part) {
    const auto end = rows.begin() + long(std::min(from + part, rows.size()));
    const auto most =
        std::max_element(rows.begin() + long(from), end, [](const auto& a, const auto& b) {
          return glm::length(a.force_n) < glm::length(b.force_n);
        });
    force.curves[0].x.push_back(most->time_s);
    force.curves[0].y.push_back(glm::length(most->force_n));
    depth.curves[0].x.push_back(most->time_s);
    depth.curves[0].y.push_back(1e3 * glm::distance(most->probe_m, most->proxy_m));
  }
  page.plots.push_back(std::move(force));
  page.plots.push_back(std::move(depth));
}

}  // namespace

Status write_feel_page(const std::filesystem::path& path, const std::string& title,
                       const MovingVolume& volume, const running::FeelNumbers& n,
                       const std::vector<running::TickRow>& rows, const std::string& summary) {
  WebPage page;
  page.title = title;
  page.subtitle = fmt::format(
      "{:.1f} s, {:.1f} s touching: {:.2f} N on average, {:.2f} N at most, up to {:.1f} mm deep",
      n.seconds, n.touched_s, n.mean_force_n, n.most_force_n, 1e3 * n.deepest_m);
  const std::vector<double>& times_s = volume.times.times_s;
  const std::string unit =
      web::set_frames(page, times_s.size(), volume.times.assumed ? std::vector<double>{} : times_s,
                      volume.times.cycle_s);
  add_volumes(page, volume, unit);
  if (!rows.empty()) add_ticks(page, rows);
  // The summary's lines: a word in ten columns, or a heading; lines that begin with spaces go on.
  std::istringstream lines(summary);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    if (line[0] == ' ' && !page.facts.empty()) {
      std::string& text = page.facts.back().second;
      text += (text.empty() ? "" : "; ") + line.substr(line.find_first_not_of(' '));
    } else if (line.size() > 10 && line[9] == ' ') {
      const std::string name = line.substr(0, 10);
      page.facts.push_back({name.substr(0, name.find_last_not_of(' ') + 1), line.substr(10)});
    } else {
      page.facts.push_back({line, ""});
    }
  }
  return web::write_web_page(page, path);
}

}  // namespace palpate::app
