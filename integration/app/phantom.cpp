#include "compute/volume/phantom.h"

#include <fmt/format.h>

#include <limits>

#include "compute/volume/heart_phantom.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/files/sentences.h"
#include "integration/files/write_field.h"
#include "integration/files/write_volume.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

struct PhantomCommand {
  std::string kind = "heart";
  fs::path output;
  fs::path truth;
  int size = 128;
  int frames = 0;  ///< 0: the phantom's default number
  uint32_t seed = 1;
  double noise = 0.01;
  double shift_voxels = 20.0;
};

/// Writes true fields and the masks of the scored voxels.
Status write_beat_truth(const PhantomCommand& command, int frames, const Grid& grid,
                        Outputs& outputs) {
  const bool heart = command.kind == "heart";
  for (int k = 0; k < frames; ++k) {
    const int next = (k + 1) % frames;
    const auto truth = outputs.stage(fmt::format("truth_{}_to_{}.mha", k, next));
    if (!truth) return truth.error();
    Status done = files::write_field(
        heart ? heart_truth(grid, k, next, frames) : shell_truth(grid, k, next, frames), *truth);
    if (!done) return outputs.in_place(done.error());
    const auto wall = outputs.stage(fmt::format("wall_{}.mha", k));
    if (!wall) return wall.error();
    done = files::write_mask(heart ? heart_muscle(grid, k, frames, command.seed)
                                   : shell_mask(grid, k, frames, command.seed),
                             *wall);
    if (!done) return outputs.in_place(done.error());
  }
  return outputs.publish();
}

Status write_sliding_truth(const SlidingPhantom& phantom, Outputs& outputs) {
  const auto truth = outputs.stage("truth_0_to_1.mha");
  if (!truth) return truth.error();
  Status done = files::write_field(phantom.truth, *truth);
  for (const auto& [name, mask] :
       {std::pair("organ.mha", &phantom.organ), std::pair("wall.mha", &phantom.wall)}) {
    const auto path = outputs.stage(name);
    if (!path) return path.error();
    if (done) done = files::write_mask(*mask, *path);
  }
  return done ? outputs.publish() : Status(outputs.in_place(done.error()));
}

Status make(const PhantomCommand& command) {
  if (!command.output.string().ends_with(".seq.nrrd")) {
    return files::bad_output(command.output,
                             "can not hold a sequence: name a file that ends in .seq.nrrd");
  }
  if (const Status can = files::check_can_write_image(command.output); !can) return can;
  // Opened before the sequence is written; without --truth nothing is ever staged in it.
  auto outputs =
      Outputs::into(command.truth.empty() ? command.output.parent_path() : command.truth);
  if (!outputs) return outputs.error();
  if (command.kind != "sliding") {
    const bool heart = command.kind == "heart";
    const int frames = command.frames > 0 ? command.frames : heart ? kHeartFrames : kShellFrames;
    const Sequence beat = heart ? heart_phantom(command.size, frames, command.seed, command.noise)
                                : shell_phantom(command.size, frames, command.seed, command.noise);
    const Status written = files::write_sequence(beat, command.output);
    if (!written || command.truth.empty()) return written;
    return write_beat_truth(command, frames, heart_grid(command.size), *outputs);
  }
  if (std::abs(command.shift_voxels) >= command.size / 3.0) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The organ can not move by {} of {} voxels: --shift must be below a "
                             "third of --size",
                             command.shift_voxels, command.size)};
  }
  SlidingPhantom phantom =
      sliding_phantom(command.size, command.shift_voxels, command.seed, command.noise);
  Sequence sequence{"sliding organ", {}, {0.0, 1.0}, false};
  sequence.frames.push_back(std::move(phantom.fixed));
  sequence.frames.push_back(std::move(phantom.moving));
  const Status written = files::write_sequence(sequence, command.output);
  if (!written || command.truth.empty()) return written;
  return write_sliding_truth(phantom, *outputs);
}

int run(const PhantomCommand& command) {
  Console console(false, false);
  if (const Status made = make(command); !made) return fail(console, made.error());
  console.say(fmt::format("Wrote     {}", command.output.string()));
  if (!command.truth.empty())
    console.say(
        fmt::format("          its true motion and where to score it: {}", command.truth.string()));
  return kExitOk;
}

}  // namespace

Command add_phantom(CLI::App& program) {
  auto command = std::make_shared<PhantomCommand>();
  CLI::App* app = program.add_subcommand("phantom", "Make a sequence whose motion is known");
  app->add_option("kind", command->kind,
                  "heart: beats; shell: a ball that beats, of the paper; sliding: an organ slides "
                  "past a still wall")
      ->check(one_of({"heart", "shell", "sliding"}))
      ->capture_default_str();
  app->add_option("-o,--output", command->output, "The sequence, .seq.nrrd")
      ->type_name("FILE")
      ->required();
  app->add_option("--truth", command->truth, "Folder for the true fields and where to score them")
      ->type_name("DIR");
  app->add_option("--size", command->size, "Voxels along each edge")
      ->check(whole_number_in(16, 1024))
      ->capture_default_str();
  app->add_option("--frames", command->frames, "Frames of a beat (heart: 8, shell: 4)")
      ->check(whole_number_in(2, 1000));
  app->add_option("--seed", command->seed, "Another seed, another texture and noise")
      ->check(whole_number_in(0, std::numeric_limits<uint32_t>::max()))
      ->capture_default_str();
  app->add_option("--noise", command->noise, "SD of the noise, share of the contrast")
      ->check(number_in({0.0, 1.0}))
      ->capture_default_str();
  app->add_option("--shift", command->shift_voxels,
                  "How far the sliding organ moves, voxels; below a third of --size")
      ->check(number_in({-341.0, 341.0}))
      ->capture_default_str();
  return {app, [command] { return run(*command); }, {}, {"--output", "--truth"}, {}};
}

}  // namespace palpate::app
