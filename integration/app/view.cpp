#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "integration/app/cancel.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_run.h"
#include "integration/app/option_checks.h"
#include "integration/app/outputs.h"
#include "integration/app/picture_file.h"
#include "integration/app/series_option.h"
#include "integration/app/session_flags.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/running/open_session.h"
#include "module/scene/drive.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

/// A snapshot with all volumes at frame `at` of the sequence (from 0, with phases in between).
SceneSnapshot snapshot_at(const LoadedScene& scene, double at) {
  SceneSnapshot snapshot;
  snapshot.volume_count = std::min(int(scene.data.size()), SceneSnapshot::kMostVolumes);
  for (int v = 0; v < snapshot.volume_count; ++v) {
    const FrameTimes& times = scene.data[size_t(v)]->times;
    VolumeSnapshot& volume = snapshot.volumes[size_t(v)];
    const VolumeSpec& spec = scene.spec.volumes[size_t(v)];
    volume.world_from_volume = driven(spec.drive, spec.transform, 0.0);
    // A shorter sequence stays at its last frame.
    const double last = double(times.times_s.size()) - 1.0;
    const size_t before = size_t(std::clamp(at, 0.0, last));
    const double next_s = before + 1 < times.times_s.size() ? times.times_s[before + 1]
                          : times.cycle_s > 0.0             ? times.cycle_s
                                                            : times.times_s[before];
    const double share = at < last + 1.0 ? at - double(before) : 0.0;
    volume.time_s = times.times_s[before] + share * (next_s - times.times_s[before]);
  }
  return snapshot;
}

size_t frames_of(const LoadedScene& scene) {
  size_t most = 1;
  for (const auto& volume : scene.data) most = std::max(most, volume->times.times_s.size());
  return most;
}

/// Pictures of one height side by side, with slices at their right where these are wanted.
Status write_pictures(const fs::path& path, std::span<const Picture> eyes, const Viewer& viewer,
                      const SceneSnapshot& snapshot, bool with_slices) {
  std::vector<charts::Bitmap> rasters;
  for (const Picture& eye : eyes) rasters.push_back(raster_of(eye));
  if (with_slices)
    if (auto slices = slices_beside(viewer.picture(), snapshot, rasters.front().height))
      rasters.push_back(std::move(*slices));
  return write_side_by_side(path.string(), rasters);
}

/// Loads the scene, or for a live source its first frame.
Result<LoadedScene> shown_scene(const FeelCommand& command, Console& console) {
  running::SessionCallbacks callbacks;
  callbacks.on_note = [&console](running::NoteSource, const std::string& note) {
    console.say("Live      " + note);
  };
  auto read = running::load_request(command.request, callbacks);
  if (!read) return read.error();
  return std::move(read->scene);
}

/// Writes pictures without any display: one picture, or every frame for two eyes.
Status draw(const FeelCommand& command, double frame, Console& console, std::stop_token stop) {
  auto scene = shown_scene(command, console);
  if (!scene) return scene.error();
  for (const std::string& note : notes_of(*scene)) console.say("Note      " + note);
  if (frame >= double(frames_of(*scene)))
    return Error{ErrorKind::kBadInput, fmt::format("There is no frame {}: the frames are 0 to {}",
                                                   frame, frames_of(*scene) - 1)};
  const auto assembled = plan(scene->spec, scene->data, scene->kinds);
  if (!assembled) return assembled.error();
  std::optional<Outputs> outputs;
  if (!command.headless.empty()) {
    auto folder = Outputs::into(command.headless);
    if (!folder) return folder.error();
    outputs.emplace(std::move(*folder));
  }
  const PictureSize size{command.picture_size, command.picture_size};
  const auto viewer = Viewer::open(vulkan::ContextOptions{.device = command.gpu.device},
                                   command.view, {.most = size, .most_eyes = outputs ? 2 : 1});
  if (!viewer) return viewer.error();
  if (const Status set = (*viewer)->update(*assembled); !set) return set;
  if (const Status shows = (*viewer)->picture().shows_something(); !shows) return shows;
  if (!command.picture.empty()) {
    const SceneSnapshot snapshot = snapshot_at(*scene, frame);
    const auto eyes = (*viewer)->take_all(snapshot, size, 1);
    if (!eyes) return eyes.error();
    const Status written =
        write_pictures(command.picture, *eyes, **viewer, snapshot, command.view.slices);
    if (!written) return written;
    console.say(fmt::format("Wrote     {}", command.picture.string()));
  }
  if (!outputs) return Nothing{};
  const size_t frames = frames_of(*scene);
  for (size_t k = 0; k < frames; ++k) {
    if (stop.stop_requested()) return Error{ErrorKind::kCancelled, "Stopped: nothing was written"};
    console.progress(double(k) / double(frames), "drawing");
    const SceneSnapshot snapshot = snapshot_at(*scene, double(k));
    const auto eyes = (*viewer)->take_all(snapshot, size, 2);
    if (!eyes) return eyes.error();
    const auto path = outputs->stage(fmt::format("frame_{}.png", k));
    if (!path) return path.error();
    const Status written = write_pictures(*path, *eyes, **viewer, snapshot, command.view.slices);
    if (!written) return outputs->in_place(written.error());
  }
  console.end_progress();
  if (const Status done = outputs->publish(); !done) return done;
  console.say(fmt::format("Wrote     {}: {} for two eyes", command.headless.string(),
                          frames == 1 ? "a picture" : fmt::format("{} pictures", frames)));
  return Nothing{};
}

int run(FeelCommand command, double frame) {
  command.request.shown_only = true;
  command.view.hand = false;
  command.request.sequence.wall = loading::FeltWall::kNotFelt;
  if (command.picture.empty() && command.headless.empty()) {
    command.request.motion = false;
    return run_feel(command);
  }
  Console console(command.quiet, false);
  const CancelOnSignal cancel;
  if (const Status look = check_look(command.view.look); !look) return fail(console, look.error());
  const Status drawn = draw(command, frame, console, cancel.token());
  return drawn ? kExitOk : fail(console, drawn.error());
}

}  // namespace

Command add_view(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  auto frame = std::make_shared<double>(0.0);
  command->picture_size = 768;
  CLI::App* app = program.add_subcommand(
      "view", "Look at volumes, sequences or fields, without forces: window, headset or pictures");
  app->add_option("input", command->request.inputs,
                  "heart, shell, molecule, a scene file, a sequence as in 'palpate motion', a "
                  "field, several volumes of one space, or igtl://HOST:PORT: live images")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->request.inputs);
  app->add_option("--picture", command->picture, "Write a picture (PNG); needs no display")
      ->type_name("FILE");
  app->add_option("--frame", *frame, "Which frame --picture shows, from 0 on; 1.5: in between")
      ->check(number_in({0.0, 1e6}))
      ->capture_default_str();
  app->add_option("--headless", command->headless,
                  "Write every frame as a picture for two eyes into this folder; needs no display")
      ->type_name("DIR");
  add_seeing(*app, *command);
  app->add_option("--seconds", command->seconds, "Window or headset: end after this time")
      ->check(number_in(files::kRunTimes_s));
  add_session_options(
      *app, command->request,
      {"frames_per_second", "fields", "values", "nan_as", "image", "transform", "crc", "follow",
       "modes", "folder", "segments", "segments_frame", "segment_names", "cyclic"});
  add_gpu_option(*app, command->gpu);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command, frame] { return run(*command, *frame); },
          input_options(*app, {"input"}),
          {"--picture", "--headless"},
          {}};
}

}  // namespace palpate::app
