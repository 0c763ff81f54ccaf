#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "compute/volume/memory.h"
#include "integration/app/cancel.h"
#include "integration/app/choice/front_file.h"
#include "integration/app/choice/quantity.h"
#include "integration/app/commands.h"
#include "integration/app/delivery.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/motion_page.h"
#include "integration/app/option_checks.h"
#include "integration/app/overwrite.h"
#include "integration/app/sequence_output.h"
#include "integration/app/series_option.h"
#include "integration/app/summary.h"
#include "integration/files/atomic_file.h"
#include "integration/files/frames.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/files/sentences.h"
#include "integration/files/sequence_motion_file.h"
#include "integration/running/session_options.h"
#include "integration/web/web_page.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSummaryName = "summary.json";

struct MotionCommand {
  std::vector<fs::path> inputs;
  fs::path output;
  std::string model;  ///< sequence or pairwise; empty: sequence for three frames or more
  std::string preset = "balanced";
  std::string within, most_error;  ///< deadline or error by which to choose the setting
  std::string format = "mha";
  fs::path mask;
  fs::path page;
  DeviceOptions device;
  int iterations = 0;
  int levels = 0;
  std::optional<float> nan_as;
  double frames_per_second = 0.0;  ///< 0: the file's times
  bool cyclic = false;
  bool inverse = false;
  bool confidence = false;
  bool coarse = false;
  bool pictures = false;
  bool no_verdict = false;
  bool json = false;
  bool quiet = false;

  bool chooses() const { return !within.empty() || !most_error.empty(); }
  /// Two files and the name of an image: one field. Everything else writes into a folder.
  bool is_pair() const {
    std::error_code error;
    return inputs.size() == 2 && !fs::is_directory(output, error) && output.has_extension();
  }
  /// One motion for all frames, or only fields of consecutive frames.
  bool is_whole(size_t frames) const {
    return !is_pair() && (model.empty() ? frames > 2 : model == "sequence");
  }
};

std::string joined_presets() {
  std::string names;
  for (const std::string_view preset : kMotionPresets)
    names += (names.empty() ? "" : ", ") + std::string(preset);
  return names;
}

/// Refuses values of these options that can not be parsed, before any file is read.
Status check_wish(const MotionCommand& command) {
  if (!command.within.empty())
    if (const auto seconds = parse_seconds(command.within); !seconds) return seconds.error();
  if (!command.most_error.empty())
    if (const auto mm = parse_millimetres(command.most_error); !mm) return mm.error();
  return Nothing{};
}

Result<MotionOptions> motion_options(const MotionCommand& command) {
  auto options = motion_preset(command.preset);
  if (!options) {
    return Error{ErrorKind::kBadInput, fmt::format("There is no preset '{}': choose one of {}",
                                                   command.preset, joined_presets())};
  }
  if (command.levels > 0) options->coarse_levels = command.levels;
  for (LevelOptions& level : options->levels) {
    if (command.iterations > 0) level.iterations = command.iterations;
  }
  return *options;
}

/// "u.nii.gz" -> "u" and ".nii.gz".
std::pair<std::string, std::string> stem_and_ending(const fs::path& file) {
  const std::string name = file.filename().string();
  const size_t length = name.ends_with(".nii.gz") ? 7 : file.extension().string().size();
  return {name.substr(0, name.size() - length), name.substr(name.size() - length)};
}

PairNames names_of_pair(const MotionCommand& command) {
  const auto [stem, ending] = stem_and_ending(command.output);
  PairNames names;
  names.field = stem + ending;
  if (command.inverse) names.inverse = stem + "_inverse" + ending;
  if (command.confidence) {
    names.confidence = stem + "_confidence" + ending;
    names.deviation = stem + "_deviation" + ending;
  }
  if (command.pictures) names.picture = stem + ".png";
  return names;
}

PairNames names_in_sequence(const MotionCommand& command, size_t count, size_t fixed,
                            size_t moving) {
  const size_t width = std::to_string(count - 1).size();
  const std::string there = fmt::format("{:0{}}_to_{:0{}}", fixed, width, moving, width);
  const std::string back = fmt::format("{:0{}}_to_{:0{}}", moving, width, fixed, width);
  PairNames names;
  names.field = "motion_" + there + "." + command.format;
  if (command.inverse) names.inverse = "inverse_" + back + "." + command.format;
  if (command.confidence) {
    names.confidence = "confidence_" + there + "." + command.format;
    names.deviation = "deviation_" + there + "." + command.format;
  }
  if (command.pictures) names.picture = "motion_" + there + ".png";
  return names;
}

