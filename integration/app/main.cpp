#include "integration/app/commands.h"
#include "integration/app/progress.h"
#include "integration/app/session_flags.h"

namespace palpate::app {

const char* const kProgramName = "palpate";

CommandLine make_program() {
  CommandLine program = described_program(
      "put a hand into a moving volume: how its data move, what they feel and look like.");
  CLI::App& app = *program.app;
  add_commands(program, {add_motion(app), add_chart(app), add_check(app), add_devices(app),
                         add_info(app), add_phantom(app), add_feel(app), add_view(app),
                         add_serve(app), add_calibrate(app), add_plan(app), add_convert(app),
                         add_demo(app), add_help(app), add_write_manual(app)});
  return program;
}

}  // namespace palpate::app

int main(int argc, char** argv) {
  palpate::app::Console::set_spelling(palpate::app::with_flags);
  return palpate::app::run_program(argc, argv);
}
