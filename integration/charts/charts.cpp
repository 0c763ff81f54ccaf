#include "integration/charts/charts.h"

#include <fmt/core.h>

#include <algorithm>

#include "integration/charts/figures.h"

namespace palpate::charts {
namespace {

Status check_pair(const std::string& path, const PairPicture& pair) {
  if (!pair.fixed || !pair.moving || !pair.field) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The picture {} can not be drawn: it needs a fixed frame, a moving "
                             "frame and a field.",
                             path)};
  }
  const auto all_ok = [&]() -> Status {
    if (auto ok = checked(path, pair.fixed->grid, pair.fixed->values.size(), "the fixed frame");
        !ok) {
      return ok;
    }
    if (auto ok = checked(path, pair.moving->grid, pair.moving->values.size(), "the moving frame");
        !ok) {
      return ok;
    }
    if (auto ok = checked(path, pair.field->grid, pair.field->u_mm.size(), "the field"); !ok) {
      return ok;
    }
    if (!pair.truth) return Nothing{};
    return checked(path, pair.truth->grid, pair.truth->u_mm.size(), "the truth");
  };
  if (auto ok = all_ok(); !ok || !pair.confidence) return ok;
  return checked(path, pair.confidence->grid, pair.confidence->values.size(), "the confidence");
}

// One column of the overview while the page is put together.
struct OverviewColumn {
  Content content;
  Heading heading;
  ColorKey key;
};

std::vector<OverviewColumn> difference_parts(const PairPicture& pair) {
  const auto before = spread_values(pair.fixed->grid, pair.mask, [&](glm::dvec3 x) {
    return difference_at(*pair.fixed, *pair.moving, nullptr, x);
  });
  const auto after = spread_values(pair.fixed->grid, pair.mask, [&](glm::dvec3 x) {
    return difference_at(*pair.fixed, *pair.moving, pair.field, x);
  });
  const double rms_before = root_mean_square(before);
  const double rms_after = root_mean_square(after);
  std::string change;
  if (rms_before > 0.0) {
    const double percent = 100.0 * (rms_after - rms_before) / rms_before;
    change = fmt::format(", {:.0f} % {}", std::abs(percent), percent <= 0.0 ? "less" : "more");
  }
  const Range range = symmetric_range(before);
  return {{difference_content(*pair.fixed, *pair.moving, nullptr, range),
           {"Difference before", "RMS " + number(rms_before)},
           {ColorMap::kDifference, range, "moving minus fixed"}},
          {difference_content(*pair.fixed, *pair.moving, pair.field, range),
           {"Difference after", "RMS " + number(rms_after) + change},
           {ColorMap::kDifference, range, "moving minus fixed"}}};
}

OverviewColumn error_part(const PairPicture& pair) {
  const auto misses = spread_values(pair.truth->grid, pair.mask, [&](glm::dvec3 x) {
    return glm::length(sample_at_lps(*pair.field, x) - sample_at_lps(*pair.truth, x));
  });
  const Range range = round_range(misses);
  return {error_content(*pair.field, *pair.truth, pair.mask, range),
          {pair.mask ? "Error inside the mask" : "Error",
           error_numbers(*pair.field, *pair.truth, pair.mask)},
          {ColorMap::kError, range, "distance from the truth, mm"}};
}

OverviewColumn confidence_part(const PairPicture& pair) {
  std::vector<double> values(pair.confidence->values.begin(), pair.confidence->values.end());
  const auto low = std::count_if(values.begin(), values.end(), [](double c) { return c < 0.5; });
  return {confidence_content(*pair.confidence, pair.fixed->grid),
          {"Confidence", fmt::format("median {}, {} % below a half", number(quantile(values, 0.5)),
                                     number(100.0 * double(low) / double(values.size())))},
          {ColorMap::kConfidence, {0.0, 1.0}, "0 is a guess, 1 is sure"}};
}

OverviewColumn fixed_part(const PairPicture& pair, Range range_mm) {
  return {frame_content(*pair.fixed, dimmed(window_of(*pair.fixed))),
          {"Fixed frame", "and where each point goes"},
          {ColorMap::kMotion, range_mm, "length of the motion, mm"}};
}

OverviewColumn motion_part(const PairPicture& pair, Range range_mm) {
  OverviewColumn part{
      motion_content(*pair.field, pair.fixed->grid, range_mm),
      {pair.mask ? "Motion inside the mask" : "Motion", motion_numbers(*pair.field, pair.mask)},
      {ColorMap::kMotion, range_mm, "length of the motion, mm"}};
  part.content.overlays.push_back(carried_lattice(*pair.field, pair.fixed->grid, {1, 1, 1}));
  return part;
}

}  // namespace

