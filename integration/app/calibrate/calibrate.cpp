#include "integration/app/calibrate/calibrate_run.h"
#include "integration/app/commands.h"
#include "integration/app/force_device.h"
#include "integration/app/option_checks.h"

namespace palpate::app {

Command add_calibrate(CLI::App& program) {
  auto command = std::make_shared<CalibrateCommand>();
  CLI::App* app = program.add_subcommand(
      "calibrate", "Find where the force device stands in the room of the headset");
  app->add_option("-o,--output", command->output, "File for the calibration (JSON)")
      ->type_name("FILE")
      ->required();
  app->add_option("--by", command->by,
                  "points: touch the device's tip with a controller at several places; movement: "
                  "move and turn a stylus to which the controller is clipped")
      ->check(one_of({"points", "movement"}))
      ->capture_default_str();
  app->add_option("--device", command->device,
                  "Force device; simulated moves by itself as a hand would move it")
      ->check(a_force_device({"simulated"}))
      ->capture_default_str();
  app->add_option("--falcon-firmware", command->falcon_firmware,
                  "Your own copy of the Falcon's firmware; palpate ships none")
      ->type_name("FILE");
  app->add_option("--hand", command->hand, "Which hand holds the controller")
      ->check(one_of({"left", "right"}))
      ->capture_default_str();
  app->add_option("--points", command->points, "How many places to touch")
      ->check(whole_number_in(5, 200))
      ->capture_default_str();
  app->add_option("--seconds", command->seconds,
                  "How long to record the movement (30), or the turning about the tip (15)")
      ->check(number_in({5.0, 600.0}));
  app->add_option("--tip", command->tip,
                  "The controller's touching tip, mm in its grip's axes: X,Y,Z; or pivot: found by "
                  "turning the controller about it")
      ->check([](const std::string& text) {
        if (text == "pivot" || tip_of(text)) return std::string();
        return "X,Y,Z in mm, each from -1000 to 1000, or pivot is expected, not '" + text + "'";
      });
  app->add_option("--wait", command->wait_s, "Give up after so many s without a headset")
      ->check(number_in({0.0, 1e6}));
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {
      app, [command] { return run_calibrate(*command); }, {"--falcon-firmware"}, {"--output"}, {}};
}

}  // namespace palpate::app
