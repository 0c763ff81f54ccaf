#include "integration/app/commands.h"
#include "integration/app/feel_run.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/app/series_option.h"
#include "integration/files/scene/option_ranges.h"

namespace palpate::app {

Command add_serve(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  command->hand = command->view.hand = false;
  command->headset = "off";
  command->serve_port = kServePort;
  command->sequence.wall = loading::FeltWall::kNotFelt;
  CLI::App* app = program.add_subcommand(
      "serve",
      "Send a moving volume and its motion to OpenIGTLink clients (3D Slicer), without a hand or "
      "pictures; 'palpate feel --serve' sends what is felt, too");
  app->add_option("input", command->inputs,
                  "heart, shell, molecule, a scene file, a sequence as in 'palpate motion', or "
                  "igtl://HOST:PORT: live images from an OpenIGTLink server")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->inputs);
  app->add_option("--port", command->serve_port, "Where clients connect")
      ->type_name("PORT")
      ->check(whole_number_in(files::kPorts))
      ->capture_default_str();
  app->add_option("--seconds", command->seconds, "End after this time; else at Ctrl-C")
      ->check(number_in(files::kRunTimes_s));
  add_frame_rate(*app, command->sequence.frames_per_second);
  app->add_option("--fields", command->sequence.fields,
                  "What 'palpate motion' wrote, its folder or its sequence_motion.nrrd; else the "
                  "motion is estimated meanwhile")
      ->type_name("PATH")
      ->check(an_existing_path());
  add_values(*app, command->sequence);
  add_live(*app, *command);
  app->add_option("--preset", command->preset,
                  "Effort of the estimation, as in 'palpate motion' (balanced; of a live source: "
                  "fast)")
      ->check(one_of_the_presets());
  app->add_flag_callback(
      "--not-cyclic", [command] { command->sequence.cyclic = false; },
      "The last frame does not lead back to the first");
  add_gpu_option(*app, command->gpu);
  app->add_flag(
      "--json", command->json,
      "For programs: a JSON object on stdout when clients may connect, and one at the end");
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app, [command] { return run_feel(*command); }, {"input", "--fields"}, {}, {}};
}

}  // namespace palpate::app
