#include "integration/charts/figures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace palpate::charts {

Status checked(const std::string& path, const Grid& grid, size_t samples, const char* what) {
  const bool sized = glm::all(glm::greaterThan(grid.size, glm::ivec3(0)));
  const bool spaced = glm::all(glm::greaterThan(grid.spacing_mm, glm::dvec3(0.0)));
  if (sized && spaced && grid.count() == samples) return Nothing{};
  return Error{
      ErrorKind::kBadInput,
      fmt::format("The picture {} can not be drawn: {} has {} samples on a grid of {} x {} "
                  "x {}; give one that is filled.",
                  path, what, samples, grid.size.x, grid.size.y, grid.size.z)};
}

glm::dvec3 focus_of(const Field& field, const Mask* mask) {
  glm::dvec3 sum(0.0);
  double weight_sum = 0.0;
  visit_samples(field.grid, 300'000, [&](glm::dvec3 lps_mm) {
    if (!inside(mask, lps_mm)) return;
    const glm::dvec3 u_mm = sample_at_lps(field, lps_mm);
    const double weight = glm::dot(u_mm, u_mm);
    if (!(weight < 1e12)) return;  // also NaN
    sum += weight * lps_mm;
    weight_sum += weight;
  });
  if (weight_sum < 1e-12) return box_of(field.grid).centre_mm();
  return sum / weight_sum;
}

namespace {

Page page_with(const Caption& caption, const BoundingBox& box, glm::dvec3 focus_lps_mm) {
  Page page;
  page.heading = {caption.title, caption.subtitle};
  page.box = box;
  page.focus_lps_mm =
      glm::clamp(caption.focus_lps_mm.value_or(focus_lps_mm), box.low_mm, box.high_mm);
  page.footnote = hanging_note();
  return page;
}

}  // namespace

Page views_page(const Caption& caption, const BoundingBox& box, glm::dvec3 focus_lps_mm,
                const std::vector<const Content*>& rows) {
  Page page = page_with(caption, box, focus_lps_mm);
  const std::vector<View> views = views_of(box);
  for (const View view : views) {
    page.columns.push_back({{axes_of(view).name, place_of(view, page.focus_lps_mm)}, {}});
  }
  for (const Content* content : rows) {
    std::vector<Cell> cells;
    for (const View view : views) cells.push_back({view, content});
    page.cells.push_back(std::move(cells));
  }
  page.wanted_width_px = 400.0 * double(views.size());
  return page;
}

Page table_page(const Caption& caption, const BoundingBox& box, glm::dvec3 focus_lps_mm,
                const std::vector<const Content*>& columns) {
  Page page = page_with(caption, box, focus_lps_mm);
  for (const View view : views_of(box)) {
    std::vector<Cell> cells;
    for (const Content* content : columns) cells.push_back({view, content});
    page.cells.push_back(std::move(cells));
    page.rows.push_back(
        {fmt::format("{}, {}", axes_of(view).name, place_of(view, page.focus_lps_mm)), ""});
  }
  page.columns.resize(columns.size());
  page.wanted_width_px = 330.0 * double(columns.size());
  return page;
}

std::string length_numbers(const Spread& lengths_mm) {
  if (lengths_mm.count == 0) return "no samples";
  return fmt::format("mean {}, p95 {}, max {} mm", number(lengths_mm.mean), number(lengths_mm.p95),
                     number(lengths_mm.max));
}

std::string motion_numbers(const Field& field, const Mask* mask) {
  if (!mask) return length_numbers(lengths_mm(field));
  const Mask there = resampled(*mask, field.grid);
  return length_numbers(lengths_mm(field, &there));
}

std::string error_numbers(const Field& field, const Field& truth, const Mask* mask) {
  const std::optional<Mask> there =
      mask ? std::optional(resampled(*mask, truth.grid)) : std::nullopt;
  const auto error = endpoint_error(field, truth, there ? &*there : nullptr);
  return length_numbers(error ? error->mm : Spread{});
}

Range dimmed(Range window) {
  return {window.low, window.low + 1.35 * (window.high - window.low)};
}

std::string stretch_note(double stretch) {
  if (stretch == 1.0) return "Arrows have their true length; dots move through the plane.";
  return fmt::format("Arrows are drawn {} \u00d7 their length; dots move through the plane.",
                     number(stretch));
}

std::string hanging_note() {
  return "Coordinates are LPS; the patient\u2019s left is on the right of axial and coronal views.";
}

std::vector<double> spread_values(const Grid& grid, const Mask* mask,
                                  const std::function<double(glm::dvec3)>& value_at) {
  constexpr size_t kSamples = 300'000;
  std::vector<double> values;
  visit_samples(grid, kSamples, [&](glm::dvec3 lps_mm) {
    if (!inside(mask, lps_mm)) return;
    const double value = value_at(lps_mm);
    if (std::isfinite(value)) values.push_back(value);
  });
  return values;
}

Range symmetric_range(const std::vector<double>& values) {
  std::vector<double> sizes(values);
  for (double& size : sizes) size = std::abs(size);
  const double top = round_range({quantile(sizes, 0.99)}).high;
  return {-top, top};
}

double root_mean_square(const std::vector<double>& values) {
  if (values.empty()) return 0.0;
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / double(values.size()));
}

}  // namespace palpate::charts
