#include <cmath>

#include "integration/files/frame_times.h"
#include "integration/files/raster/nrrd_fields.h"
#include "integration/files/raster/nrrd_header.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

constexpr size_t kAxes = 5;

Error damaged(const std::filesystem::path& file, const char* what) {
  return bad_input(
      file, "is the motion of a sequence, but {}: write it again with 'palpate motion'", what);
}

/// True if the frames are at most this share of a step away from even times.
constexpr double kEven = 0.1;
bool are_even(const std::vector<double>& times_s, double cycle_s) {
  const double step_s = cycle_s / double(times_s.size());
  for (size_t k = 0; k < times_s.size(); ++k)
    if (std::abs(times_s[k] - double(k) * step_s) > kEven * step_s) return false;
  return true;
}

/// When its frames are and how its terms depend on time.
Result<TimeBasis> basis_of(const std::filesystem::path& file, const NrrdFields& header) {
  const auto times = to_numbers(header.key("SequenceMotion.FrameTimes_s"));
  const auto cycle = to_number(header.key("SequenceMotion.Cycle_s"));
  const auto harmonics = to_integer(header.key("SequenceMotion.Harmonics"));
  if (!times || times->size() < 2 || 3.0 * double(times->size()) > kMaxLanes ||
      !is_rising(*times) || times->front() != 0.0)
    return damaged(file, "its frame times do not rise from 0");
  if (!cycle || !std::isfinite(*cycle) || (*cycle != 0.0 && *cycle <= times->back()))
    return damaged(file, "its cycle ends before its last frame");
  if (!harmonics || *harmonics < 0 || *harmonics > TimeBasis::kMostHarmonics)
    return damaged(file, "its number of harmonics makes no sense");
  if (*harmonics > 0 && *cycle == 0.0) return damaged(file, "it has harmonics without a cycle");
  if (*harmonics > 0 && header.key("SequenceMotion.Clock") != "frames" && !are_even(*times, *cycle))
    return damaged(file, "its frames are at uneven times and its harmonics do not count frames");
  const bool repeats_first = header.key("SequenceMotion.RepeatsFirst") == "1";
  if (repeats_first && (*cycle == 0.0 || times->size() < 3))
    return damaged(file, "its last frame repeats the first without a cycle");
  return TimeBasis{*times, *cycle, int(*harmonics), repeats_first};
}

/// The grid of the frames, where the file has it: files of before palpate kept it have none.
Result<std::optional<Grid>> frames_grid_of(const std::filesystem::path& file,
                                           const NrrdFields& header) {
  if (header.key("SequenceMotion.FramesSize").empty()) return std::optional<Grid>();
  const auto size = to_numbers(header.key("SequenceMotion.FramesSize"));
  const auto spacing = to_numbers(header.key("SequenceMotion.FramesSpacing_mm"));
  const auto origin = to_numbers(header.key("SequenceMotion.FramesOrigin_mm"));
  const auto axes = to_numbers(header.key("SequenceMotion.FramesDirections"));
  if (!size || size->size() != 3 || !spacing || spacing->size() != 3 || !origin ||
      origin->size() != 3 || !axes || axes->size() != 9)
    return damaged(file, "the grid of its frames makes no sense");
  Placement placement;
  for (int a = 0; a < 3; ++a) {
    placement.size[a] = (*size)[size_t(a)];
    placement.spacing_mm[a] = (*spacing)[size_t(a)];
    placement.origin_mm[a] = (*origin)[size_t(a)];
    for (int row = 0; row < 3; ++row) placement.axes[a][row] = (*axes)[size_t(3 * a + row)];
  }
  const auto grid = make_grid(file, placement);
  if (!grid) return grid.error();
  return std::optional<Grid>(*grid);
}

}  // namespace

Result<SequenceMotionHeader> parse_sequence_motion_header(const std::filesystem::path& file,
                                                          std::string_view text) {
  const auto header = split_nrrd_header(file, text);
  if (!header) return header.error();
  const auto version = header->key(kSequenceMotionKey);
  if (version.empty())
    return bad_input(file,
                     "is not the motion of a sequence (it lacks the key {}): name the file {} of "
                     "'palpate motion'",
                     kSequenceMotionKey, kSequenceMotionName);
  if (version != "1")
    return bad_input(file,
                     "is of version {}, but this palpate reads version 1: use a newer palpate",
                     version.substr(0, 40));
  SequenceMotionHeader found;
  auto basis = basis_of(file, *header);
  if (!basis) return basis.error();
  found.basis = std::move(*basis);
  const auto reference = to_integer(header->key("SequenceMotion.ReferenceFrame"));
  if (!reference || *reference < 0 || size_t(*reference) >= found.basis.times_s.size())
    return damaged(file, "its reference frame is none of its frames");
  found.reference = size_t(*reference);
  auto frames_grid = frames_grid_of(file, *header);
  if (!frames_grid) return frames_grid.error();
  found.frames_grid = *frames_grid;
  auto axes = nrrd_axes(file, *header);
  if (!axes) return axes.error();
  const bool in_order = axes->size() == kAxes && (*axes)[0].role == NrrdRole::kComponents &&
                        (*axes)[0].size == 3.0 && (*axes)[1].role == NrrdRole::kSpace &&
                        (*axes)[2].role == NrrdRole::kSpace &&
                        (*axes)[3].role == NrrdRole::kSpace && (*axes)[4].role == NrrdRole::kFrames;
  if (!in_order) return damaged(file, "its axes are not three components, x, y, z and terms");
  if ((*axes)[4].size != double(found.basis.terms()))
    return damaged(file, "its last axis is not as long as its terms are many");
  // Without the last axis it is one field; the terms follow each other.
  axes->pop_back();
  auto raster = nrrd_raster(file, *header, *axes, text.size());
  if (!raster) return raster.error();
  found.raster = std::move(*raster);
  found.raster.lanes *= found.basis.terms();
  return found;
}

}  // namespace palpate::files
