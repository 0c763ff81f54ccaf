#include <fmt/format.h>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/feel_run.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "integration/app/series_option.h"
#include "integration/loading/load_scene.h"
#include "module/haptics/scene/scene.h"

namespace palpate::app {
namespace {

int run(const std::vector<std::filesystem::path>& inputs, const loading::SequenceChoices& choices) {
  Console console(false, false);
  const auto scene = loading::load_scene(inputs, choices);
  if (!scene) return fail(console, scene.error());
  const auto planned = plan(scene->spec, scene->data, scene->kinds);
  if (!planned) return fail(console, planned.error());
  console.say(text(**planned));
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
  auto inputs = std::make_shared<std::vector<std::filesystem::path>>();
  auto choices = std::make_shared<loading::SequenceChoices>();
  CLI::App* app = program.add_subcommand(
      "plan", "Say what a scene needs in each haptic frame, what is left out, and why");
  app->add_option("input", *inputs, "heart, shell, molecule, a scene file, or a sequence")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, *inputs);
  add_frame_rate(*app, choices->frames_per_second);
  app->add_option("--fields", choices->fields,
                  "What 'palpate motion' wrote: its folder or its sequence_motion.nrrd")
      ->type_name("PATH")
      ->check(an_existing_path());
  add_values(*app, *choices);
  add_modes(*app, *choices);
  add_segments(*app, *choices);
  add_wall(*app, *choices);
  return {app,
          [inputs, choices] { return run(*inputs, *choices); },
          {"input", "--fields", "--folder", "--modes", "--segments"},
          {},
          {}};
}

}  // namespace palpate::app
