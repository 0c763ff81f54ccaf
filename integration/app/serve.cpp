#include "integration/app/commands.h"
#include "integration/app/feel_run.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/app/series_option.h"
#include "integration/app/session_flags.h"
#include "integration/files/scene/option_ranges.h"

namespace palpate::app {

namespace {

/// With a page the scene is felt, by a hand in the page and by no force device.
void give_hand(FeelCommand& command, bool serves_too) {
  running::SessionRequest& request = command.request;
  if (!serves_too) request.serve = 0;
  request.shown_only = false;
  if (!request.given.contains("wall")) request.sequence.wall = loading::FeltWall::kUsual;
  // A scene file may not choose another device, or write.
  request.device = "page";
  request.real_time = false;
  request.black_box = "off";
  for (const char* key : {"device", "second_device", "real_time", "black_box"})
    request.given.insert(key);
  command.page_hand = true;
}

}  // namespace

Command add_serve(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  command->request.shown_only = true;
  command->view.hand = false;
  command->headset = "off";
  command->request.serve = kServePort;
  command->request.sequence.wall = loading::FeltWall::kNotFelt;
  CLI::App* app = program.add_subcommand(
      "serve",
      "Send a moving volume and its motion to OpenIGTLink clients (3D Slicer), without a hand or "
      "pictures; 'palpate feel --serve' sends what is felt, too");
  app->add_option("input", command->request.inputs,
                  "heart, shell, molecule, a scene file, a sequence as in 'palpate motion', or "
                  "igtl://HOST:PORT: live images from an OpenIGTLink server")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->request.inputs);
  app->add_option("--port", command->request.serve, "Where clients connect")
      ->type_name("PORT")
      ->check(whole_number_in(files::kPorts))
      ->capture_default_str();
  app->add_option("--seconds", command->seconds, "End after this time; else at Ctrl-C")
      ->check(number_in(files::kRunTimes_s));
  add_session_options(*app, command->request,
                      {"web", "web_address", "wall", "iso_value", "segments", "segments_frame",
                       "segment_names", "frames_per_second", "fields", "values", "nan_as", "image",
                       "transform", "crc", "follow", "preset", "cyclic"});
  add_gpu_option(*app, command->gpu);
  app->add_flag(
      "--json", command->json,
      "For programs: a JSON object on stdout when clients may connect, and one at the end");
  app->add_flag("--quiet", command->quiet, "Print errors only");
  return {app,
          [command, app] {
            if (command->request.web > 0) give_hand(*command, app->count("--port") > 0);
            return run_feel(*command);
          },
          input_options(*app, {"input"}),
          {},
          {}};
}

}  // namespace palpate::app
