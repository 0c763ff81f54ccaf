#include <cstdlib>

#include "integration/app/commands.h"
#include "integration/app/feel_run.h"

namespace palpate::app {
namespace {

void add_device(CLI::App& app, FeelCommand& command) {
  app.add_option("--device", command.device.device, "Force device")
      ->check(CLI::IsMember({"auto", "falcon", "controller", "mouse", "simulated"}))
      ->capture_default_str();
  app.add_option("--falcon-firmware", command.device.falcon_firmware,
                 "Your own copy of the Falcon's firmware; palpate ships none");
  app.add_option("--path", command.device.path,
                 "Simulated hand: press, tap, stroke, circle, sweep, or a file of t_s,x_m,y_m,z_m")
      ->capture_default_str();
  app.add_option("--hand", command.device.hand, "Simulated hand: human, loose, firm, none")
      ->capture_default_str();
  app.add_option("--lets-go", command.device.lets_go_at_s,
                 "Simulated hand: lets go after so many s");
  app.add_option("--stiffness", command.stiffness_n_per_m,
                 "Of the spring, N/m, instead of the scene's")
      ->check(CLI::Range(1.0, 1e5));
  app.add_option("--max-force", command.max_force_n, "N, instead of the scene's")
      ->check(CLI::Range(0.01, 100.0));
  app.add_flag("--dead-man", command.dead_man,
               "Force only while a button of the device, or a controller's dead-man, is held");
}

void add_loop(CLI::App& app, FeelCommand& command) {
  app.add_option("--seconds", command.seconds,
                 "End after so long; else with the simulated hand's path, or at Ctrl-C")
      ->check(CLI::Range(0.1, 1e6));
  app.add_option("--core", command.core, "Pin the servo thread to this core");
  app.add_flag("--no-real-time", command.no_real_time,
               "Ask the system for no priority and no locked memory");
  app.add_flag("--servo-report", command.servo_report,
               "First run the servo thread alone for 5 s, without pictures and estimation, and "
               "report its periods beside those of the run");
  app.add_option("--watchdog", command.watchdog_ms,
                 "A tick later than this is a fault, ms (5; simulated: 50)")
      ->check(CLI::Range(1.0, 1000.0));
}

void add_sequence(CLI::App& app, FeelCommand& command) {
  app.add_option("--level", command.sequence.level,
                 "Value of the surface to feel; else found in the data");
  app.add_option("--width", command.sequence.width,
                 "Over so many values around it the strength rises");
  app.add_option("--strength", command.sequence.strength_n, "N that the surface holds")
      ->capture_default_str();
  app.add_option("--friction", command.sequence.friction, "Coulomb's mu")->capture_default_str();
  app.add_option("--fps", command.sequence.frames_per_second,
                 "Frames per second, instead of the file's times");
  app.add_option(
         "--fields", command.sequence.fields,
         "Folder with the fields of 'palpate motion'; else they are estimated while it is felt")
      ->check(CLI::ExistingDirectory);
  app.add_option("--preset", command.preset, "Effort of the estimation, as in 'palpate motion'")
      ->capture_default_str();
  app.add_option("--scale", command.scale,
                 "Size of the volume: fit (into the device's reach), or a number")
      ->check([](const std::string& text) {
        char* end = nullptr;
        const double scale = std::strtod(text.c_str(), &end);
        const bool number = *end == '\0' && scale >= 1e-4 && scale <= 1e4;
        return text == "fit" || number ? std::string() : "is 'fit' or a number from 1e-4 to 1e4";
      })
      ->capture_default_str();
  app.add_flag("--estimate", command.estimate,
               "heart, shell: forget the known motion and estimate it, as a patient's would be");
  app.add_flag("--no-motion", command.no_motion,
               "Feel the frames as they are, without motion between them");
  app.add_flag("!--not-cyclic", command.sequence.cyclic,
               "The last frame does not lead back to the first");
}

void add_felt_seeing(CLI::App& app, FeelCommand& command) {
  app.add_option("--on-headset-loss", command.on_headset_loss,
                 "When the picture in the headset goes away: ramp (the force goes down until it is "
                 "back) or go-on")
      ->check(CLI::IsMember({"ramp", "go-on"}))
      ->capture_default_str();
  app.add_option("--calibration", command.calibration,
                 "Where the force device stands in the room, from 'palpate calibrate'")
      ->check(CLI::ExistingFile);
  app.add_option("--headless", command.headless,
                 "Write stereo pictures and a page of what was seen and felt into this folder; "
                 "needs no display");
}

}  // namespace

void add_seeing(CLI::App& app, FeelCommand& command) {
  app.add_option("--headset", command.headset,
                 "openxr: in a headset, which is waited for; none: in a window (when feeling, the "
                 "mouse is the hand if no force device is); off: nowhere; auto: the first of these "
                 "that is there")
      ->check(CLI::IsMember({"auto", "openxr", "none", "off"}))
      ->capture_default_str();
  app.add_flag("--pass-through", command.pass_through,
               "In the headset, show the room behind the volume, where the headset can");
  app.add_flag("!--no-mirror", command.mirror, "No window besides the headset");
  app.add_option("--look", command.view.look,
                 "What the volume looks like: auto, or CT bone, CT heart, CT lung, MR, ...")
      ->capture_default_str();
  app.add_flag("--whole-frames", command.view.whole_frames,
               "Draw the frames as they are, not moved between them (the old way)");
  app.add_flag("--cut-open", command.view.cut_open,
               "Cut away what lies towards the eye, through what is touched");
  app.add_flag("!--no-box", command.view.box, "No edges and letters around the volume");
  app.add_option("--picture-size", command.picture_size,
                 "Pixels along an edge of each eye's picture")
      ->check(CLI::Range(64, 2048))
      ->capture_default_str();
}

Command add_feel(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  CLI::App* app = program.add_subcommand(
      "feel", "Feel heart, shell, molecule, a scene file (.json) or a sequence, at 1 kHz");
  app->add_option("input", command->inputs,
                  "heart, shell, molecule, a scene file, or a sequence as in 'palpate motion'")
      ->required();
  add_device(*app, *command);
  add_loop(*app, *command);
  add_sequence(*app, *command);
  app->add_option("--csv", command->csv, "Write every tick");
  app->add_option("--picture", command->picture, "Draw force, depth and phase over time (PNG)");
  app->add_option("--record", command->record, "Record all that the loop depends on");
  app->add_option("--replay", command->replay,
                  "Run a recording again, without a device, and compare every bit")
      ->check(CLI::ExistingFile);
  app->add_option("--black-box", command->black_box,
                  "Folder for the ticks around a fault (default: $XDG_STATE_HOME/palpate, or "
                  "~/.local/state/palpate)")
      ->check(CLI::ExistingDirectory);
  add_seeing(*app, *command);
  add_felt_seeing(*app, *command);
  app->add_option("--gpu", command->gpu.device,
                  "Vulkan device for the estimation: number or part of a name");
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app, [command] { return run_feel(*command); }};
}

}  // namespace palpate::app
