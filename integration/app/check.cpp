#include <fmt/format.h>

#include <filesystem>

#include "integration/app/check_sequence.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "integration/app/series_option.h"
#include "integration/app/summary.h"
#include "integration/files/frames.h"
#include "integration/files/landmarks.h"
#include "integration/files/read_volume.h"
#include "integration/files/sentences.h"
#include "integration/opencv/cross_check.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

struct CheckCommand {
  std::vector<fs::path> inputs;  ///< a field, or the motion of a sequence
  fs::path field, fixed, moving, truth, against, mask, points;
  std::vector<fs::path> landmarks;  ///< fixed, moving
  std::vector<fs::path> cycle;      ///< the fields after `field`, up to the one that leads back
  std::vector<int> frames = {0, 1};
  std::vector<fs::path> sequence;  ///< the frames of a sequence whose motion is checked
  std::optional<float> nan_as;
  bool cyclic = false;
  bool opencv = false;
  bool json = false;
};

/// Runs the checks one after the other and reports them as lines and as JSON. Each step returns its
/// error; steps without inputs do nothing.
class Checker {
 public:
  Checker(const CheckCommand& command, Console& console) : command_(command), console_(console) {}

  Status run() {
    for (const auto step : {&Checker::read, &Checker::describe, &Checker::compare_with_truth,
                            &Checker::compare_landmarks, &Checker::compare_points,
                            &Checker::compare_frames, &Checker::go_there_and_back,
                            &Checker::go_around, &Checker::cross_check, &Checker::judge}) {
      if (const Status done = (this->*step)(); !done) return done;
    }
    return Nothing{};
  }

  const nlohmann::json& json() const { return json_; }
  const std::optional<Verdict>& verdict() const { return verdict_; }

 private:
  Status read() {
    files::Notes notes;
    auto field = files::read_field(command_.field, &notes);
    if (!field) return field.error();
    field_ = std::move(*field);
    image_ = field_.grid;
    if (!command_.truth.empty()) {
      auto truth = files::read_field(command_.truth, &notes);
      if (!truth) return truth.error();
      truth_ = std::move(*truth);
      image_ = truth_->grid;
    }
    if (!command_.fixed.empty()) {
      auto fixed = files::read_volume(command_.fixed, &notes, command_.nan_as);
      if (!fixed) return fixed.error();
      auto moving = files::read_volume(command_.moving, &notes, command_.nan_as);
      if (!moving) return moving.error();
      const Status overlap =
          files::check_overlap(command_.fixed, fixed->grid, command_.moving, moving->grid);
      if (!overlap) return overlap.error();
      fixed_ = std::move(*fixed);
      moving_ = std::move(*moving);
      image_ = fixed_->grid;
    }
    if (!command_.against.empty()) {
      auto against = files::read_field(command_.against, &notes);
      if (!against) return against.error();
      against_ = std::move(*against);
    }
    if (!command_.mask.empty()) {
      auto mask = files::read_mask(command_.mask, &notes);
      if (!mask) return mask.error();
      mask_ = resampled(*mask, image_);
      if (std::find(mask_->values.begin(), mask_->values.end(), 1) == mask_->values.end())
        return files::bad_input(command_.mask, "marks no voxel of the image: name another mask");
    }
    if (command_.nan_as && fixed_) {
      auto mask = files::mask_of_numbers({command_.fixed, command_.moving}, *command_.nan_as,
                                         std::move(mask_), &notes);
      if (!mask) return mask.error();
      mask_ = std::move(*mask);
    }
    return say(notes);
  }

  Status say(const files::Notes& notes) {
    for (const std::string& note : notes) console_.say("Note: " + note);
    return Nothing{};
  }

  Status describe() {
    console_.say(fmt::format("{}: {}", command_.field.string(), files::grid_text(field_.grid)));
    if (mask_) console_.say("Distances are taken inside the mask.");
    console_.say(fmt::format("{:56} {:>8} {:>8} {:>8} {:>8} {:>8}", "", "mean", "median", "p95",
                             "p99", "max"));
    const std::optional<Mask> mask = mask_for(field_.grid);
    const Spread motion_mm = lengths_mm(field_, pointer(mask));
    row("Length of the motion, mm", motion_mm);
    json_["field"] = command_.field.string();
    json_["grid"] = json_of(field_.grid);
    json_["motion_mm"] = json_of(motion_mm);
    const Folds all = folds(field_);
    evidence_.folds = all;
    json_["folds"] = json_of(all);
    notes_.push_back(
        fmt::format("Folds: {} (8 corners of {} voxels), smallest determinant {:.3f}, "
                    "SD of log det {:.3f}",
                    all.folded == 0 ? "none" : fmt::format("{}", all.folded), all.voxels,
                    all.min_det, all.sd_log_det));
    return Nothing{};
  }