/// Finds errors that can be known before anything is read.
Status check_output_name(const MotionCommand& command) {
  if (command.is_pair() && command.cyclic) {
    return files::bad_output(command.output,
                             "names one file, but a cycle of two frames gives two fields: name a "
                             "folder");
  }
  if (command.is_pair() && command.model == "sequence") {
    return files::bad_output(command.output,
                             "names one file, but the motion of a sequence takes several: name a "
                             "folder");
  }
  if (command.is_pair()) return files::check_can_write_image(command.output);
  if (files::has_image_ending(command.output)) {
    return files::bad_output(command.output,
                             "names one file, but a sequence gives a field per pair of frames: "
                             "name a folder");
  }
  return files::check_can_write_folder(command.output);
}

/// The same for the page.
Status check_page(const MotionCommand& command) {
  if (command.page.empty()) return Nothing{};
  return web::check_can_write_page(command.page);
}

/// No output file may be an input, or lie among the listed frames: the next run on the same folder
/// would take the fields for frames.
Status check_names(const MotionCommand& command, size_t frame_count) {
  std::vector<fs::path> inputs = command.inputs, outputs;
  inputs.push_back(command.mask);
  std::error_code error;
  if (!command.is_pair() && command.inputs.size() > 1)
    for (const fs::path& input : command.inputs)
      if (fs::equivalent(input.has_parent_path() ? input.parent_path() : ".", command.output,
                         error))
        return files::bad_output(
            command.output,
            "holds the frames: their fields would lie among them; name another "
            "folder");
  const fs::path folder = command.is_pair() ? command.output.parent_path() : command.output;
  for (size_t k = 0; k + (command.cyclic ? 0 : 1) < frame_count; ++k) {
    const PairNames names = command.is_pair()
                                ? names_of_pair(command)
                                : names_in_sequence(command, frame_count, k, (k + 1) % frame_count);
    for (const std::string& name :
         {names.field, names.inverse, names.confidence, names.deviation, names.picture})
      if (!name.empty()) outputs.push_back(folder / name);
  }
  if (!command.is_pair()) outputs.push_back(folder / kSummaryName);
  if (!command.page.empty()) outputs.push_back(command.page);
  const fs::path whole = folder / files::kSequenceMotionName;
  if (command.is_whole(frame_count)) {
    outputs.push_back(whole);
    for (size_t k = 0; k < frame_count; ++k)
      outputs.push_back(folder / reference_field_name(command.format, k, frame_count));
  } else if (!command.is_pair() && fs::exists(whole, error)) {
    // Readers of the folder would take that file for the motion of these frames.
    return files::bad_output(whole,
                             "is the motion of a whole sequence, which these fields would lie "
                             "beside: name another folder, or remove it");
  }
  return check_overwrites(inputs, outputs);
}

double bytes_to_write(const MotionCommand& command, const Frames& frames) {
  const double fields = double(frames.count - (command.cyclic ? 0 : 1)) +
                        (command.is_whole(frames.count) ? 2.0 * double(frames.count) : 0.0);
  const double per_voxel =
      12.0 + (command.inverse ? 12.0 : 0.0) + (command.confidence ? 12.0 : 0.0);
  // A cell of the solved grid is at least two voxels wide.
  return fields * per_voxel * double(frames.grid.count()) / (command.coarse ? 8.0 : 1.0);
}

/// Where the fields go; where only those on the image's grid have no room, the sentence says so.
Result<Outputs> outputs_for(MotionCommand command, const Frames& frames) {
  const fs::path folder = command.is_pair() ? command.output.parent_path() : command.output;
  auto outputs = Outputs::into(folder, bytes_to_write(command, frames));
  if (outputs || command.coarse) return outputs;
  command.coarse = true;
  if (!Outputs::into(folder, bytes_to_write(command, frames))) return outputs;
  Error error = outputs.error();
  error.message += "; or add --coarse, with which the fields take an eighth of it";
  return error;
}

