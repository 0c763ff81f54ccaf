#include "integration/app/commands.h"
#include "integration/app/feel_run.h"
#include "integration/app/option_checks.h"
#include "integration/app/series_option.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/files/scene/scene_file.h"
#include "module/scene/look.h"

namespace palpate::app {
namespace {

CLI::Validator a_look() {
  std::vector<std::string> names = preset_names();
  names.insert(names.begin(), "auto");
  return one_of(std::move(names));
}

void add_device(CLI::App& app, FeelCommand& command) {
  app.add_option("--device", command.device.device,
                 "Force device; KIND@PLACE is the one that 'palpate devices' shows there")
      ->check(a_force_device({"controller", "mouse", "simulated"}))
      ->capture_default_str();
  app.add_option("--falcon-firmware", command.device.falcon_firmware,
                 "Your own copy of the Falcon's firmware; palpate ships none")
      ->type_name("FILE");
  app.add_option("--path", command.device.path,
                 "Simulated hand: press, tap, stroke, circle, sweep, or a file of t_s,x_m,y_m,z_m")
      ->capture_default_str();
  app.add_option("--hand", command.device.hand, "Simulated hand: how it holds the device")
      ->check(one_of({"human", "loose", "firm", "none"}))
      ->capture_default_str();
  app.add_option("--lets-go", command.device.lets_go_at_s,
                 "Simulated hand: lets go after so many s")
      ->check(number_in(files::kLettingGo_s));
  app.add_option("--stiffness", command.stiffness_n_per_m,
                 "Of the spring, N/m, instead of the scene's")
      ->check(number_in(files::kStiffnesses_n_per_m));
  app.add_option("--max-force", command.max_force_n, "N, instead of the scene's")
      ->check(number_in(files::kForces_n));
  app.add_flag("--dead-man", command.dead_man,
               "Force only while a button of the device, or a controller's dead-man, is held");
}

void add_tool(CLI::App& app, FeelCommand& command) {
  CLI::Option* tool =
      app.add_option(
             "--tool", command.tool,
             "A tracked tool is the hand: where an OpenIGTLink server's transforms say that "
             "its tip is, in the patient space of the first volume. It gives no force")
          ->type_name("igtl://HOST:PORT")
          ->excludes(app.get_option("--device"));
  app.add_option("--tool-name", command.tool_name,
                 "The transforms of this device name (default: of the first that come)")
      ->type_name("NAME")
      ->needs(tool);
}

void add_loop(CLI::App& app, FeelCommand& command) {
  app.add_option("--seconds", command.seconds,
                 "End after this time; else with the simulated hand's path, or at Ctrl-C")
      ->check(number_in(files::kRunTimes_s));
  app.add_option("--core", command.core, "Pin the servo thread to this core")->check(a_core());
  app.add_flag("--no-real-time", command.no_real_time,
               "Ask the system for no priority and no locked memory");
  app.add_flag("--servo-report", command.servo_report,
               "First run the servo thread alone for 5 s, without pictures and estimation, and "
               "report its periods beside those of the run");
  app.add_option("--watchdog", command.watchdog_ms,
                 "A tick later than this is a fault, ms (5; simulated: 50)")
      ->check(number_in(files::in_unit(files::kWatchdogs_s, 1e3, "ms")));
}

void add_sequence(CLI::App& app, FeelCommand& command) {
  app.add_option("--iso-value,--level", command.sequence.iso_value,
                 "Value of the surface to feel; else found in the data")
      ->check(number_in(files::kAnyNumber));
  app.add_option("--width", command.sequence.width,
                 "Over so many values around it the strength rises")
      ->check(number_in(files::kWidths));
  app.add_option("--strength", command.sequence.strength_n, "Greatest force of the surface, N")
      ->check(number_in(files::kSurfaceStrengths_n))
      ->capture_default_str();
  app.add_option("--friction", command.sequence.friction, "Coulomb's mu")
      ->check(number_in(files::kFrictions))
      ->capture_default_str();
  add_frame_rate(app, command.sequence.frames_per_second);
  app.add_option(
         "--fields", command.sequence.fields,
         "What 'palpate motion' wrote, its folder or its sequence_motion.nrrd; else the motion is "
         "estimated while it is felt")
      ->type_name("PATH")
      ->check(an_existing_path());
  add_values(app, command.sequence);
  add_modes(app, command.sequence);
  add_segments(app, command.sequence);
  add_wall(app, command.sequence);
  app.add_option("--preset", command.preset,
                 "Effort of the estimation, as in 'palpate motion' (balanced; of a live source: "
                 "fast)")
      ->check(one_of_the_presets());
  app.add_option("--scale", command.scale,
                 "Size of the volume: fit (into the device's reach), or a number")
      ->check([](const std::string& text) {
        const std::string wrong = number_in(files::kScales)(text);
        return text == "fit" || wrong.empty() ? std::string() : "'fit' or " + wrong;
      })
      ->capture_default_str();
  app.add_flag("--estimate", command.estimate,
               "heart, shell: forget the known motion and estimate it, as a patient's would be");
  app.add_flag("--no-motion", command.no_motion,
               "Feel the frames as they are, without motion between them");
  app.add_flag_callback(
      "--not-cyclic", [&command] { command.sequence.cyclic = false; },
      "The last frame does not lead back to the first");
}

void add_felt_seeing(CLI::App& app, FeelCommand& command) {
  app.add_option("--on-headset-loss", command.on_headset_loss,
                 "When the picture in the headset goes away: ramp (the force goes down until it is "
                 "back) or go-on")
      ->check(one_of({"ramp", "go-on"}))
      ->capture_default_str();
  app.add_flag_callback(
      "--no-sound", [&command] { command.sound = false; },
      "In the headset, no sound where a bare fingertip touches");
  app.add_option("--calibration", command.calibration,
                 "Where the force device stands in the room, from 'palpate calibrate'")
      ->type_name("FILE")
      ->check(an_existing_file());
  app.add_option("--headless", command.headless,
                 "Write stereo pictures and a page of what was seen and felt into this folder; "
                 "needs no display")
      ->type_name("DIR");
}

}  // namespace

void add_frame_rate(CLI::App& app, double& frames_per_second) {
  app.add_option("--fps,--frames-per-second", frames_per_second,
                 "Frames per second, instead of the file's times. Without either, all frames are "
                 "played in one second, at most 30 a second")
      ->check(number_in(files::kFrameRates));
}

void add_values(CLI::App& app, loading::SequenceChoices& choices) {
  std::vector<std::string> words;
  for (const auto& [word, values] : files::SceneWords::kValues) words.emplace_back(word);
  app.add_option_function<std::string>(
         "--values",
         [&choices](const std::string& word) {
           for (const auto& [name, values] : files::SceneWords::kValues)
             if (name == word) choices.values = values;
         },
         "Whose values: reference (one frame's, carried by one motion: the same wall at every "
         "phase), mean (of all frames where their material is in that one, carried likewise: less "
         "noise), own (each frame's own: for flows and simulations). Without it: reference where "
         "one motion is known or found, else own")
      ->type_name("WORD")
      ->check(one_of(std::move(words)));
  add_nan_as(app, choices.nan_as, ", as SPM and fMRIPrep write outside the body");
}

void add_wall(CLI::App& app, loading::SequenceChoices& choices) {
  using loading::FeltWall;
  app.add_option_function<std::string>(
         "--wall",
         [&choices](const std::string& word) {
           choices.wall = word == "values"   ? FeltWall::kValues
                          : word == "region" ? FeltWall::kRegion
                                             : FeltWall::kRidges;
         },
         "What surface is felt of scalars: values (the iso-surface), region (a smooth one around "
         "what is brighter), ridges (where the values rise most steeply). Without it: values if "
         "they make a closed wall, else region")
      ->type_name("WORD")
      ->check(one_of({"values", "region", "ridges"}))
      ->excludes(app.get_option("--segments"));
}

void add_modes(CLI::App& app, loading::SequenceChoices& choices) {
  app.add_option("--modes", choices.mode_libraries,
                 "Libraries (.so) with haptic modes of your own, which a scene file may name: code "
                 "that is run (docs/writing-a-mode.md)")
      ->type_name("FILE")
      ->check(an_existing_file());
}

void add_segments(CLI::App& app, loading::SequenceChoices& choices) {
  app.add_option("--folder", choices.folder,
                 "Folder in which the files that a scene file names are; else beside it")
      ->type_name("DIR")
      ->check(an_existing_folder());
  app.add_option("--segments", choices.segments,
                 "Segmentation: a .seg.nrrd of 3D Slicer or a label map, one or one per frame. Its "
                 "parts are the walls; the values only with --iso-value")
      ->type_name("FILE")
      ->check(an_existing_file());
  app.add_option("--segments-frame", choices.segments_frame,
                 "The frame, from 0 on, that a single segmentation is of")
      ->check(whole_number_in(files::kFrameNumbers))
      ->capture_default_str();
  app.add_option("--segment", choices.segment_names,
                 "Only these parts of the segmentation, by name or label")
      ->type_name("NAME");
}

void add_live(CLI::App& app, FeelCommand& command) {
  app.add_option("--image", command.live_image,
                 "igtl://...: the images of this device name (default: of the first that comes)")
      ->type_name("NAME");
  app.add_option("--transform", command.live_transform,
                 "igtl://...: the transforms of this device name move the volume")
      ->type_name("NAME");
  app.add_flag(
      "--no-crc", command.no_crc,
      "igtl://...: accept messages whose sender computes no CRC (PLUS does so if it is not "
      "asked to); the same as ?crc=none behind the address");
  app.add_flag_callback(
      "--follow", [&command] { command.keep_cycles = false; },
      "igtl://...: follow every frame, even where they repeat");
}

void add_seeing(CLI::App& app, FeelCommand& command) {
  app.add_option("--headset", command.headset,
                 "openxr: in a headset, which is waited for; none: in a window (when feeling, the "
                 "mouse is the hand if no force device is); off: nowhere; auto: the first of these "
                 "that is there")
      ->check(one_of({"auto", "openxr", "none", "off"}))
      ->capture_default_str();
  app.add_flag("--pass-through", command.pass_through,
               "In the headset, show the room behind the volume, where the headset can");
  app.add_option(
         "--overlay", command.overlay,
         "In the headset, above the picture of another OpenXR program that runs; of several "
         "overlays the higher number is in front. Needs a runtime that can (Monado, WiVRn)")
      ->type_name("PLACE")
      ->check(whole_number_in(0, 1'000'000));
  app.add_flag_callback(
      "--no-mirror", [&command] { command.mirror = false; }, "No window besides the headset");
  app.add_option("--look", command.view.look,
                 "What the volume looks like; auto: what suits the data")
      ->check(a_look())
      ->capture_default_str();
  app.add_flag("--whole-frames", command.view.whole_frames,
               "Draw the frames as they are, not moved between them (for comparison)");
  app.add_flag("--cut-open", command.view.cut_open,
               "Cut away what lies towards the eye, through what is touched");
  app.add_flag_callback(
      "--no-box", [&command] { command.view.box = false; },
      "No edges and letters around the volume");
  app.add_option("--picture-size", command.picture_size,
                 "Pixels along an edge of each eye's picture")
      ->check(whole_number_in(64, 2048))
      ->capture_default_str();
}

std::string server_address(const FeelCommand& command, const std::string& place) {
  constexpr const char* kNoCrc = "?crc=none";
  return place + (command.no_crc && !place.ends_with(kNoCrc) ? kNoCrc : "");
}

Command add_feel(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  CLI::App* app = program.add_subcommand("feel",
                                         "Feel heart, shell, molecule, a scene file (.json, .x3d), "
                                         "a sequence or a live source, at 1 kHz");
  app->add_option("input", command->inputs,
                  "heart, shell, molecule, a scene file, a sequence as in 'palpate motion', or "
                  "igtl://HOST:PORT: live images from an OpenIGTLink server")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->inputs);
  add_device(*app, *command);
  add_tool(*app, *command);
  add_loop(*app, *command);
  add_sequence(*app, *command);
  add_live(*app, *command);
  app->add_option("--serve", command->serve_port,
                  "Send what is felt, the moved volume and its motion to OpenIGTLink clients (3D "
                  "Slicer) that connect to this port")
      ->type_name("PORT")
      ->check(whole_number_in(files::kPorts));
  app->add_option("--csv", command->csv, "Write every tick")->type_name("FILE");
  app->add_option("--picture", command->picture, "Draw force, depth and phase over time (PNG)")
      ->type_name("FILE");
  app->add_option("--record", command->record, "Record all that the loop depends on")
      ->type_name("FILE");
  app->add_option("--replay", command->replay,
                  "Run a recording again, without a device, and compare every bit")
      ->type_name("FILE")
      ->check(an_existing_file());
  app->add_option("--tubes", command->tubes,
                  "Write the stream tubes that the hand has released (VTK polydata, for ParaView "
                  "and 3D Slicer); with --replay, those of the recording")
      ->type_name("FILE.vtk");
  app->add_option("--black-box", command->black_box,
                  "Folder for the ticks around a fault (default: $XDG_STATE_HOME/palpate, or "
                  "~/.local/state/palpate)")
      ->type_name("DIR");
  add_seeing(*app, *command);
  add_felt_seeing(*app, *command);
  add_gpu_option(*app, command->gpu);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command] { return run_feel(*command); },
          {"input", "--fields", "--folder", "--modes", "--segments", "--replay", "--calibration",
           "--falcon-firmware", "--path"},
          {"--csv", "--picture", "--record", "--tubes", "--headless", "--black-box"},
          {}};
}

}  // namespace palpate::app