  Status compare_with_truth() {
    if (!truth_) return Nothing{};
    const std::optional<Mask> mask = mask_for(truth_->grid);
    const auto error = endpoint_error(field_, *truth_, pointer(mask));
    if (!error) return error.error();
    rows("Endpoint error", *error);
    row("Endpoint error, voxels (each axis its own)", error->own_voxels);
    const double covered = covered_share(mask);
    if (covered < 1.0) {
      notes_.push_back(
          fmt::format("Compared with the truth: {:.1f} % of the field (within its grid{})",
                      100.0 * covered, mask ? " and the mask" : ""));
    }
    json_["endpoint_error"] = json_of(*error);
    json_["endpoint_error"]["covered_share"] = covered;
    return Nothing{};
  }

  /// The share of the field's samples that lie within the truth and inside the mask.
  double covered_share(const std::optional<Mask>& on_truth) const {
    const Grid& grid = truth_->grid;
    const Mask counted = on_truth ? *on_truth : Mask{grid, std::vector<uint8_t>(grid.count(), 1)};
    const Mask covered = resampled(counted, field_.grid);
    const auto count = std::count(covered.values.begin(), covered.values.end(), uint8_t(0));
    return 1.0 - double(count) / double(covered.values.size());
  }

  Status compare_landmarks() {
    if (command_.landmarks.empty()) return Nothing{};
    const auto fixed = files::read_landmarks(command_.landmarks[0]);
    if (!fixed) return fixed.error();
    const auto moving = files::read_landmarks(command_.landmarks[1]);
    if (!moving) return moving.error();
    if (fixed->points_lps_mm.size() != moving->points_lps_mm.size()) {
      return files::bad_input(command_.landmarks[1],
                              "has {} points, but '{}' has {}: they must go in pairs",
                              moving->points_lps_mm.size(), command_.landmarks[0].string(),
                              fixed->points_lps_mm.size());
    }
    return registration_error(fixed->points_lps_mm, moving->points_lps_mm);
  }

  Status compare_points() {
    if (command_.points.empty()) return Nothing{};
    const auto fixed = files::read_followed_points(command_.points, command_.frames[0]);
    if (!fixed) return fixed.error();
    const auto moving = files::read_followed_points(command_.points, command_.frames[1]);
    if (!moving) return moving.error();
    points_ = fixed->points_lps_mm;
    return registration_error(fixed->points_lps_mm, moving->points_lps_mm);
  }

  Status registration_error(const std::vector<glm::dvec3>& fixed,
                            const std::vector<glm::dvec3>& moving) {
    const auto error = target_registration_error_mm(field_, fixed, moving);
    if (!error) return error.error();
    const auto before = target_registration_error_mm(still_field(field_.grid), fixed, moving);
    if (!before) return before.error();
    row(fmt::format("Target registration error, mm ({} points)", fixed.size()), *error);
    row("  the same without motion correction, mm", *before);
    json_["target_registration_error_mm"] = json_of(*error);
    json_["target_registration_error_without_correction_mm"] = json_of(*before);
    return Nothing{};
  }

  Status compare_frames() {
    if (!fixed_) return Nothing{};
    auto evidence = examined(*fixed_, *moving_, field_, against_ ? &*against_ : nullptr, nullptr,
                             pointer(mask_), &structure_);
    if (!evidence) return evidence.error();
    evidence_ = std::move(*evidence);
    const Match& match = *evidence_.match;
    notes_.push_back(fmt::format(
        "Frames: mean local correlation {:.3f} -> {:.3f}, {:.1f} % of the structure without a "
        "match, {:.3f} voxels of motion left",
        match.correlation_before, match.correlation_after, 100.0 * match.mismatched,
        match.motion_left_voxels));
    notes_.push_back(
        fmt::format("        SD of the difference {:.4g} -> {:.4g}, of the noise {:.4g} "
                    "and {:.4g}",
                    match.difference_sd_before, match.difference_sd_after, match.noise_sd_fixed,
                    match.noise_sd_moving));
    json_["match"] = json_of(match);
    return Nothing{};
  }