/// The part of the summary that every run has.
nlohmann::json summary_of(const MotionCommand& command, const std::string& preset,
                          const Frames& frames, const vulkan::Context& context) {
  nlohmann::json summary = {{"program", "palpate " PALPATE_VERSION},
                            {"input", frames.name},
                            {"preset", preset},
                            {"model", command.is_whole(frames.count) ? "sequence" : "pairwise"},
                            {"cyclic", command.cyclic},
                            {"device", context.info().name},
                            {"peak_device_memory_bytes", context.memory_peak_bytes()},
                            {"frame_count", frames.count},
                            {"grid", json_of(frames.grid)},
                            {"convention",
                             "displacement fields in mm, LPS: the material at x of the fixed frame "
                             "is at x + u(x) in the moving frame"}};
  if (!frames.times_s.empty()) summary["times_s"] = frames.times_s;
  if (!frames.notes.empty()) summary["notes"] = frames.notes;
  return summary;
}

nlohmann::json summary_of(const MotionCommand& command, const std::string& preset,
                          const Frames& frames, const vulkan::Context& context,
                          const Delivery& delivery) {
  nlohmann::json summary = summary_of(command, preset, frames, context);
  summary["pairs"] = delivery.pairs();
  if (delivery.drift()) summary["cycle_drift"] = json_of(*delivery.drift());
  if (!command.no_verdict) summary["verdict"] = json_of(delivery.verdict());
  return summary;
}

Status write_summary(Outputs& outputs, const nlohmann::json& summary) {
  const auto path = outputs.stage(kSummaryName);
  if (!path) return path.error();
  const Status written = files::write_text(*path, summary.dump(2) + "\n");
  return written ? written : Status(outputs.in_place(written.error()));
}

/// Prints the last lines: where the result is, and the verdict. A verdict that is not ok is printed
/// even if quiet.
int conclude(const MotionCommand& command, double slowest_s, const std::optional<Verdict>& verdict,
             const nlohmann::json& summary, Console& console) {
  console.say(fmt::format("Wrote     {}", command.output.string()));
  if (!command.within.empty()) {
    const double limit_s = *parse_seconds(command.within);
    if (slowest_s > limit_s) {
      console.say(fmt::format(
          "Late      a pair took {:.2f} s, not the {:.3g} s asked for: the machine was busier than "
          "when 'palpate chart motion' measured it; measure again, or allow more time",
          slowest_s, limit_s));
    }
  }
  if (command.json) fmt::print("{}\n", summary.dump(2));
  if (!verdict) return kExitOk;
  const std::string text = verdict_text(*verdict);
  if (command.quiet && verdict->trust != Trust::kOk) {
    console.complain(text);
  } else {
    console.say(text);
  }
  return exit_code(verdict->trust);
}

/// What the page says of every run; the summary has the same numbers for programs.
MotionPage::PageWords page_words(const MotionCommand& command, const std::string& preset,
                                 const Frames& frames, const vulkan::Context& context) {
  MotionPage::PageWords words;
  words.title = "Motion of " + files::sequence_name(command.inputs);
  words.subtitle = files::frames_text(frames);
  words.times_s = frames.times_s;
  if (command.cyclic && frames.times_s.size() > 1) words.cycle_s = cycle_of(frames.times_s);
  words.facts = {{"Frames", files::frames_text(frames)},
                 {"Preset", preset},
                 {"Device", context.info().name},
                 {"Program", "palpate " PALPATE_VERSION},
                 {"Fields", command.output.string()}};
  for (const std::string& note : frames.notes) words.facts.push_back({"Note", note});
  return words;
}

/// Results of a run before anything is published.
struct MotionResults {
  nlohmann::json summary;
  std::optional<Verdict> verdict;
  double slowest_s = 0.0;  ///< of all pairs
  std::optional<MotionPage> page;
  MotionPage::PageWords words;  ///< of the page
};

