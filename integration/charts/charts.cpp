#include "integration/charts/charts.h"

#include <fmt/core.h>

#include "integration/charts/figures.h"

namespace palpate::charts {
namespace {

// The key of a page whose columns are views goes under the middle one.
void set_key(Page* page, ColorKey key) {
  page->columns[page->columns.size() / 2].keys = {std::move(key)};
}

void add_letters(Content* content, bool light) {
  content->overlays.push_back(orientation_letters(light));
  content->overlays.push_back(scale_bar(light));
}

}  // namespace

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

Status write_frame(const std::string& path, const Volume& frame, const Field* field,
                   const Caption& caption, const Mask* mask) {
  if (auto ok = checked(path, frame.grid, frame.values.size(), "the frame"); !ok) return ok;
  const BoundingBox box = box_of(frame.grid);
  const Range window = window_of(frame);
  if (!field) {
    Content content = frame_content(frame, window);
    add_letters(&content, true);
    const Page page = views_page(caption, box, box.centre_mm(), {&content});
    return write_page(path, page, laid_out(page));
  }
  if (auto ok = checked(path, field->grid, field->u_mm.size(), "the field"); !ok) return ok;
  const std::vector<double> lengths = sampled_lengths_mm(*field);
  const Range range = round_range(lengths);
  Content content = frame_content(frame, dimmed(window));
  Page page = views_page(caption, box, focus_of(*field, mask), {&content});
  set_key(&page, {ColorMap::kMotion, range, "length of the motion, mm"});
  const Layout layout = laid_out(page);
  const double stretch = arrow_stretch(quantile(lengths, 0.99), layout.px_per_mm);
  page.footnote = stretch_note(stretch) + "  " + page.footnote;
  content.overlays.push_back(arrows(*field, {range, stretch, mask, &frame.grid}));
  add_letters(&content, true);
  return write_page(path, page, layout);
}

Status write_motion_map(const std::string& path, const Field& field, const Grid& frame_grid,
                        const Caption& caption) {
  if (auto ok = checked(path, field.grid, field.u_mm.size(), "the field"); !ok) return ok;
  const Range range = round_range(sampled_lengths_mm(field));
  Content content = motion_content(field, frame_grid, range);
  add_letters(&content, true);
  Page page = views_page(caption, box_of(frame_grid), focus_of(field), {&content});
  set_key(&page, {ColorMap::kMotion, range, "length of the motion, mm"});
  return write_page(path, page, laid_out(page));
}

Status write_carried_lattice(const std::string& path, const Field& field, const Volume& frame,
                             const Caption& caption) {
  if (auto ok = checked(path, field.grid, field.u_mm.size(), "the field"); !ok) return ok;
  if (auto ok = checked(path, frame.grid, frame.values.size(), "the frame"); !ok) return ok;
  Content content = frame_content(frame, dimmed(window_of(frame)));
  content.overlays.push_back(carried_lattice(field, frame.grid, {0.55, 0.86, 0.95}));
  add_letters(&content, true);
  Page page = views_page(caption, box_of(frame.grid), focus_of(field), {&content});
  page.footnote = "Squares carried by the field; red where it folds.  " + page.footnote;
  return write_page(path, page, laid_out(page));
}

Status write_error_map(const std::string& path, const Field& field, const Field& truth,
                       const Mask* mask, const Caption& caption) {
  if (auto ok = checked(path, field.grid, field.u_mm.size(), "the field"); !ok) return ok;
  if (auto ok = checked(path, truth.grid, truth.u_mm.size(), "the truth"); !ok) return ok;
  const auto misses = spread_values(truth.grid, mask, [&](glm::dvec3 x) {
    return glm::length(sample_at_lps(field, x) - sample_at_lps(truth, x));
  });
  const Range range = round_range(misses);
  Content content = error_content(field, truth, mask, range);
  add_letters(&content, false);
  Page page = views_page(caption, box_of(truth.grid), focus_of(truth, mask), {&content});
  set_key(&page, {ColorMap::kError, range, "distance from the truth, mm"});
  page.footnote = "Error: " + error_numbers(field, truth, mask) + ".  " + page.footnote;
  return write_page(path, page, laid_out(page));
}

Status write_confidence_map(const std::string& path, const Confidence& confidence,
                            const Grid& frame_grid, const Caption& caption) {
  if (auto ok = checked(path, confidence.grid, confidence.values.size(), "the confidence"); !ok) {
    return ok;
  }
  Content content = confidence_content(confidence, frame_grid);
  add_letters(&content, true);
  const BoundingBox box = box_of(frame_grid);
  Page page = views_page(caption, box, box.centre_mm(), {&content});
  set_key(&page, {ColorMap::kConfidence, {0.0, 1.0}, "confidence, 0 is a guess"});
  return write_page(path, page, laid_out(page));
}

Status write_difference(const std::string& path, const Volume& fixed, const Volume& moving,
                        const Field& field, const Caption& caption) {
  if (auto ok = checked(path, fixed.grid, fixed.values.size(), "the fixed frame"); !ok) return ok;
  if (auto ok = checked(path, moving.grid, moving.values.size(), "the moving frame"); !ok) {
    return ok;
  }
  if (auto ok = checked(path, field.grid, field.u_mm.size(), "the field"); !ok) return ok;
  const auto before = spread_values(
      fixed.grid, nullptr, [&](glm::dvec3 x) { return difference_at(fixed, moving, nullptr, x); });
  const auto after = spread_values(
      fixed.grid, nullptr, [&](glm::dvec3 x) { return difference_at(fixed, moving, &field, x); });
  const Range range = symmetric_range(before);
  Content first = difference_content(fixed, moving, nullptr, range);
  Content second = difference_content(fixed, moving, &field, range);
  add_letters(&first, false);
  add_letters(&second, false);
  Page page = views_page(caption, box_of(fixed.grid), focus_of(field), {&first, &second});
  page.rows = {{"before, RMS " + number(root_mean_square(before)), ""},
               {"after, RMS " + number(root_mean_square(after)), ""}};
  set_key(&page, {ColorMap::kDifference, range, "moving minus fixed"});
  return write_page(path, page, laid_out(page));
}

}  // namespace palpate::charts
