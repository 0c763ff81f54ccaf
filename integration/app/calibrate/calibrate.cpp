#include "integration/app/calibrate/calibrate_run.h"
#include "integration/app/commands.h"

namespace palpate::app {

Command add_calibrate(CLI::App& program) {
  auto command = std::make_shared<CalibrateCommand>();
  CLI::App* app = program.add_subcommand(
      "calibrate", "Find where the force device stands in the room of the headset");
  app->add_option("-o,--output", command->output, "File for the calibration (JSON)")->required();
  app->add_option("--by", command->by,
                  "points: touch the device's tip with a controller at several places; movement: "
                  "move and turn a stylus to which the controller is clipped")
      ->check(CLI::IsMember({"points", "movement"}))
      ->capture_default_str();
  app->add_option("--device", command->device.device,
                  "Force device; simulated goes by itself where a hand would take it")
      ->check(CLI::IsMember({"auto", "falcon", "simulated"}))
      ->capture_default_str();
  app->add_option("--falcon-firmware", command->device.falcon_firmware,
                  "Your own copy of the Falcon's firmware; palpate ships none");
  app->add_option("--hand", command->hand, "Which hand holds the controller")
      ->check(CLI::IsMember({"left", "right"}))
      ->capture_default_str();
  app->add_option("--points", command->points, "How many places to touch")
      ->check(CLI::Range(5, 200))
      ->capture_default_str();
  app->add_option("--seconds", command->seconds,
                  "How long to record the movement (30), or the turning about the tip (15)")
      ->check(CLI::Range(5.0, 600.0));
  app->add_option("--tip", command->tip,
                  "The controller's touching tip, mm in its grip's axes: X,Y,Z; or pivot: found by "
                  "turning the controller about it")
      ->check([](const std::string& text) {
        return text == "pivot" || tip_of(text) ? std::string()
                                               : "say X,Y,Z in mm, or pivot, instead of " + text;
      });
  app->add_option("--wait", command->wait_s, "Give up after so many s without a headset")
      ->check(CLI::Range(0.0, 1e6));
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app, [command] { return run_calibrate(*command); }, {"--falcon-firmware"}, {"--output"}, {}};
}

}  // namespace palpate::app