/// Fields of consecutive frames; each is written and judged while the next one is estimated.
Result<MotionResults> find_pairs(const MotionCommand& command, const std::string& preset,
                                 Frames& frames, const std::shared_ptr<vulkan::Context>& context,
                                 const EstimatorOptions& estimator, Outputs& outputs,
                                 Console& console, std::stop_token stop) {
  EstimationJob job{frames.grid, frames.count, frames.read, estimator};
  job.options.backward = !command.no_verdict;
  job.keeps_frames = !is_much_memory(2.0 * sizeof(float) * double(frames.grid.count()));
  DeliveryOptions options;
  options.names = [&](size_t fixed, size_t moving) {
    return command.is_pair() ? names_of_pair(command)
                             : names_in_sequence(command, frames.count, fixed, moving);
  };
  options.coarse = command.coarse;
  options.judge = !command.no_verdict;
  options.cyclic = command.cyclic;
  options.ordered_by = frames.ordered_by;
  options.mask = estimator.mask ? &*estimator.mask : nullptr;
  MotionResults found;
  if (!command.page.empty()) options.page = &found.page.emplace(frames.grid, frames.count);
  Delivery delivery(options, outputs, console);
  std::shared_ptr<const Volume> last;
  Status done = estimate(
      context, job,
      [&](EstimatedPair pair) {
        last = pair.moving;
        return delivery.take(pair);
      },
      console, stop);
  if (done) done = delivery.close_cycle();
  if (!done) return done.error();
  if (found.page) {
    // In a cycle the last pair leads back to the first frame, which is there already.
    if (!command.cyclic) found.page->add_frame(resampled(*last, frames.grid));
    found.words = page_words(command, preset, frames, *context);
    if (command.is_pair()) found.words.names = {"fixed", "moving"};
    if (!command.is_pair()) found.words.curves = delivery.curves();
  }
  found.summary = summary_of(command, preset, frames, *context, delivery);
  found.slowest_s = delivery.slowest_s();
  if (options.judge) found.verdict = delivery.verdict();
  return found;
}

std::string sequence_text(const SequenceMotion& motion, double seconds) {
  return fmt::format("Motion    one for all {} frames, reference frame {}, {}, {:.1f} s",
                     motion.frames(), motion.reference, time_text(motion.basis), seconds);
}

/// What a page draws over the frames: how far all are from the reference, and how well they match.
std::vector<MotionPage::FrameCurve> curves_of(const SequenceEvidence& evidence) {
  const std::string motion = fmt::format("Motion from frame {} (mm)", evidence.reference);
  const std::string match = "Local correlation with the reference";
  std::vector<MotionPage::FrameCurve> curves = {{motion, "mean", {}},
                                                {motion, "95th percentile", {}},
                                                {match, "before", {}},
                                                {match, "after", {}}};
  for (size_t k = 0; k < evidence.frames.size(); ++k) {
    const FrameEvidence& frame = evidence.frames[k];
    // The reference is not compared with itself.
    const bool compared = frame.evidence.match && k != evidence.reference;
    curves[0].y.push_back(frame.motion_mm.mean);
    curves[1].y.push_back(frame.motion_mm.p95);
    curves[2].y.push_back(compared ? frame.evidence.match->correlation_before : NAN);
    curves[3].y.push_back(compared ? frame.evidence.match->correlation_after : NAN);
  }
  return curves;
}

/// Puts the frames, and the steps between them, into the page.
void fill(MotionPage& page, const SequenceMotion& motion, const std::vector<Volume>& frames,
          const std::vector<Confidence>& step_confidence) {
  for (size_t k = 0; k < frames.size(); ++k) {
    page.add_frame(frames[k]);
    const bool has_next = motion.basis.cycle_s > 0.0 || k + 1 < frames.size();
    if (has_next) page.add_step(consecutive_field(motion, k), step_confidence[k]);
  }
}

/// The verdict on one motion for all frames, for people and for the summary.
void conclude_whole(const SequenceEvidence& evidence, MotionResults& found, Console& console) {
  found.verdict = judged(evidence);
  found.summary["evidence"] = json_of(evidence);
  if (evidence.drift) console.say(cycle_text({*evidence.drift, {}}));
  found.words.curves = curves_of(evidence);
  found.summary["verdict"] = json_of(*found.verdict);
}

/// One motion for all frames, and what was met on the way.
struct WholeMotion {
  std::vector<Volume> frames;
  SequenceMotion motion;
  SequenceReport report;
  std::vector<Confidence> step_confidence;
  double seconds = 0.0, slowest_s = 0.0;  ///< of all, of the slowest pair
  std::string text;                       ///< what was found, for people
};

