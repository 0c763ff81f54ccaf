#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "integration/app/cancel.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_run.h"
#include "integration/app/film_file.h"
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

constexpr double kFilmRate = 25.0;         // pictures a second, about
constexpr double kMostKeptPixels = 1.5e8;  // of a film's cycle: 600 MB

/// A film that is asked for.
struct FilmChoices {
  fs::path file;
  std::optional<double> turn_deg;
  double seconds = 0.0;  ///< its length; 0: by the data
};

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

/// Loads the scene, or for a live source its first frame.
Result<LoadedScene> shown_scene(const FeelCommand& command, Console& console) {
  running::SessionCallbacks callbacks;
  callbacks.on_note = [&console](running::NoteSource, const std::string& note) {
    console.say("Live      " + note);
  };
  auto read = running::load_request(command.request, callbacks);
  if (!read) return read.error();
  for (const std::string& note : notes_of(read->scene)) console.say("Note      " + note);
  return std::move(read->scene);
}

/// What is drawn without a display.
struct DrawnScene {
  LoadedScene scene;
  std::unique_ptr<Viewer> viewer;
  PictureSize size;
  int eyes = 1;  ///< of a picture
  TimeStrip strip;
};

/// What is drawn of a snapshot: the eyes' pictures, slices at their right where these are wanted,
/// and the time below.
Result<charts::Bitmap> drawn(const DrawnScene& drawing, const SceneSnapshot& snapshot) {
  Viewer& viewer = *drawing.viewer;
  const ViewChoices& choices = viewer.picture().choices();
  const auto eyes = viewer.take_all(snapshot, drawing.size, drawing.eyes);
  if (!eyes) return eyes.error();
  std::vector<charts::Bitmap> rasters = rasters_of(*eyes, choices);
  const int height_px = drawing.size.height;
  if (choices.slices)
    if (auto slices =
            slices_beside(viewer.picture(), snapshot, viewer.shown().tube_colours, height_px))
      rasters.push_back(std::move(*slices));
  return drawing.strip.below(side_by_side(rasters), snapshot, height_px);
}

/// Opens the device; what else can fail comes before, because it takes a second.
Result<DrawnScene> open_drawing(const FeelCommand& command, LoadedScene scene, bool pairs,
                                bool has_bar = false) {
  const auto assembled = plan(scene.spec, scene.data, scene.kinds);
  if (!assembled) return assembled.error();
  const PictureSize size{command.picture_size, command.picture_size};
  const Stereo stereo = command.view.stereo.value_or(pairs ? Stereo::kParallel : Stereo::kMono);
  const int eyes = stereo == Stereo::kMono ? 1 : 2;
  auto viewer = Viewer::open(vulkan::ContextOptions{.device = command.gpu.device}, command.view,
                             {.most = size, .most_eyes = eyes});
  if (!viewer) return viewer.error();
  if (const Status set = (*viewer)->update(*assembled); !set) return set.error();
  if (const Status shows = (*viewer)->picture().shows_something(); !shows) return shows.error();
  return DrawnScene{std::move(scene), std::move(*viewer), size, eyes,
                    TimeStrip(*assembled, has_bar, !command.view.slices)};
}

/// Writes one picture.
Status draw_picture(const FeelCommand& command, double frame, Console& console) {
  auto scene = shown_scene(command, console);
  if (!scene) return scene.error();
  if (frame >= double(frames_of(*scene)))
    return Error{ErrorKind::kBadInput, fmt::format("There is no frame {}: the frames are 0 to {}",
                                                   frame, frames_of(*scene) - 1)};
  auto drawing = open_drawing(command, std::move(*scene), false);
  if (!drawing) return drawing.error();
  const auto picture = drawn(*drawing, snapshot_at(drawing->scene, frame));
  if (!picture) return picture.error();
  const Status written = write_side_by_side(command.picture.string(), {*picture});
  if (written) console.say(fmt::format("Wrote     {}", command.picture.string()));
  return written;
}

