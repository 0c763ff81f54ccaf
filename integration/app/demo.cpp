#include <fmt/format.h>

#include <functional>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "integration/app/cancel.h"
#include "integration/app/commands.h"
#include "integration/app/delivery.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/app/summary.h"
#include "integration/charts/charts.h"
#include "integration/files/atomic_file.h"
#include "integration/files/frames.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

struct DemoCommand {
  fs::path output;
  std::string preset = "balanced";
  int size = 128;
  std::string phantom = "heart";
  int frames = 0;  ///< 0: the phantom's default number
  DeviceOptions device;
  bool quiet = false;
};

/// Results to print for a pair.
struct Score {
  Spread motion_mm;  ///< true motion of the wall
  Distances error;   ///< endpoint error on the wall
  size_t folded = 0;
  double there_and_back_voxels = 0.0;
  double seconds = 0.0;
};

/// The beating phantom with its true motion; frame numbers are cyclic.
struct Beat {
  Sequence frames;
  std::function<Field(const Grid&, int fixed, int moving)> truth;
  std::function<Mask(const Grid&, int frame)> wall;
};

Beat beat_of(const DemoCommand& command) {
  if (command.phantom == "shell") {
    const int frames = command.frames > 0 ? command.frames : kShellFrames;
    return {shell_phantom(command.size, frames),
            [frames](const Grid& grid, int from, int to) {
              return shell_truth(grid, from, to, frames);
            },
            [frames](const Grid& grid, int frame) { return shell_mask(grid, frame, frames); }};
  }
  const int frames = command.frames > 0 ? command.frames : kHeartFrames;
  return {
      heart_phantom(command.size, frames),
      [frames](const Grid& grid, int from, int to) { return heart_truth(grid, from, to, frames); },
      [frames](const Grid& grid, int frame) { return heart_muscle(grid, frame, frames); }};
}

/// Estimates the motion of the beating phantom and compares it with the truth.
class Demo {
 public:
  Demo(const DemoCommand& command, Console& console, Outputs& outputs)
      : command_(command),
        console_(console),
        outputs_(outputs),
        beat_(beat_of(command)),
        delivery_(delivery_options(command), outputs, console) {}

  Status run(const std::shared_ptr<vulkan::Context>& context, std::stop_token stop) {
    EstimationJob job;
    job.grid = beat_.frames.frames.front().grid;
    job.frame_count = beat_.frames.frames.size();
    job.read_frame = [this](size_t k) -> Result<Volume> { return beat_.frames.frames[k]; };
    const auto preset = motion_preset(command_.preset);
    if (!preset) {
      return Error{
          ErrorKind::kBadInput,
          fmt::format("There is no preset '{}': see 'palpate motion --help'", command_.preset)};
    }
    job.options.motion = *preset;
    job.options.cyclic = true;
    job.options.backward = true;
    Status done = estimate(
        context, job, [this](EstimatedPair pair) { return take(pair); }, console_, stop);
    if (done) done = delivery_.close_cycle();
    if (done) done = draw_beat();
    if (done) done = write_summary();
    return done ? outputs_.publish() : done;
  }

  Verdict verdict() const { return delivery_.verdict(); }
  const std::string& summary() const { return summary_; }

 private:
  static DeliveryOptions delivery_options(const DemoCommand&) {
    DeliveryOptions options;
    options.names = [](size_t fixed, size_t moving) {
      PairNames names;
      names.field = fmt::format("motion_{}_to_{}.mha", fixed, moving);
      return names;
    };
    options.cyclic = true;
    return options;
  }

  Status take(const EstimatedPair& pair) {
    if (const Status done = delivery_.take(pair); !done) return done;
    const auto fixed = int(pair.motion.fixed_frame);
    const auto moving = int(pair.motion.moving_frame);
    const Grid& grid = pair.fixed->grid;
    const Field truth = beat_.truth(grid, fixed, moving);
    const Mask wall = beat_.wall(grid, fixed);
    const auto error = endpoint_error(pair.motion.field, truth, &wall);
    if (!error) return error.error();
    const Field field = resampled(pair.motion.field, grid);
    const Evidence& evidence = delivery_.evidence();
    Score score{lengths_mm(truth, &wall), *error, evidence.folds->folded,
                evidence.inverse ? evidence.inverse->own_voxels.mean : 0.0,
                pair.motion.report.seconds + pair.motion.report.prepare_seconds};
    fields_.push_back(pair.motion.field);
    scores_.push_back(score);
    return draw_pair(pair, field, truth, wall, score);
  }

  Status draw_pair(const EstimatedPair& pair, const Field& field, const Field& truth,
                   const Mask& wall, const Score& score) {
    const auto path = outputs_.stage(
        fmt::format("motion_{}_to_{}.png", pair.motion.fixed_frame, pair.motion.moving_frame));
    if (!path) return path.error();
    charts::PairPicture picture;
    picture.fixed = pair.fixed.get();
    picture.moving = pair.moving.get();
    picture.field = &field;
    picture.truth = &truth;
    picture.confidence = &pair.motion.confidence;
    picture.mask = &wall;
    const charts::Caption caption{
        fmt::format("A beating {}, frame {} to {}", command_.phantom, pair.motion.fixed_frame,
                    pair.motion.moving_frame),
        fmt::format("The wall moves by up to {:.1f} mm; palpate misses it by {:.3f} mm on average",
                    score.motion_mm.max, score.error.mm.mean)};
    const Status drawn = charts::write_pair_overview(path->string(), picture, caption);
    return drawn ? drawn : Status(outputs_.in_place(drawn.error()));
  }

