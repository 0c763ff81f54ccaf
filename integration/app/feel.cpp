#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "integration/app/commands.h"
#include "integration/app/feel_run.h"
#include "integration/app/option_checks.h"
#include "integration/app/series_option.h"
#include "integration/app/session_flags.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/openigtlink/client.h"
#include "module/scene/look.h"

namespace palpate::app {
namespace {

CLI::Validator a_look() {
  std::vector<std::string> names = preset_names();
  names.insert(names.begin(), "auto");
  return one_of(std::move(names));
}

void add_tool(CLI::App& app, FeelCommand& command) {
  app.add_option_function<std::string>(
         "--tool",
         [&command](const std::string& address) {
           if (!openigtlink::is_address(address))
             throw CLI::ValidationError(
                 "--tool", "'" + address + "' is no tracker's server: name it igtl://HOST:PORT");
           const Status set = running::set_option(command.request, "device", address);
           if (!set) throw CLI::ValidationError("--tool", set.error().message);
         },
         "A tracked tool is the hand: where an OpenIGTLink server's transforms say that its tip "
         "is, in the patient space of the first volume. It gives no force")
      ->type_name("igtl://HOST:PORT")
      ->excludes(app.get_option("--device"));
  app.get_option("--tool-name")->needs(app.get_option("--tool"));
}

void add_loop(CLI::App& app, FeelCommand& command) {
  app.add_option("--seconds", command.seconds,
                 "End after this time; else with the simulated hand's path, or at Ctrl-C")
      ->check(number_in(files::kRunTimes_s));
  app.add_flag("--servo-report", command.servo_report,
               "First run the servo thread alone for 5 s, without pictures and estimation, and "
               "report its periods beside those of the run");
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

/// From where the scene is seen, with how many eyes, and before what.
void add_camera(CLI::App& app, FeelCommand& command) {
  app.add_option_function<std::string>(
         "--stereo",
         [&command](const std::string& word) {
           const std::array words{"mono", "parallel", "crossed", "anaglyph"};
           const auto* at = std::find(words.begin(), words.end(), word);
           if (at != words.end()) command.view.stereo = Stereo(at - words.begin());
         },
         "Window and files: parallel (the left eye at the left), crossed (at the right), anaglyph "
         "(red and cyan glasses), mono. Without it, files for two eyes are parallel, all else is "
         "mono")
      ->check(one_of({"mono", "parallel", "crossed", "anaglyph"}))
      ->type_name("WORD");
  app.add_option_function<std::string>(
         "--background",
         [&command](const std::string& word) {
           command.view.background = word == "light"  ? PictureBackground::kLight
                                     : word == "none" ? PictureBackground::kNone
                                                      : PictureBackground::kDark;
         },
         "Behind the volume; none: a picture in a file is transparent there")
      ->check(one_of({"dark", "light", "none"}))
      ->type_name("WORD");
  app.add_option("--shadows", command.view.shadows,
                 "Share of the light that tissue in between takes from what lies behind or deep "
                 "inside; 0: no shadows, less work")
      ->check(number_in({0.0, 1.0}))
      ->capture_default_str();
  app.add_option("--azimuth", command.view.from.azimuth_deg,
                 "From where the scene is seen, degrees: 0 the front, 90 the patient's left, 180 "
                 "the back")
      ->check(number_in({-360.0, 360.0, false, "degrees"}));
  app.add_option("--elevation", command.view.from.elevation_deg,
                 "The same, degrees above the horizon")
      ->check(number_in({-85.0, 85.0, false, "degrees"}));
  app.add_option("--zoom", command.view.from.zoom, "How much larger it is seen")
      ->check(number_in({0.1, 20.0}))
      ->capture_default_str();
}

}  // namespace

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
      ->type_name("NUMBER")
      ->check(whole_number_in(0, 1'000'000));
  app.add_option("--refresh-rate", command.refresh_hz,
                 "Rate of the headset's display, Hz: the next one that its runtime offers. Without "
                 "it the highest at which the pictures are good enough")
      ->type_name("HZ")
      ->check(number_in({30.0, 500.0, false, "Hz"}));
  app.add_flag_callback(
      "--no-panel", [&command] { command.panel = false; },
      "In the headset, no text and slices beside the volume");
  app.add_flag_callback(
      "--no-mirror", [&command] { command.mirror = false; }, "No window besides the headset");
  app.add_option("--look", command.view.look,
                 "What the volume looks like; auto: what suits the data")
      ->check(a_look())
      ->capture_default_str();
  app.add_option("--look-level", command.view.level,
                 "Value in the middle of the look (HU for CT); in the window: middle drag up, down")
      ->check(number_in(files::kLookLevels));
  app.add_option("--look-width", command.view.width,
                 "Range of values that the look is spread over; in the window: middle drag left, "
                 "right")
      ->check(number_in(files::kWidths));
  app.add_flag("--whole-frames", command.view.whole_frames,
               "Draw the frames as they are, not moved between them (for comparison)");
  app.add_flag("--cut-open", command.view.cut_open,
               "Cut away what lies towards the eye, through what is touched");
  app.add_flag_callback(
      "--no-box", [&command] { command.view.box = false; },
      "No edges and letters around the volume");
  app.add_flag_callback(
      "--no-slices", [&command] { command.view.slices = false; },
      "No slices beside the picture (key S in the window)");
  add_camera(app, command);
  app.add_option("--picture-size", command.picture_size,
                 "Pixels along an edge of each eye's picture")
      ->check(whole_number_in(64, 2048))
      ->capture_default_str();
}

Command add_feel(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  CLI::App* app = program.add_subcommand("feel",
                                         "Feel heart, shell, molecule, a scene file (.json, .x3d), "
                                         "a sequence or a live source, at 1 kHz");
  app->add_option("input", command->request.inputs,
                  "heart, shell, molecule, a scene file, a sequence as in 'palpate motion', or "
                  "igtl://HOST:PORT: live images from an OpenIGTLink server")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->request.inputs);
  add_session_options(*app, command->request);
  app->get_option("--wall")->excludes(app->get_option("--segments"));
  add_tool(*app, *command);
  add_loop(*app, *command);
  app->add_option("--picture", command->picture, "Draw force, depth and phase over time (PNG)")
      ->type_name("FILE");
  app->add_option("--page", command->page,
                  "Write a page for browsers (.html): the moving volume, its "
                  "segments, force and numbers, in one file that needs no network")
      ->type_name("FILE");
  app->add_option("--replay", command->replay,
                  "Run a recording again, without a device, and compare every bit")
      ->type_name("FILE")
      ->check(an_existing_file());
  app->add_option("--tubes", command->tubes,
                  "Write the stream tubes that the hand has released (VTK polydata, for ParaView "
                  "and 3D Slicer); with --replay, those of the recording")
      ->type_name("FILE.vtk");
  add_seeing(*app, *command);
  add_felt_seeing(*app, *command);
  add_gpu_option(*app, command->gpu);
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command] { return run_feel(*command); },
          input_options(*app, {"input", "--replay", "--calibration"}),
          output_options(*app, {"--picture", "--page", "--tubes", "--headless"}),
          {}};
}

}  // namespace palpate::app