/// Reads the frames and estimates their motion; says what was found. kCancelled after a stop.
Result<WholeMotion> estimated_whole(Frames& frames, const std::shared_ptr<vulkan::Context>& context,
                                    const EstimatorOptions& estimator, Console& console,
                                    std::stop_token stop) {
  WholeMotion whole;
  auto kept = all_frames(frames, stop);
  if (!kept) return kept.error();
  if (stop.stop_requested()) return stopped();
  whole.frames = std::move(*kept);
  whole.step_confidence.resize(frames.count);
  SequenceMotionOptions options;
  options.estimator = estimator;
  const std::vector<double> times_s =
      frames.times_s.empty() ? assumed_times(frames.count) : frames.times_s;
  const auto begin = std::chrono::steady_clock::now();
  auto motion = estimate_sequence_motion(
      context, frames.grid, times_s, [&](size_t k) -> Result<Volume> { return whole.frames[k]; },
      options,
      [&](PairMotion pair) {
        whole.slowest_s =
            std::max(whole.slowest_s, pair.report.seconds + pair.report.prepare_seconds);
        whole.step_confidence[pair.fixed_frame] = std::move(pair.confidence);
      },
      [&](const std::string& doing, double share) { console.progress(share, doing); }, stop,
      &whole.report);
  console.end_progress();
  if (stop.stop_requested()) return stopped();
  if (!motion) return motion.error();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  whole.motion = std::move(*motion);
  whole.seconds = took.count();
  whole.text = sequence_text(whole.motion, whole.seconds);
  console.say(whole.text);
  for (const std::string& note : whole.report.notes) console.say("Note      " + note);
  return whole;
}

/// One motion for all frames, then what follows from it.
Result<MotionResults> find_whole(const MotionCommand& command, const std::string& preset,
                                 Frames& frames, const std::shared_ptr<vulkan::Context>& context,
                                 const EstimatorOptions& estimator, Outputs& outputs,
                                 Console& console, std::stop_token stop) {
  const auto whole = estimated_whole(frames, context, estimator, console, stop);
  if (!whole) return whole.error();
  MotionResults found;
  found.slowest_s = whole->slowest_s;

  // Its files, and the page.
  SequenceOutputOptions output;
  output.format = command.format;
  output.names = [&](size_t fixed, size_t moving) {
    return names_in_sequence(command, frames.count, fixed, moving);
  };
  output.coarse = command.coarse;
  output.mask = estimator.mask ? &*estimator.mask : nullptr;
  const auto written =
      write_sequence(whole->motion, whole->frames, whole->step_confidence, output, outputs);
  if (!written) return written.error();
  const std::vector<std::string>& notes = whole->report.notes;
  frames.notes.insert(frames.notes.end(), notes.begin(), notes.end());
  found.summary = summary_of(command, preset, frames, *context);
  found.summary["sequence"] = written->files;
  found.summary["sequence"]["seconds"] = whole->seconds;
  if (!command.page.empty()) {
    found.page.emplace(frames.grid, frames.count);
    fill(*found.page, whole->motion, whole->frames, whole->step_confidence);
    found.words = page_words(command, preset, frames, *context);
    found.words.cycle_s = whole->motion.basis.cycle_s;
    found.words.facts.push_back({"Motion", whole->text});
  }
  if (command.no_verdict) return found;

  // How far it can be trusted.
  auto evidence = examined(
      whole->motion, whole->frames, whole->report.confidence, output.mask,
      [&](const SequenceEvidence& so_far, size_t k) { console.say(frame_text(so_far, k)); });
  if (!evidence) return evidence.error();
  if (stop.stop_requested()) return stopped();
  evidence->drift = written->drift;
  evidence->ordered_by = frames.ordered_by;
  conclude_whole(*evidence, found, console);
  return found;
}

/// The frames to estimate between, with the times that the user gave.
Result<Frames> open_frames(const MotionCommand& command) {
  auto opened = command.is_pair()
                    ? files::open_pair(command.inputs[0], command.inputs[1], command.nan_as)
                    : files::open_sequence(command.inputs, command.nan_as);
  if (!opened || command.frames_per_second <= 0.0) return opened;
  opened->times_s.clear();
  for (size_t k = 0; k < opened->count; ++k)
    opened->times_s.push_back(double(k) / command.frames_per_second);
  return opened;
}