  Status go_there_and_back() {
    if (!against_) return Nothing{};
    const auto everywhere = inverse_consistency(field_, *against_, image_, pointer(mask_));
    if (!everywhere) return everywhere.error();
    rows("Inverse consistency, everywhere", *everywhere);
    json_["inverse_consistency"]["everywhere"] = json_of(*everywhere);
    if (!evidence_.inverse) return Nothing{};
    rows("Inverse consistency, where there is structure", *evidence_.inverse);
    json_["inverse_consistency"]["structure"] = json_of(*evidence_.inverse);
    return Nothing{};
  }

  Status go_around() {
    if (command_.cycle.empty()) return Nothing{};
    std::vector<Field> fields = {field_};
    for (const fs::path& file : command_.cycle) {
      auto next = files::read_field(file);
      if (!next) return next.error();
      fields.push_back(std::move(*next));
    }
    const std::optional<Mask> mask = mask_for(field_.grid);
    const auto everywhere = cycle_drift(fields, field_.grid, pointer(mask));
    if (!everywhere) return everywhere.error();
    CycleDrift drift{*everywhere, {}};
    rows("Drift after the cycle, everywhere", drift.everywhere);
    if (fixed_ && evidence_.match->clear > 0) {
      const auto found = cycle_drift(fields, fixed_->grid, &structure_);
      if (!found) return found.error();
      drift.structure = *found;
      rows("Drift after the cycle, where there is structure", *drift.structure);
    }
    evidence_.drift = drift.judged();
    notes_.push_back(cycle_text(drift));
    json_["cycle_drift"] = json_of(drift);
    if (points_.empty()) return Nothing{};
    const auto of_points = cycle_drift_mm(fields, points_);
    if (!of_points) return of_points.error();
    row("Drift of the points, mm", *of_points);
    json_["cycle_drift_of_points_mm"] = json_of(*of_points);
    return Nothing{};
  }

  Status cross_check() {
    if (!command_.opencv) return Nothing{};
    const auto cross = opencv::cross_check(*fixed_, *moving_, field_, {}, pointer(mask_));
    if (!cross) return cross.error();
    auto list = nlohmann::json::array();
    for (const opencv::FlowComparison& one : cross->comparisons) {
      row(fmt::format("OpenCV {} across axis {}, voxels ({:.0f} % compared)", name(one.method),
                      one.normal_axis, 100.0 * one.share()),
          one.difference.voxels);
      list.push_back({{"method", name(one.method)},
                      {"normal_axis", one.normal_axis},
                      {"slices", one.slices},
                      {"compared_share", one.share()},
                      {"median_motion_voxels", one.motion_voxels},
                      {"difference", json_of(one.difference)}});
    }
    notes_.push_back("OpenCV: " + cross->summary);
    const char* words[] = {"agree", "disagree", "can not tell"};
    json_["opencv"] = {{"agreement", words[int(cross->agreement)]},
                       {"compared_share", cross->share_compared},
                       {"summary", cross->summary},
                       {"comparisons", list}};
    return Nothing{};
  }

  Status judge() {
    for (const std::string& note : notes_) console_.say(note);
    if (!fixed_) return Nothing{};
    verdict_ = judged(evidence_);
    json_["verdict"] = json_of(*verdict_);
    console_.say(verdict_text(*verdict_));
    return Nothing{};
  }

  void row(const std::string& title, const Spread& spread) {
    console_.say(fmt::format("{:56} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f}", title, spread.mean,
                             spread.median, spread.p95, spread.p99, spread.max));
  }
  void rows(const std::string& title, const Distances& distances) {
    row(title + ", mm", distances.mm);
    row(title + ", voxels (finest axis)", distances.voxels);
  }

  std::optional<Mask> mask_for(const Grid& grid) const {
    return mask_ ? std::optional(resampled(*mask_, grid)) : std::nullopt;
  }
  static const Mask* pointer(const std::optional<Mask>& mask) { return mask ? &*mask : nullptr; }

  const CheckCommand& command_;
  Console& console_;
  Field field_;
  /// on which distances are measured: that of fixed, else of truth, else of the field
  Grid image_;
  std::optional<Volume> fixed_, moving_;
  std::optional<Field> truth_, against_;
  std::optional<Mask> mask_;
  Mask structure_;  ///< voxels where the frames show structure
  std::vector<glm::dvec3> points_;
  std::vector<std::string> notes_;  ///< lines to print after the table
  Evidence evidence_;
  std::optional<Verdict> verdict_;
  nlohmann::json json_;
};