Status write_pair_overview(const std::string& path, const PairPicture& pair,
                           const Caption& caption) {
  if (auto ok = check_pair(path, pair); !ok) return ok;
  const auto lengths = spread_values(pair.fixed->grid, pair.mask, [&](glm::dvec3 x) {
    return glm::length(sample_at_lps(*pair.field, x));
  });
  const Range range_mm = round_range(lengths);
  std::vector<OverviewColumn> parts;
  parts.push_back(fixed_part(pair, range_mm));
  for (OverviewColumn& part : difference_parts(pair)) parts.push_back(std::move(part));
  parts.push_back(motion_part(pair, range_mm));
  if (pair.truth) parts.push_back(error_part(pair));
  if (pair.confidence) parts.push_back(confidence_part(pair));

  std::vector<const Content*> contents;
  for (const OverviewColumn& part : parts) contents.push_back(&part.content);
  Page page =
      table_page(caption, box_of(pair.fixed->grid), focus_of(*pair.field, pair.mask), contents);
  for (size_t n = 0; n < parts.size(); ++n) page.columns[n] = {parts[n].heading, {parts[n].key}};
  const Layout layout = laid_out(page);
  const double stretch = arrow_stretch(quantile(lengths, 0.99), layout.px_per_mm);
  page.footnote = stretch_note(stretch) +
                  "  White lattice: squares carried by the field, red where it folds.  " +
                  page.footnote;
  Content& frame = parts.front().content;
  frame.overlays.push_back(arrows(*pair.field, {range_mm, stretch, pair.mask, &pair.fixed->grid}));
  frame.overlays.push_back(orientation_letters(true));
  frame.overlays.push_back(scale_bar(true));
  return write_page(path, page, layout);
}

namespace {

constexpr size_t kMostRows = 12;

std::vector<size_t> thinned(size_t count) {
  std::vector<size_t> rows;
  const size_t shown = std::min(count, kMostRows);
  for (size_t n = 0; n < shown; ++n) {
    rows.push_back(shown == 1 ? 0 : n * (count - 1) / (shown - 1));
  }
  return rows;
}

// What all rows of a strip share, so that they can be compared.
struct StripScale {
  Range window{0.0, 0.0};
  std::vector<double> lengths_mm;
  glm::dvec3 focus_lps_mm{0.0};
};

StripScale strip_scale(const std::vector<SequenceStep>& steps, const std::vector<size_t>& rows) {
  StripScale scale;
  const Field* most_moving = nullptr;
  double most = -1.0;
  bool first = true;
  for (const size_t row : rows) {
    const Range window = window_of(*steps[row].frame);
    scale.window.low = first ? window.low : std::min(scale.window.low, window.low);
    scale.window.high = first ? window.high : std::max(scale.window.high, window.high);
    first = false;
    if (!steps[row].field) continue;
    const std::vector<double> lengths = sampled_lengths_mm(*steps[row].field);
    scale.lengths_mm.insert(scale.lengths_mm.end(), lengths.begin(), lengths.end());
    const double size = root_mean_square(lengths);
    if (size > most) {
      most = size;
      most_moving = steps[row].field;
    }
  }
  scale.focus_lps_mm =
      most_moving ? focus_of(*most_moving) : box_of(steps.front().frame->grid).centre_mm();
  return scale;
}

Status check_steps(const std::string& path, const std::vector<SequenceStep>& steps) {
  if (steps.empty()) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The picture {} can not be drawn: the sequence has no frame.", path)};
  }
  for (const SequenceStep& step : steps) {
    if (!step.frame) {
      return Error{
          ErrorKind::kBadInput,
          fmt::format("The picture {} can not be drawn: '{}' has no frame.", path, step.label)};
    }
    if (auto ok = checked(path, step.frame->grid, step.frame->values.size(), "a frame"); !ok) {
      return ok;
    }
    if (!step.field) continue;
    if (auto ok = checked(path, step.field->grid, step.field->u_mm.size(), "a field"); !ok) {
      return ok;
    }
  }
  return Nothing{};
}

}  // namespace

Status write_sequence_strip(const std::string& path, const std::vector<SequenceStep>& steps,
                            const Caption& caption) {
  if (auto ok = check_steps(path, steps); !ok) return ok;
  const std::vector<size_t> rows = thinned(steps.size());
  const StripScale scale = strip_scale(steps, rows);
  const Range range_mm = round_range(scale.lengths_mm);
  std::vector<Content> contents;
  for (const size_t row : rows) {
    contents.push_back(frame_content(*steps[row].frame, dimmed(scale.window)));
  }
  std::vector<const Content*> shown;
  for (const Content& content : contents) shown.push_back(&content);
  Page page = views_page(caption, box_of(steps.front().frame->grid), scale.focus_lps_mm, shown);
  page.wide_row_headings = true;
  page.wanted_width_px = 300.0 * double(page.columns.size());
  for (const size_t row : rows) page.rows.push_back({steps[row].label, steps[row].sublabel});
  page.columns[page.columns.size() / 2].keys = {
      {ColorMap::kMotion, range_mm, "length of the motion to the next frame, mm"}};
  const Layout layout = laid_out(page);
  const double stretch = arrow_stretch(quantile(scale.lengths_mm, 0.99), layout.px_per_mm);
  page.footnote = stretch_note(stretch) + "  " + page.footnote;
  if (rows.size() < steps.size()) {
    page.footnote =
        fmt::format("{} of {} frames are shown.  ", rows.size(), steps.size()) + page.footnote;
  }
  for (size_t n = 0; n < rows.size(); ++n) {
    const SequenceStep& step = steps[rows[n]];
    if (step.field) {
      contents[n].overlays.push_back(
          arrows(*step.field, {range_mm, stretch, nullptr, &step.frame->grid}));
    }
    if (n == 0) {
      contents[n].overlays.push_back(orientation_letters(true));
      contents[n].overlays.push_back(scale_bar(true));
    }
  }
  return write_page(path, page, layout);
}

}  // namespace palpate::charts