/// The user's mask, without what was NaN in a frame: that says nothing.
Result<std::optional<Mask>> mask_for(const MotionCommand& command, Frames& frames) {
  auto mask = files::read_mask_for(command.mask, frames.grid, &frames.notes);
  if (!mask || !command.nan_as) return mask;
  return files::mask_of_numbers(command.inputs, *command.nan_as, std::move(*mask), &frames.notes);
}

/// Puts the results where the user wants them: files under their final names, and the page.
Status publish(const MotionCommand& command, MotionResults& found, Outputs& outputs,
               Console& console) {
  Status done = Nothing{};
  if (!command.is_pair()) done = write_summary(outputs, found.summary);
  if (done) done = outputs.publish();
  if (!done || !found.page) return done;
  found.words.verdict = found.verdict ? &*found.verdict : nullptr;
  done = found.page->write(found.words, command.page);
  if (done) console.say(fmt::format("Wrote     {}", command.page.string()));
  return done;
}

/// Errors that can be known before anything is read.
Status check_command(const MotionCommand& command) {
  if (const Status wish = check_wish(command); !wish) return wish;
  if (const Status name = check_output_name(command); !name) return name;
  return check_page(command);
}

/// Says which frames there are, and what a person should know of them.
void tell_frames(const MotionCommand& command, Frames& frames, Console& console) {
  console.say(fmt::format("Frames    {}", files::frames_text(frames)));
  if (command.is_whole(frames.count) && frames.times_s.empty())
    frames.notes.push_back(
        fmt::format("The times of the frames are not known: all {} are said to be in {:.3g} s; "
                    "--fps says otherwise.",
                    frames.count, double(frames.count) * assumed_times(frames.count)[1]));
  for (const std::string& note : frames.notes) console.say("Note      " + note);
}

/// The settings to try, one after the other; none if the command names its own.
Result<std::vector<Choice>> choices_for(const MotionCommand& command, const Grid& grid,
                                        const vulkan::Context& context) {
  if (!command.chooses()) return std::vector<Choice>();
  return choose_settings(command.within, command.most_error, grid, context.info().name);
}

int run(const MotionCommand& command) {
  Console console(command.quiet, command.json);
  const CancelOnSignal cancel;
  auto motion = motion_options(command);
  if (!motion) return fail(console, motion.error());
  if (const Status can = check_command(command); !can) return fail(console, can.error());
  auto opening = begin_open_device(command.device);  // in parallel to reading the files
  auto frames = open_frames(command);
  if (!frames) return fail(console, frames.error());
  if (const Status names = check_names(command, frames->count); !names)
    return fail(console, names.error());
  auto mask = mask_for(command, *frames);
  if (!mask) return fail(console, mask.error());
  tell_frames(command, *frames, console);
  const auto context = open_device(std::move(opening), command.device, console);
  if (!context) return fail(console, context.error());
  const auto choices = choices_for(command, frames->grid, **context);
  if (!choices) return fail(console, choices.error());

  // With each setting in turn, until a result is good enough.
  EstimatorOptions estimator;
  estimator.motion = *motion;
  estimator.cyclic = command.cyclic;
  estimator.mask = *mask;
  for (size_t n = 0;; ++n) {
    std::string preset = command.preset;
    if (n < choices->size()) {
      const Choice& choice = (*choices)[n];
      console.say("Chosen    " + choice.why);
      estimator.motion = choice.setting.options;
      preset = choice.setting.name;
    }
    auto outputs = outputs_for(command, *frames);
    if (!outputs) return fail(console, outputs.error());
    const auto find = command.is_whole(frames->count) ? find_whole : find_pairs;
    auto found =
        find(command, preset, *frames, *context, estimator, *outputs, console, cancel.token());
    if (!found) return fail(console, found.error());
    // A result that is not good enough is not written if there is a better setting.
    if (n + 1 < choices->size() && found->verdict && found->verdict->trust != Trust::kOk) {
      console.say(verdict_text(*found->verdict));
      frames = open_frames(command);  // frames can be read only once
      if (!frames) return fail(console, frames.error());
      continue;
    }
    if (const Status done = publish(command, *found, *outputs, console); !done)
      return fail(console, done.error());
    return conclude(command, found->slowest_s, found->verdict, found->summary, console);
  }
}