/// The first given option that does not apply to a whole sequence, or null.
const char* option_of_one_field(const CheckCommand& command) {
  if (!command.fixed.empty()) return "--fixed";
  if (!command.moving.empty()) return "--moving";
  if (!command.truth.empty()) return "--truth";
  if (!command.against.empty()) return "--against";
  if (!command.landmarks.empty()) return "--landmarks";
  if (!command.cycle.empty()) return "--cycle";
  return command.opencv ? "--opencv" : nullptr;
}

int run(CheckCommand command) {
  Console console(false, command.json);
  if (tells_a_sequence(command.inputs)) {
    if (const char* other = option_of_one_field(command))
      return fail(console, {ErrorKind::kBadInput,
                            fmt::format("{} is for a single field: name one, or leave it out; the "
                                        "frames of a sequence are named with --sequence",
                                        other)});
    return check_sequence({command.inputs, command.sequence, command.mask, command.points,
                           command.nan_as, command.cyclic, command.json},
                          console);
  }
  if (!command.sequence.empty())
    return fail(console, {ErrorKind::kBadInput,
                          "--sequence is for the motion of a whole sequence: name what 'palpate "
                          "motion' wrote, or --fixed and --moving for a single field"});
  command.field = command.inputs.front();
  if (command.fixed.empty() != command.moving.empty() || (command.opencv && command.fixed.empty()))
    return fail(console, {ErrorKind::kBadInput, "Name both frames, --fixed and --moving"});
  Checker checker(command, console);
  if (const Status done = checker.run(); !done) return fail(console, done.error());
  if (command.json) fmt::print("{}\n", checker.json().dump(2));
  return checker.verdict() ? exit_code(checker.verdict()->trust) : int(kExitOk);
}

}  // namespace

Command add_check(CLI::App& program) {
  auto command = std::make_shared<CheckCommand>();
  CLI::App* app = program.add_subcommand(
      "check",
      "Measure how good a field or the motion of a sequence is; with the frames, say whether to "
      "trust it");
  app->add_option("field", command->inputs,
                  "Displacement field, mm, LPS (ITK's); or the motion of a sequence: the folder "
                  "that 'palpate motion' filled, its sequence_motion.nrrd, all of its "
                  "reference_to_* or all of its motion_*")
      ->type_name("PATH")
      ->required();
  app->add_option("--sequence", command->sequence,
                  "The frames, as in 'palpate motion': what is left of the motion in each")
      ->type_name("PATH");
  add_series_option(*app, command->sequence);
  app->add_flag("--cyclic", command->cyclic,
                "The last frame of reference_to_* leads back to the first");
  app->add_option("--fixed", command->fixed, "The fixed frame")->type_name("FILE");
  app->add_option("--moving", command->moving, "The moving frame")->type_name("FILE");
  app->add_option("--truth", command->truth, "The true field: endpoint error")->type_name("FILE");
  app->add_option("--landmarks", command->landmarks,
                  "Points in the fixed and in the moving frame (.csv, .fcsv): target error")
      ->type_name("FILE")
      ->expected(2);
  app->add_option("--points", command->points,
                  "Points followed through all frames, columns x0,y0,z0,x1,...: target error")
      ->type_name("FILE");
  app->add_option("--frames", command->frames, "Which frames of --points are fixed and moving")
      ->expected(2)
      ->check(whole_number_in(0, 1'000'000))
      ->capture_default_str();
  app->add_option("--against", command->against,
                  "The inverse, or a field from moving to fixed: inverse consistency")
      ->type_name("FILE");
  app->add_option("--cycle", command->cycle, "The fields that follow and lead back: cycle drift")
      ->type_name("FILE");
  app->add_option("--mask", command->mask, "Where distances are taken")->type_name("FILE");
  add_nan_as(*app, command->nan_as, " in the frames; those voxels then count for nothing");
  app->add_flag("--opencv", command->opencv, "Also compare with OpenCV's optical flow");
  app->add_flag("--json", command->json, "Print JSON on stdout, lines on stderr");
  return {app,
          [command] { return run(*command); },
          {"field", "--fixed", "--moving", "--truth", "--landmarks", "--points", "--against",
           "--cycle", "--mask", "--sequence"},
          {},
          {}};
}

}  // namespace palpate::app
