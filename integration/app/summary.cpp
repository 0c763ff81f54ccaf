#include "integration/app/summary.h"

#include <fmt/format.h>

namespace palpate::app {

using nlohmann::json;

json json_of(const Spread& spread) {
  return {{"count", spread.count}, {"mean", spread.mean}, {"median", spread.median},
          {"p95", spread.p95},     {"p99", spread.p99},   {"max", spread.max}};
}

json json_of(const Distances& distances) {
  return {{"mm", json_of(distances.mm)},
          {"voxels", json_of(distances.voxels)},
          {"voxels_of_each_axis", json_of(distances.own_voxels)}};
}

json json_of(const Folds& folds) {
  return {{"voxels", folds.voxels},
          {"folded", folds.folded},
          {"min_determinant", folds.min_det},
          {"sd_log_determinant", folds.sd_log_det}};
}

json json_of(const Match& match) {
  return {{"noise_sd_fixed", match.noise_sd_fixed},
          {"noise_sd_moving", match.noise_sd_moving},
          {"difference_sd_before", match.difference_sd_before},
          {"difference_sd_after", match.difference_sd_after},
          {"textured_share_fixed", match.textured_share()},
          {"textured_share_moving", match.textured_share_moving()},
          {"clear_share", match.clear_share()},
          {"correlation_before", match.correlation_before},
          {"correlation_after", match.correlation_after},
          {"mismatched_share", match.mismatched},
          {"motion_left_voxels", match.motion_left_voxels},
          {"moving_share", match.moving_share},
          {"leaving_share", match.leaving}};
}

json json_of(const Evidence& evidence) {
  json result = json::object();
  if (evidence.folds) result["folds"] = json_of(*evidence.folds);
  if (evidence.match) result["match"] = json_of(*evidence.match);
  if (evidence.inverse) result["inverse_consistency"]["structure"] = json_of(*evidence.inverse);
  if (evidence.low_confidence) result["low_confidence_share"] = *evidence.low_confidence;
  if (evidence.within_95_mm) result["within_95_mm"] = *evidence.within_95_mm;
  return result;
}

json json_of(const Verdict& verdict) {
  return {{"word", word(verdict.trust)}, {"reasons", verdict.reasons}, {"passed", verdict.passed}};
}

json json_of(const Grid& grid) {
  json direction = json::array();
  for (int row = 0; row < 3; ++row) {
    direction.push_back({grid.direction[0][row], grid.direction[1][row], grid.direction[2][row]});
  }
  return {{"size", {grid.size.x, grid.size.y, grid.size.z}},
          {"spacing_mm", {grid.spacing_mm.x, grid.spacing_mm.y, grid.spacing_mm.z}},
          {"origin_lps_mm", {grid.origin_mm.x, grid.origin_mm.y, grid.origin_mm.z}},
          {"direction_rows", direction}};
}

json json_of(const SolveReport& report) {
  json levels = json::array();
  for (const LevelReport& level : report.levels) {
    levels.push_back({{"voxel_mm", level.h_mm},
                      {"iterations", level.iterations},
                      {"converged", level.converged},
                      {"seconds", level.seconds},
                      {"brick_iterations", level.brick_iterations},
                      {"brick_iterations_without_skipping", level.all_brick_iterations}});
  }
  return {{"levels", levels},
          {"solve_seconds", report.seconds},
          {"prepare_seconds", report.prepare_seconds},
          {"backward_seconds", report.backward_seconds},
          {"repair_rounds", report.repaired},
          {"folded_cells", report.folded_cells}};
}

json json_of(const CycleDrift& drift) {
  json result = {{"everywhere", json_of(drift.everywhere)}};
  if (drift.structure) result["structure"] = json_of(*drift.structure);
  return result;
}

json json_of(const SequenceEvidence& evidence) {
  json frames = json::array();
  for (size_t k = 0; k < evidence.frames.size(); ++k) {
    const FrameEvidence& frame = evidence.frames[k];
    json entry = {{"frame", k},
                  {"motion_mm", json_of(frame.motion_mm)},
                  {"folds_to_next", json_of(frame.between)},
                  {"from_straight_line_to_next_mm", frame.excursion.mm},
                  {"acceleration_mm_per_frame2", frame.acceleration_mm}};
    if (k != evidence.reference) {
      entry["evidence"] = json_of(frame.evidence);
      if (frame.evidence.match) entry["verdict"] = json_of(judged(frame.evidence));
    }
    frames.push_back(std::move(entry));
  }
  json result = {{"reference_frame", evidence.reference}, {"frames", frames}};
  if (evidence.drift) result["drift"] = json_of(*evidence.drift);
  if (evidence.order)
    result["order"] = {{"to_and_fro", evidence.order->to_and_fro},
                       {"onward", evidence.order->onward}};
  return result;
}

std::string within_text(const Evidence& evidence) {
  if (!evidence.within_95_mm) return {};
  return fmt::format(", expected error below {:.2g} mm at 95 % of the structure",
                     *evidence.within_95_mm);
}

std::string frame_text(const SequenceEvidence& evidence, size_t k) {
  const FrameEvidence& frame = evidence.frames[k];
  std::string line = fmt::format("Frame {}   ", k);
  if (k == evidence.reference)
    line += "the reference";
  else
    line += fmt::format("moves {:.2f} mm on average and {:.2f} mm at most", frame.motion_mm.mean,
                        frame.motion_mm.max);
  if (frame.evidence.folds) line += ", " + folds_text(*frame.evidence.folds);
  if (frame.between.voxels > 0)
    line += frame.between.folded == 0 ? ", none on the way to the next"
                                      : ", on the way to the next " + folds_text(frame.between);
  line += fmt::format(", acceleration {:.2f} mm/frame^2", frame.acceleration_mm);
  if (k == evidence.reference || !frame.evidence.match) return line;
  const Match& match = *frame.evidence.match;
  line += fmt::format(", local correlation {:.3f} -> {:.3f}, {:.3f} voxel of motion left",
                      match.correlation_before, match.correlation_after, match.motion_left_voxels);
  return line + within_text(frame.evidence) + ": " + word(judged(frame.evidence).trust);
}

std::string time_text(const TimeBasis& basis) {
  std::string text = "smooth curves between the frames";
  if (basis.harmonics > 0)
    text = fmt::format("{} {}", basis.harmonics, basis.harmonics == 1 ? "harmonic" : "harmonics");
  return basis.cycle_s > 0.0 ? text + fmt::format(" of a cycle of {:.4g} s", basis.cycle_s) : text;
}

std::string cycle_text(const CycleDrift& drift) {
  const auto numbers = [](const Distances& one) {
    return fmt::format("{:.3f} mm ({:.3f} voxel) from where they started, 95 % within {:.3f} mm",
                       one.mm.mean, one.own_voxels.mean, one.mm.p95);
  };
  if (!drift.structure) return "Cycle     points everywhere end " + numbers(drift.everywhere);
  return fmt::format("Cycle     points where there is structure end {}; everywhere {:.3f} mm",
                     numbers(*drift.structure), drift.everywhere.mm.mean);
}

std::string folds_text(const Folds& folds) {
  if (folds.folded == 0) return "no folds";
  return fmt::format("{} of {} voxels fold", folds.folded, folds.voxels);
}

std::string verdict_text(const Verdict& verdict) {
  std::string text = fmt::format("Verdict   {}", word(verdict.trust));
  for (const std::string& reason : verdict.reasons) text += "\n          - " + reason;
  if (verdict.trust != Trust::kOk) return text;
  for (const std::string& good : verdict.passed) text += "\n          + " + good;
  return text;
}

}  // namespace palpate::app