/// Writes every frame, for two eyes unless --stereo says otherwise.
Status draw_frames(const FeelCommand& command, Console& console, std::stop_token stop) {
  auto scene = shown_scene(command, console);
  if (!scene) return scene.error();
  auto outputs = Outputs::into(command.headless);
  if (!outputs) return outputs.error();
  auto drawing = open_drawing(command, std::move(*scene), true);
  if (!drawing) return drawing.error();
  const size_t frames = frames_of(drawing->scene);
  for (size_t k = 0; k < frames; ++k) {
    if (stop.stop_requested()) return Error{ErrorKind::kCancelled, "Stopped: nothing was written"};
    console.progress(double(k) / double(frames), "drawing");
    const auto picture = drawn(*drawing, snapshot_at(drawing->scene, double(k)));
    if (!picture) return picture.error();
    const auto path = outputs->stage(fmt::format("frame_{}.png", k));
    if (!path) return path.error();
    const Status written = write_side_by_side(path->string(), {*picture});
    if (!written) return outputs->in_place(written.error());
  }
  console.end_progress();
  if (const Status done = outputs->publish(); !done) return done;
  console.say(fmt::format("Wrote     {}: {}{}", command.headless.string(),
                          frames == 1 ? "a picture" : fmt::format("{} pictures", frames),
                          drawing->eyes == 2 ? " for two eyes" : ""));
  return Nothing{};
}

/// All volumes at this time of the sequence, s; what does not repeat stays at its last frame.
SceneSnapshot snapshot_at_time(const LoadedScene& scene, double time_s) {
  SceneSnapshot snapshot = snapshot_at(scene, 0.0);
  for (int v = 0; v < snapshot.volume_count; ++v) {
    const FrameTimes& times = scene.data[size_t(v)]->times;
    snapshot.volumes[size_t(v)].time_s =
        times.cyclic() ? std::fmod(time_s, times.cycle_s) : std::min(time_s, times.length_s());
  }
  return snapshot;
}

/// How a film runs through time and around the scene.
struct FilmCourse {
  double length_s = 0.0;
  double turn_deg = 0.0;  ///< over the whole film
  double rate = kFilmRate;
  int per_cycle = 0;  ///< pictures, as many as are repeated; 0: each is another one
};

/// Whole cycles, three seconds at least; a sequence that does not repeat once; what stands still
/// once around.
FilmCourse course_of(const LoadedScene& scene, const FilmChoices& choices) {
  constexpr double kLeast_s = 3.0, kAround_s = 8.0;
  double once_s = 0.0;
  bool repeats = false;
  for (const auto& volume : scene.data) {
    if (volume->is_still()) continue;
    once_s = std::max(once_s, volume->times.length_s());
    repeats |= volume->times.cyclic();
  }
  FilmCourse course{once_s, choices.turn_deg.value_or(once_s > 0.0 ? 0.0 : 360.0)};
  if (once_s == 0.0) course.length_s = kAround_s;
  if (repeats) course.length_s = once_s * std::ceil(std::max(1.0, kLeast_s / once_s - 1e-9));
  if (choices.seconds > 0.0) course.length_s = choices.seconds;
  if (!repeats) return course;
  // Whole pictures for each cycle, so that later cycles need none of their own.
  const double per_cycle = std::max(1.0, std::round(once_s * kFilmRate));
  course.rate = per_cycle / once_s;
  if (course.turn_deg == 0.0) course.per_cycle = int(per_cycle);
  return course;
}

/// Whether all volumes are the same in both, as in two cycles of a film.
bool same_times(const LoadedScene& scene, const SceneSnapshot& a, const SceneSnapshot& b) {
  for (int v = 0; v < a.volume_count; ++v) {
    const FrameTimes& times = scene.data[size_t(v)]->times;
    double apart_s = std::abs(a.volumes[size_t(v)].time_s - b.volumes[size_t(v)].time_s);
    // The end of a cycle is its beginning.
    if (times.cyclic()) apart_s = std::min(apart_s, std::abs(times.cycle_s - apart_s));
    if (apart_s > 1e-6) return false;
  }
  return true;
}

