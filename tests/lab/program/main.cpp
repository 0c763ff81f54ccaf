#include "tests/lab/program/commands.h"

namespace palpate::app {

const char* const kProgramName = "palpate-lab";

CommandLine make_program() {
  CommandLine program = described_program(
      "measure palpate: how fast and how accurate it and its peers are here, and where they fail.");
  CLI::App& app = *program.app;
  add_commands(program, {add_chart(app), add_maps(app), add_motion(app), add_anatomies(app),
                         add_sequence(app), add_harmonics(app), add_feel(app), add_view(app),
                         add_hearts(app), add_soak(app), add_help(app)});
  return program;
}

}  // namespace palpate::app

int main(int argc, char** argv) {
  return palpate::app::run_program(argc, argv);
}