  Status draw_beat() {
    const auto path = outputs_.stage("beat.png");
    if (!path) return path.error();
    std::vector<charts::SequenceStep> moments;
    for (size_t k = 0; k < beat_.frames.frames.size(); ++k) {
      moments.push_back({&beat_.frames.frames[k], &fields_[k],
                         fmt::format("frame {} \u2192 {}", k, (k + 1) % beat_.frames.frames.size()),
                         fmt::format("t = {:.3g} s", beat_.frames.times_s[k])});
    }
    const Status drawn = charts::write_sequence_strip(
        path->string(), moments,
        {"One beat of the " + command_.phantom,
         "Each arrow leads from a point to where it is in the next frame"});
    return drawn ? drawn : Status(outputs_.in_place(drawn.error()));
  }

  std::string table() const {
    std::string text =
        "  frames   the wall moves   palpate misses it by           folds   inverse      time\n"
        "            (at most)       mean     95 %      worst               consistency\n";
    for (size_t k = 0; k < scores_.size(); ++k) {
      const Score& score = scores_[k];
      text += fmt::format(
          "  {} -> {}   {:6.2f} mm       {:.3f}    {:.3f}     {:.3f} mm   {:>5}   {:.3f} voxel  "
          "{:.2f} s\n",
          k, (k + 1) % scores_.size(), score.motion_mm.max, score.error.mm.mean, score.error.mm.p95,
          score.error.mm.max, score.folded ? std::to_string(score.folded) : "none",
          score.there_and_back_voxels, score.seconds);
    }
    return text;
  }

  Status write_summary() {
    double error_mm = 0.0, motion_mm = 0.0;
    for (const Score& score : scores_) {
      error_mm += score.error.mm.mean / double(scores_.size());
      motion_mm += score.motion_mm.mean / double(scores_.size());
    }
    summary_ = fmt::format(
        "\npalpate felt a {} beat.\n\n"
        "The {} is synthetic: {} frames of {}, so its motion is known exactly.\n"
        "palpate saw only the frames, and says where each point goes next:\n\n{}\n"
        "On average the wall moves by {:.2f} mm and palpate is wrong by {:.3f} mm, one part in "
        "{:.0f}.\n",
        command_.phantom, command_.phantom, beat_.frames.frames.size(),
        files::grid_text(beat_.frames.frames.front().grid), table(), motion_mm, error_mm,
        error_mm > 0.0 ? motion_mm / error_mm : 0.0);
    if (delivery_.drift()) summary_ += cycle_text(*delivery_.drift()) + "\n";
    summary_ += "\n" + verdict_text(delivery_.verdict()) + "\n\nLook at\n";
    const fs::path& folder = outputs_.folder();
    summary_ += fmt::format("  {}   the whole beat, with arrows\n", (folder / "beat.png").string());
    summary_ += fmt::format("  {}   a pair: frame, difference, motion, error, confidence\n",
                            (folder / "motion_0_to_1.png").string());
    summary_ += fmt::format("  {}   the field itself, for ITK, 3D Slicer, ...\n",
                            (folder / "motion_0_to_1.mha").string());
    const auto path = outputs_.stage("summary.txt");
    if (!path) return path.error();
    const Status written = files::write_text(*path, summary_.substr(1));
    return written ? written : Status(outputs_.in_place(written.error()));
  }

  const DemoCommand& command_;
  Console& console_;
  Outputs& outputs_;
  Beat beat_;
  Delivery delivery_;
  std::vector<Score> scores_;
  std::vector<Field> fields_;  ///< on the solved grid
  std::string summary_;
};

int run(const DemoCommand& command) {
  Console console(command.quiet, false);
  const CancelOnSignal cancel;
  auto outputs = Outputs::into(command.output);
  if (!outputs) return fail(console, outputs.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  console.say(fmt::format("Making    a {1} of {0} x {0} x {0} voxels that beats", command.size,
                          command.phantom));
  Demo demo(command, console, *outputs);
  if (const Status done = demo.run(*context, cancel.token()); !done)
    return fail(console, done.error());
  console.say(demo.summary());
  return exit_code(demo.verdict().trust);
}

}  // namespace

Command add_demo(CLI::App& program) {
  auto command = std::make_shared<DemoCommand>();
  CLI::App* app = program.add_subcommand(
      "demo", "Make a beating heart, estimate its motion, compare with the truth, draw pictures");
  app->add_option("-o,--output", command->output, "Folder for pictures, fields and summary")
      ->type_name("DIR")
      ->required();
  app->add_option("--preset", command->preset, "Effort, as in 'palpate motion'")
      ->check(one_of_the_presets())
      ->capture_default_str();
  app->add_option("--size", command->size, "Voxels along each edge")
      ->check(whole_number_in(32, 512))
      ->capture_default_str();
  app->add_option("--frames", command->frames, "Frames of the beat (heart: 8, shell: 4)")
      ->check(whole_number_in(3, 9));
  app->add_option("--phantom", command->phantom, "What beats: heart, or shell, a ball of the paper")
      ->check(one_of({"heart", "shell"}))
      ->capture_default_str();
  add_device_options(*app, command->device);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app, [command] { return run(*command); }, {}, {"--output"}, {}};
}

}  // namespace palpate::app
