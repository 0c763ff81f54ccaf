#include <fmt/format.h>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_report.h"
#include "integration/app/feel_run.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "integration/app/series_option.h"
#include "integration/app/session_flags.h"
#include "integration/running/open_session.h"
#include "module/haptics/scene/scene.h"

namespace palpate::app {
namespace {

int run(const running::SessionRequest& request) {
  Console console(false, false);
  const auto scene = loading::load_scene(request.inputs, request.sequence);
  if (!scene) return fail(console, scene.error());
  running::SessionRequest of_scene = request;
  if (const Status asked = running::set_scene_options(of_scene, scene->spec); !asked)
    return fail(console, asked.error());
  const auto planned = plan(scene->spec, scene->data, scene->kinds);
  if (!planned) return fail(console, planned.error());
  console.say(text(**planned));
  for (size_t v = 0; v < scene->data.size(); ++v)
    for (const Segment& segment : scene->data[v]->segments)
      console.say(segment_text(segment, scene->spec.volumes[v]));
  for (const MissingMotion& missing : scene->missing)
    console.say(fmt::format(
        "The motion of {} is not known yet: 'palpate feel' estimates it while the still frame is "
        "felt.",
        scene->spec.volumes[missing.volume].name));
  for (const std::string& note : notes_of(*scene)) console.say("Note      " + note);
  return kExitOk;
}

}  // namespace

Command add_plan(CLI::App& program) {
  auto request = std::make_shared<running::SessionRequest>();
  CLI::App* app = program.add_subcommand(
      "plan", "Say what a scene needs in each haptic frame, what is left out, and why");
  app->add_option("input", request->inputs, "heart, shell, molecule, a scene file, or a sequence")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, request->inputs);
  add_session_options(*app, *request,
                      {"frames_per_second", "fields", "values", "nan_as", "modes", "folder",
                       "segments", "segments_frame", "segment_names", "wall"});
  app->get_option("--wall")->excludes(app->get_option("--segments"));
  return {app, [request] { return run(*request); }, input_options(*app, {"input"}), {}, {}};
}

}  // namespace palpate::app