Status draw_film(FeelCommand command, const FilmChoices& choices, Console& console,
                 std::stop_token stop) {
  if (const Status named = FilmFile::check_name(choices.file); !named) return named;
  if (command.view.background == PictureBackground::kNone)
    command.view.background = PictureBackground::kDark;
  auto scene = shown_scene(command, console);
  if (!scene) return scene.error();
  const FilmCourse course = course_of(*scene, choices);
  const int pictures = std::max(1, int(std::lround(course.length_s * course.rate)));
  auto outputs = Outputs::into(choices.file.has_parent_path() ? choices.file.parent_path() : ".");
  if (!outputs) return outputs.error();
  auto drawing = open_drawing(command, std::move(*scene), false, true);
  if (!drawing) return drawing.error();
  const auto path = outputs->stage(choices.file.filename().string());
  if (!path) return path.error();
  std::optional<FilmFile> film;
  ViewChoices view = command.view;
  const double first_deg = view.from.azimuth_deg.value_or(usual_azimuth_deg());
  // Pictures of one cycle, if they fit, at their place in it.
  std::vector<std::optional<charts::Bitmap>> cycle(size_t(course.per_cycle));
  for (int k = 0; k < pictures; ++k) {
    if (stop.stop_requested()) return Error{ErrorKind::kCancelled, "Stopped: nothing was written"};
    console.progress(double(k) / pictures, "drawing");
    if (course.turn_deg != 0.0) view.from.azimuth_deg = first_deg + course.turn_deg * k / pictures;
    drawing->viewer->choose(view);
    const SceneSnapshot now = snapshot_at_time(drawing->scene, double(k) / course.rate);
    const size_t in_cycle = cycle.empty() ? 0 : size_t(k) % cycle.size();
    // Another volume of the scene may have another cycle.
    const bool is_known =
        !cycle.empty() && cycle[in_cycle] &&
        same_times(drawing->scene, now,
                   snapshot_at_time(drawing->scene, double(in_cycle) / course.rate));
    auto picture = is_known ? *cycle[in_cycle] : drawn(*drawing, now);
    if (!picture) return picture.error();
    if (!film) {
      auto started = FilmFile::start(*path, picture->width, picture->height, course.rate);
      if (!started) return started.error();
      film.emplace(std::move(*started));
      if (double(cycle.size()) * double(picture->pixels.size()) > kMostKeptPixels) cycle.clear();
    }
    if (const Status added = film->add(*picture); !added) return outputs->in_place(added.error());
    if (size_t(k) < cycle.size()) cycle[in_cycle] = std::move(*picture);
  }
  console.end_progress();
  if (const Status done = film->finish(); !done) return outputs->in_place(done.error());
  if (const Status done = outputs->publish(); !done) return done;
  console.say(fmt::format("Wrote     {}: {:.1f} s, {:.4g} pictures a second", choices.file.string(),
                          pictures / course.rate, course.rate));
  return Nothing{};
}

int run(FeelCommand command, double frame, bool show_wall, FilmChoices film) {
  command.request.shown_only = true;
  command.view.hand = false;
  loading::FeltWall& wall = command.request.sequence.wall;
  if (wall == loading::FeltWall::kUsual && !show_wall) wall = loading::FeltWall::kNotFelt;
  if (command.picture.empty() && command.headless.empty() && film.file.empty()) {
    command.request.motion = false;
    return run_feel(command);
  }
  Console console(command.quiet, false);
  const CancelOnSignal cancel;
  if (const Status look = check_look(command.view.look); !look) return fail(console, look.error());
  film.seconds = command.seconds;
  Status done = Nothing{};
  if (!command.picture.empty()) done = draw_picture(command, frame, console);
  if (done && !command.headless.empty()) done = draw_frames(command, console, cancel.token());
  if (done && !film.file.empty()) done = draw_film(command, film, console, cancel.token());
  return done ? kExitOk : fail(console, done.error());
}

}  // namespace

Command add_view(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  auto frame = std::make_shared<double>(0.0);
  auto show_wall = std::make_shared<bool>(false);
  auto film = std::make_shared<FilmChoices>();
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
  app->add_option("--film", film->file,
                  "Write a film (.webm, .mp4 or .gif) of whole cycles; of what stands still, once "
                  "around it. Needs no display, but the program ffmpeg")
      ->type_name("FILE");
  app->add_option("--turn", film->turn_deg,
                  "How far --film goes around the scene, degrees; 360: once, starting anew at its "
                  "end")
      ->check(number_in({-3600.0, 3600.0, false, "degrees"}));
  app->add_option("--average", command->view.averaged,
                  "Each picture in a file is the mean of so many, whose rays go through different "
                  "places of the pixels: smoother edges, less noise")
      ->check(whole_number_in(1, 64))
      ->capture_default_str();
  add_seeing(*app, *command);
  app->add_flag("--show-wall", *show_wall,
                "Show the wall that 'palpate feel' derives from the values, too; with --wall that "
                "one. It covers what is inside, and is found in some seconds");
  app->add_option("--seconds", command->seconds,
                  "Window or headset: end after this time; a film: its length")
      ->check(number_in(files::kRunTimes_s));
  add_session_options(
      *app, command->request,
      {"frames_per_second", "fields", "values", "nan_as", "image", "transform", "crc", "follow",
       "modes", "folder", "segments", "segments_frame", "segment_names", "wall", "cyclic"});
  add_gpu_option(*app, command->gpu);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command, frame, show_wall, film] { return run(*command, *frame, *show_wall, *film); },
          input_options(*app, {"input"}),
          {"--picture", "--headless", "--film"},
          {}};
}

}  // namespace palpate::app
