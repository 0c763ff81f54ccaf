#include "tests/lab/bench/inputs.h"

#include "integration/files/frames.h"
#include "integration/files/landmarks.h"
#include "integration/files/read_volume.h"

namespace palpate::bench {

namespace fs = std::filesystem;

Result<studies::MotionCase> read_own_pair(const OwnPair& pair) {
  studies::MotionCase known;
  auto fixed = files::read_volume(pair.fixed);
  if (!fixed) return fixed.error();
  auto moving = files::read_volume(pair.moving);
  if (!moving) return moving.error();
  const Status overlap = files::check_overlap(pair.fixed, fixed->grid, pair.moving, moving->grid);
  if (!overlap) return overlap.error();
  known.id = "own";
  known.name = pair.fixed.filename().string() + " to " + pair.moving.filename().string() + ", " +
               studies::grid_text(fixed->grid);
  known.moving = same_geometry(fixed->grid, moving->grid) ? std::move(*moving)
                                                          : resampled(*moving, fixed->grid);
  known.fixed = std::move(*fixed);
  if (!pair.truth.empty()) {
    auto truth = files::read_field(pair.truth);
    if (!truth) return truth.error();
    known.truth = std::move(*truth);
    if (pair.mask.empty()) return known;
    auto mask = files::read_mask(pair.mask);
    if (!mask) return mask.error();
    known.mask = std::move(*mask);
    return known;
  }
  auto from = files::read_landmarks(pair.landmarks.at(0));
  if (!from) return from.error();
  auto to = files::read_landmarks(pair.landmarks.at(1));
  if (!to) return to.error();
  known.fixed_points_lps_mm = std::move(from->points_lps_mm);
  known.moving_points_lps_mm = std::move(to->points_lps_mm);
  return known;
}

Result<std::optional<studies::MotionCase>> read_known_ct(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "pair_fixed.mha", error)) return std::optional<studies::MotionCase>();
  OwnPair pair{folder / "pair_fixed.mha",
               folder / "pair_moving.mha",
               folder / "pair_truth.mha",
               {},
               folder / "pair_body.mha"};
  auto known = read_own_pair(pair);
  if (!known) return known.error();
  known->id = "ct";
  known->name = "Real chest CT in known motion, " + studies::grid_text(known->fixed.grid);
  return std::optional(std::move(*known));
}

}  // namespace palpate::bench
