#include "integration/app/check_sequence.h"

#include <fmt/format.h>

#include <algorithm>

#include "compute/motion/estimate_sequence.h"
#include "compute/motion/sequence_quality.h"
#include "compute/volume/sequence.h"
#include "integration/app/exit_code.h"
#include "integration/app/sequence_output.h"
#include "integration/app/summary.h"
#include "integration/files/frames.h"
#include "integration/files/landmarks.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/read_volume.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kStep = "motion_", kFromReference = "reference_to_";

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

/// Files in a folder whose names begin with the prefix, "frame2" before "frame10".
std::vector<fs::path> fields_in(const fs::path& folder, std::string_view prefix) {
  std::vector<fs::path> fields;
  for (const fs::path& image : files::images_in(folder))
    if (image.filename().string().starts_with(prefix)) fields.push_back(image);
  return fields;
}

/// The motion to check, from any of its forms.
struct CheckedMotion {
  SequenceMotion motion;
  std::string form;          ///< for the user
  std::vector<Field> steps;  ///< the fields from frame to frame, if these were given
};

Result<std::vector<Field>> read_fields(const std::vector<fs::path>& files) {
  std::vector<Field> fields;
  for (const fs::path& file : files) {
    auto field = files::read_field(file);
    if (!field) return field.error();
    if (!fields.empty() && !same_geometry(field->grid, fields.front().grid))
      return files::bad_input(file, "has another grid than '{}': name the fields of one sequence",
                              files.front().string());
    fields.push_back(std::move(*field));
  }
  return fields;
}

/// The name motion_7_to_0 belongs to the field back to the first frame.
bool leads_back(const fs::path& file) {
  const std::string stem = file.filename().string();
  const size_t to = stem.find("_to_");
  if (to == std::string::npos) return false;
  const std::string number = stem.substr(to + 4, stem.find('.', to) - to - 4);
  return !number.empty() && number.find_first_not_of('0') == std::string::npos;
}

Result<CheckedMotion> read_told(const SequenceCheck& command, const std::vector<double>& times_s) {
  std::vector<fs::path> inputs = command.inputs;
  if (inputs.size() == 1 && is_folder(inputs.front())) {
    const fs::path folder = inputs.front();
    const fs::path whole = folder / files::kSequenceMotionName;
    inputs = {whole};
    if (!files::holds_sequence_motion(whole)) inputs = fields_in(folder, kStep);
    if (inputs.empty()) inputs = fields_in(folder, kFromReference);
    if (inputs.empty())
      return files::bad_input(folder,
                              "holds no motion of a sequence: name the folder that 'palpate "
                              "motion' filled");
  }
  CheckedMotion told;
  if (inputs.size() == 1 && files::holds_sequence_motion(inputs.front())) {
    auto motion = files::read_sequence_motion(inputs.front());
    if (!motion) return motion.error();
    told.motion = std::move(*motion);
    told.form = "one motion";
    return told;
  }
  if (inputs.size() < 2)
    return files::bad_input(inputs.front(),
                            "is one field, but a sequence has several: name them all, or check it "
                            "with --fixed and --moving");
  auto fields = read_fields(inputs);
  if (!fields) return fields.error();
  const bool from_reference = inputs.front().filename().string().starts_with(kFromReference);
  const size_t frames =
      from_reference ? fields->size() : fields->size() + (leads_back(inputs.back()) ? 0 : 1);
  const std::vector<double> times = times_s.empty() ? assumed_times(frames) : times_s;
  if (times.size() != frames)
    return files::bad_input(inputs.front(),
                            "and the others are {} fields for {} frames, but the sequence has {}: "
                            "name all fields of this sequence",
                            fields->size(), frames, times.size());
  if (!from_reference) {
    told.motion = chained(*fields, times);
    told.steps = std::move(*fields);
    told.form = "fields from frame to frame, followed from frame 0";
    return told;
  }
  told.form = "fields from the reference";
  for (const double time_s : times) told.motion.basis.times_s.push_back(time_s - times.front());
  if (command.cyclic) told.motion.basis.cycle_s = cycle_of(times);
  double least_mm = 1e300;
  for (size_t k = 0; k < frames; ++k) {
    const double mm = lengths_mm((*fields)[k]).mean;
    if (mm >= least_mm) continue;
    least_mm = mm;
    told.motion.reference = k;
  }
  told.motion.terms = std::move(*fields);
  return told;
}

/// Mean error of the tracked points in each frame, from the reference.
Result<std::vector<Spread>> point_errors(const SequenceMotion& motion, const fs::path& file) {
  const auto from = files::read_followed_points(file, int(motion.reference));
  if (!from) return from.error();
  std::vector<Spread> errors;
  for (size_t k = 0; k < motion.frames(); ++k) {
    const auto to = files::read_followed_points(file, int(k));
    if (!to) return to.error();
    const auto error =
        target_registration_error_mm(motion.at_frame(k), from->points_lps_mm, to->points_lps_mm);
    if (!error) return error.error();
    errors.push_back(*error);
  }
  return errors;
}

