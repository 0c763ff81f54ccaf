#include <fmt/format.h>

#include <exception>
#include <new>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"

namespace palpate::app {
namespace {

constexpr const char* kAbout =
    "palpate: put a hand into a moving volume: how its data move, what they feel and look like.\n"
    "Exit codes: 0 ok, 1 device or program failed or was stopped, 2 input or output can not be\n"
    "used, 3 the result is suspect, 4 the result failed.";

int run(int argc, char** argv) {
  CLI::App program(kAbout, "palpate");
  program.require_subcommand(1);
  program.set_version_flag("--version", "palpate " PALPATE_VERSION);
  const std::vector<Command> commands = {
      add_motion(program),  add_chart(program), add_check(program), add_devices(program),
      add_phantom(program), add_feel(program),  add_view(program),  add_calibrate(program),
      add_plan(program),    add_demo(program)};
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == int(CLI::ExitCodes::Success)) return program.exit(error);
    fmt::print(stderr, "palpate: {}. See 'palpate --help'.\n", error.what());
    return kExitBad;
  }
  for (const Command& command : commands) {
    if (command.app->parsed()) return command.run();
  }
  return kExitBad;
}

}  // namespace
}  // namespace palpate::app

int main(int argc, char** argv) {
  try {
    return palpate::app::run(argc, argv);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "palpate: The memory of this machine is used up: crop the volumes, or use fewer "
               "frames.\n");
    return palpate::app::kExitBad;
  } catch (const std::exception& error) {
    fmt::print(stderr, "palpate: An error that should not happen: {}.\n", error.what());
    return palpate::app::kExitInternal;
  }
}
