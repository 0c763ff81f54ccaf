#include <fmt/format.h>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "integration/files/atomic_file.h"
#include "integration/files/scene/scene_file.h"
#include "integration/files/sentences.h"
#include "integration/loading/load_scene.h"
#include "integration/running/recording_mcap.h"
#include "integration/x3d/x3d_file.h"
#include "module/scene/analytic_data.h"
#include "module/scene/make_volume.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

/// Converts the settings of place and time to those of X3D: a box around the data of files, and the
/// length of a cycle instead of frames per second. Both need the data.
Status use_words_of_x3d(SceneSpec& spec, const LoadedScene& loaded) {
  for (size_t v = 0; v < spec.volumes.size(); ++v) {
    VolumeSpec& volume = spec.volumes[v];
    const MovingVolume& data = *loaded.data[v];
    if (volume.source == "molecule") {
      const FrameData& frame = *data.frames.front();
      volume.source = "charges";
      volume.charges = dichloroethane_charges();
      volume.box_m = frame.high_m() - frame.low_m();
    }
    if (!volume.source.empty()) continue;
    if (volume.frames_per_second > 0.0) {
      volume.cycle_s = data.times.length_s();
      volume.frames_per_second = 0.0;
    }
    if (volume.box_m || data.frames.front()->is_vector()) continue;
    const Status placed = place_by_box(volume, data, loaded.spec.volumes[v].transform);
    if (!placed) return placed;
  }
  return Nothing{};
}

Status convert(const fs::path& input, const fs::path& output, Console& console) {
  if (output.extension() == ".mcap") {
    const auto ticks = running::write_mcap(input, output);
    if (!ticks) return ticks.error();
    console.say(fmt::format("Wrote     {}: {} ticks", output.string(), *ticks));
    return Nothing{};
  }
  if (output.extension() != ".json" && output.extension() != ".x3d")
    return files::bad_output(output,
                             "is neither .json nor .x3d nor .mcap: name a file with one of these "
                             "endings");
  if (const Status can = files::check_can_write_file(output); !can) return can;
  auto loaded = loading::load_scene({input}, {});
  if (!loaded) return loaded.error();
  SceneSpec spec = loaded->spec;
  // The scene as written, before its data were loaded. Modes that were chosen are kept.
  if (x3d::is_x3d(input)) {
    auto read = x3d::read_x3d(input);
    if (!read) return read.error();
    spec = std::move(read->spec);
    if (spec.modes.empty()) spec.modes = loaded->spec.modes;
  } else if (input.extension() == ".json") {
    auto read = files::read_scene(input);
    if (!read) return read.error();
    spec = std::move(*read);
  }
  // A box that is only assumed is no box for an oblique grid.
  for (size_t v = 0; v < spec.volumes.size(); ++v) {
    VolumeSpec& volume = spec.volumes[v];
    const MovingVolume& data = *loaded->data[v];
    if (!volume.box_assumed || filled_box(volume, data) == *volume.box_m) continue;
    const Status placed = place_by_box(volume, data, loaded->spec.volumes[v].transform);
    if (!placed) return placed;
  }
  for (const Note& note : loaded->notes) console.say("Note      " + note_text(note));
  std::string text;
  if (output.extension() == ".x3d") {
    if (const Status said = use_words_of_x3d(spec, *loaded); !said) return said;
    auto written = x3d::x3d_text(spec, output);
    if (!written) return written.error();
    for (const std::string& note : written->notes) console.say("Note      " + note);
    text = std::move(written->text);
  } else {
    text = files::scene_text(spec, output);
  }
  if (const Status written = files::write_text(output, text); !written) return written;
  console.say(fmt::format("Wrote     {}", output.string()));
  return Nothing{};
}

}  // namespace

Command add_convert(CLI::App& program) {
  auto input = std::make_shared<fs::path>();
  auto output = std::make_shared<fs::path>();
  CLI::App* app = program.add_subcommand(
      "convert",
      "Write a scene as X3D, an X3D scene as JSON, or a recording as MCAP, and say what is lost");
  app->add_option("input", *input, "A scene file (.json, .x3d), molecule, or a recording")
      ->type_name("PATH")
      ->required();
  app->add_option("output", *output,
                  "The file to write: .json or .x3d of a scene, .mcap of a recording")
      ->type_name("FILE")
      ->required();
  return {app,
          [input, output] {
            Console console(false, false);
            const Status done = convert(*input, *output, console);
            return done ? kExitOk : fail(console, done.error());
          },
          {"input"},
          {"output"},
          {}};
}

}  // namespace palpate::app