void add_expert_options(CLI::App& app, MotionCommand& command) {
  add_device_options(app, command.device);
  app.add_option("--iterations", command.iterations, "At most this many iterations on every level")
      ->check(whole_number_in(files::kIterations))
      ->group("Experiments");
  app.add_option("--levels", command.levels, "Number of levels of the pyramid")
      ->check(whole_number_in(1, 12))
      ->group("Experiments");
}

/// Options that choose a setting by measurements; they can not be combined with other choices.
void add_wishes(CLI::App& app, MotionCommand& command) {
  CLI::Option* within =
      app.add_option("--within", command.within,
                     "Choose the most accurate setting that takes at most this time for a pair on "
                     "this machine (2s, 500ms), as 'palpate chart motion' measured it")
          ->type_name("TIME");
  CLI::Option* error =
      app.add_option("--error", command.most_error,
                     "Choose the fastest setting whose error is at most this (0.5mm)")
          ->type_name("LENGTH");
  within->excludes(error);
  for (CLI::Option* wish : {within, error})
    for (const char* other : {"--preset", "--iterations", "--levels"})
      wish->excludes(app.get_option(other));
}

}  // namespace

Command add_motion(CLI::App& program) {
  auto command = std::make_shared<MotionCommand>();
  CLI::App* app = program.add_subcommand(
      "motion",
      "Estimate motion fields: of a pair (FIXED MOVING -o u.mha) or of a sequence (SEQUENCE -o "
      "DIR)");
  app->add_option("inputs", command->inputs,
                  "Two volumes; or a 4D file, a folder (DICOM or 3D files), or a list of 3D files")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->inputs);
  app->add_option("-o,--output", command->output,
                  "Pair: the field, .mha, .nrrd, .nii or .nii.gz. Sequence: a folder")
      ->type_name("PATH")
      ->required();
  app->add_option(
         "--model", command->model,
         "sequence: one motion for all frames, which does not drift (the usual from three "
         "frames on; for patients, animals and all that beats or breathes); pairwise: "
         "fields of consecutive frames alone (for two frames, simulations and flows, whose "
         "values change by themselves)")
      ->check(one_of({"sequence", "pairwise"}));
  app->add_option("--preset", command->preset, "Effort: how long it may take")
      ->check(one_of_the_presets())
      ->capture_default_str();
  app->add_option("--format", command->format, "Format of a sequence's fields")
      ->check(one_of({"mha", "nrrd", "nii", "nii.gz"}))
      ->capture_default_str();
  app->add_option(
         "--mask", command->mask,
         "Volume on the frames' grid: zero counts for nothing; draw it 10 voxels wider than needed")
      ->type_name("FILE");
  add_nan_as(
      *app, command->nan_as,
      ", as SPM and fMRIPrep write outside the body; those voxels then count for nothing, as "
      "outside of --mask");
  app->add_flag(
      "--cyclic", command->cyclic,
      "The last frame leads back to the first (one motion for all frames: if it does not, "
      "that is said and the cycle left open)");
  app->add_option("--fps,--frames-per-second", command->frames_per_second,
                  std::string(running::find_option("frames_per_second")->help))
      ->check(number_in(files::kFrameRates));
  app->add_flag("--inverse", command->inverse, "Also write the inverse of each field");
  app->add_flag(
      "--confidence", command->confidence,
      "Also write how far to trust each voxel: a share of 0..1, and the standard deviation "
      "of the error along and across the image gradient (mm)");
  app->add_flag("--coarse", command->coarse, "Write on the solved grid instead of the image's");
  app->add_flag("--pictures", command->pictures, "Also draw each pair (PNG)");
  app->add_option(
         "--page", command->page,
         "Also write a page for browsers (.html): frames that play, motion, confidence and "
         "change of volume over them, verdict and numbers, in one file that needs no "
         "network")
      ->type_name("FILE");
  app->add_flag("--no-verdict", command->no_verdict, "Do not check the fields (faster)");
  app->add_flag("--json", command->json, "Print the summary as JSON on stdout, lines on stderr");
  app->add_flag("--quiet", command->quiet, "Print errors and bad verdicts only");
  add_expert_options(*app, *command);
  add_wishes(*app, *command);
  return {
      app, [command] { return run(*command); }, {"inputs", "--mask"}, {"--output", "--page"}, {}};
}

}  // namespace palpate::app
