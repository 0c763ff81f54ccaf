#include "compute/volume/phantom.h"

#include <fmt/format.h>

#include <functional>
#include <limits>
#include <memory>

#include "compute/volume/heart_phantom.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/files/atomic_file.h"
#include "integration/files/dicom/dicom_writer.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/sentences.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

struct PhantomCommand {
  std::string kind = "heart";
  fs::path output;  ///< one file; empty: none
  fs::path frame_files, dicom, truth;
  int size = 128;
  int frames = 0;  ///< 0: the phantom's default number
  uint32_t seed = 1;
  double noise = 0.01;
  double shift_voxels = 20.0;
};

/// Data whose motion is known, and what writes its truth.
struct PhantomData {
  Sequence sequence;
  std::function<Status(Outputs&)> write_truth;
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
    if (!done) return done;
    const auto wall = outputs.stage(fmt::format("wall_{}.mha", k));
    if (!wall) return wall.error();
    done = files::write_mask(heart ? heart_muscle(grid, k, frames, command.seed)
                                   : shell_mask(grid, k, frames, command.seed),
                             *wall);
    if (!done) return done;
  }
  return Nothing{};
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
  return done;
}

Result<PhantomData> made(const PhantomCommand& command) {
  if (command.kind != "sliding") {
    const bool heart = command.kind == "heart";
    const int frames = command.frames > 0 ? command.frames : heart ? kHeartFrames : kShellFrames;
    return PhantomData{heart ? heart_phantom(command.size, frames, command.seed, command.noise)
                             : shell_phantom(command.size, frames, command.seed, command.noise),
                       [&command, frames](Outputs& outputs) {
                         return write_beat_truth(command, frames, heart_grid(command.size),
                                                 outputs);
                       }};
  }
  if (std::abs(command.shift_voxels) >= command.size / 3.0) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The organ can not move by {} of {} voxels: --shift must be below a "
                             "third of --size",
                             command.shift_voxels, command.size)};
  }
  auto phantom = std::make_shared<SlidingPhantom>(
      sliding_phantom(command.size, command.shift_voxels, command.seed, command.noise));
  Sequence sequence{"sliding organ", {}, {0.0, 1.0}, false};
  sequence.frames.push_back(std::move(phantom->fixed));
  sequence.frames.push_back(std::move(phantom->moving));
  return PhantomData{std::move(sequence), [phantom](Outputs& outputs) {
                       return write_sliding_truth(*phantom, outputs);
                     }};
}

/// Fills a folder, or leaves it as it was.
Status fill(const fs::path& folder, const std::function<Status(Outputs&)>& write) {
  if (folder.empty()) return Nothing{};
  auto outputs = Outputs::into(folder);
  if (!outputs) return outputs.error();
  const Status written = write(*outputs);
  return written ? outputs->publish() : Status(outputs->in_place(written.error()));
}

Status write_frame_files(const Sequence& sequence, Outputs& outputs) {
  const size_t width = std::to_string(sequence.frames.size() - 1).size();
  for (size_t k = 0; k < sequence.frames.size(); ++k) {
    const auto path = outputs.stage(fmt::format("frame_{:0{}}.mha", k, width));
    if (!path) return path.error();
    const Status written = files::write_volume(sequence.frames[k], *path);
    if (!written) return written;
  }
  return Nothing{};
}

/// The same for the same data.
uint64_t series_id(const PhantomCommand& command) {
  const std::string text =
      fmt::format("{} {} {} {} {} {}", command.kind, command.size, command.frames, command.seed,
                  command.noise, command.shift_voxels);
  uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const char c : text) hash = (hash ^ uint8_t(c)) * 0x100000001b3;
  return hash;
}

Status make(const PhantomCommand& command) {
  if (command.output.empty() && command.frame_files.empty() && command.dicom.empty())
    return Error{ErrorKind::kBadInput,
                 "No output is named: give --output, --frame-files or --dicom"};
  if (!command.output.empty()) {
    if (!command.output.string().ends_with(".seq.nrrd"))
      return files::bad_output(command.output,
                               "can not hold a sequence: name a file that ends in .seq.nrrd");
    if (const Status can = files::check_can_write_image(command.output); !can) return can;
  }
  for (const fs::path& folder : {command.frame_files, command.dicom, command.truth})
    if (!folder.empty())
      if (const Status can = files::check_can_write_folder(folder); !can) return can;
  const auto phantom = made(command);
  if (!phantom) return phantom.error();
  Status done = Nothing{};
  if (!command.output.empty()) done = files::write_sequence(phantom->sequence, command.output);
  if (done)
    done = fill(command.frame_files,
                [&](Outputs& outputs) { return write_frame_files(phantom->sequence, outputs); });
  if (done)
    done = fill(command.dicom, [&](Outputs& outputs) {
      return files::write_dicom(phantom->sequence, command.kind + " phantom", series_id(command),
                                [&](const std::string& name) { return outputs.stage(name); });
    });
  return done ? fill(command.truth, phantom->write_truth) : done;
}

int run(const PhantomCommand& command) {
  Console console(false, false);
  if (const Status made = make(command); !made) return fail(console, made.error());
  const auto say = [&](const fs::path& path, const char* what) {
    if (!path.empty()) console.say(fmt::format("Wrote     {}{}", path.string(), what));
  };
  say(command.output, "");
  say(command.frame_files, ": each frame as a file");
  say(command.dicom, ": a DICOM series");
  say(command.truth, ": its true motion and where to score it");
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
  app->add_option("-o,--output", command->output, "The sequence, .seq.nrrd")->type_name("FILE");
  app->add_option("--frame-files", command->frame_files,
                  "Folder for the sequence as a file for each frame, frame_0.mha, ...")
      ->type_name("DIR");
  app->add_option("--dicom", command->dicom,
                  "Folder for the sequence as a DICOM series, a file for each slice of a frame")
      ->type_name("DIR");
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
  return {app,
          [command] { return run(*command); },
          {},
          {"--output", "--frame-files", "--dicom", "--truth"},
          {}};
}

}  // namespace palpate::app