/// The frames that the motion is compared with; without any if none were named.
struct CheckedFrames {
  std::vector<Volume> frames;
  std::vector<double> times_s;
  std::string ordered_by;
};

Result<CheckedFrames> read_sequence_of(const SequenceCheck& command, Console& console) {
  if (command.sequence.empty()) return CheckedFrames();
  auto opened = files::open_sequence(command.sequence, command.nan_as);
  if (!opened) return opened.error();
  for (const std::string& note : opened->notes) console.say("Note: " + note);
  auto kept = all_frames(*opened, {});
  if (!kept) return kept.error();
  const size_t count = kept->size();
  return CheckedFrames{std::move(*kept),
                       opened->times_s.empty() ? assumed_times(count) : opened->times_s,
                       opened->ordered_by};
}

/// The user's mask on the image's grid, without what is NaN in a frame.
Result<std::optional<Mask>> mask_on(const SequenceCheck& command, const Grid& image,
                                    bool has_frames, Console& console) {
  std::optional<Mask> mask;
  if (!command.mask.empty()) {
    const auto read = files::read_mask(command.mask);
    if (!read) return read.error();
    mask = resampled(*read, image);
  }
  if (!command.nan_as || !has_frames) return mask;
  std::vector<std::string> notes;
  auto numbers = files::mask_of_numbers(command.sequence, *command.nan_as, std::move(mask), &notes);
  if (!numbers) return numbers.error();
  for (const std::string& note : notes) console.say("Note: " + note);
  return numbers;
}

Result<std::optional<Verdict>> checked(const SequenceCheck& command, Console& console,
                                       nlohmann::json& out) {
  const auto sequence = read_sequence_of(command, console);
  if (!sequence) return sequence.error();
  const std::vector<Volume>& frames = sequence->frames;
  const auto told = read_told(command, sequence->times_s);
  if (!told) return told.error();
  const SequenceMotion& motion = told->motion;
  if (!frames.empty() && frames.size() != motion.frames())
    return files::bad_input(command.inputs.front(),
                            "is the motion of {} frames, but the sequence has {}: name its own "
                            "sequence",
                            motion.frames(), frames.size());
  const Grid& image = frames.empty() ? motion.terms.front().grid : frames.front().grid;
  const auto mask_read = mask_on(command, image, !frames.empty(), console);
  if (!mask_read) return mask_read.error();
  const Mask* const mask = *mask_read ? &**mask_read : nullptr;
  console.say(fmt::format("{}: {} of {} frames, reference frame {}, {}",
                          command.inputs.front().string(), told->form, motion.frames(),
                          motion.reference, time_text(motion.basis)));
  auto evidence = examined(motion, frames, {}, mask, [&](const SequenceEvidence& so_far, size_t k) {
    console.say(frame_text(so_far, k));
  });
  if (!evidence) return evidence.error();
  evidence->ordered_by = sequence->ordered_by;
  // For given frame-to-frame fields the drift is their own.
  if (!told->steps.empty() && motion.basis.cycle_s > 0.0) {
    const auto drift = cycle_drift(told->steps, image, mask);
    if (!drift) return drift.error();
    evidence->drift = *drift;
  } else if (motion.basis.cycle_s > 0.0) {
    evidence->drift = drift_of(motion, image, mask);
  }
  if (evidence->drift) console.say(cycle_text({*evidence->drift, {}}));
  out["motion"] = {{"file", command.inputs.front().string()},
                   {"form", told->form},
                   {"frames", motion.frames()},
                   {"harmonics", motion.basis.harmonics},
                   {"cycle_s", motion.basis.cycle_s}};
  out["evidence"] = json_of(*evidence);
  if (!command.points.empty()) {
    const auto errors = point_errors(motion, command.points);
    if (!errors) return errors.error();
    double sum = 0.0;
    for (size_t k = 0; k < errors->size(); ++k) {
      out["target_registration_error_mm"].push_back(json_of((*errors)[k]));
      if (k != motion.reference) sum += (*errors)[k].mean;
    }
    console.say(
        fmt::format("Points    {:.3f} mm from where they are known to be, on average over "
                    "the other frames",
                    sum / double(errors->size() - 1)));
  }
  if (frames.empty()) return std::optional<Verdict>();
  const Verdict verdict = judged(*evidence);
  out["verdict"] = json_of(verdict);
  console.say(verdict_text(verdict));
  return std::optional(verdict);
}

}  // namespace

bool tells_a_sequence(const std::vector<fs::path>& inputs) {
  return inputs.size() > 1 || is_folder(inputs.front()) ||
         files::holds_sequence_motion(inputs.front());
}

int check_sequence(const SequenceCheck& command, Console& console) {
  nlohmann::json out;
  const auto verdict = checked(command, console, out);
  if (!verdict) return fail(console, verdict.error());
  if (command.json) fmt::print("{}\n", out.dump(2));
  return *verdict ? exit_code((*verdict)->trust) : int(kExitOk);
}

}  // namespace palpate::app
