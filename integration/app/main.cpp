#include <fmt/format.h>

#include <csignal>
#include <exception>
#include <new>
#include <system_error>

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/overwrite.h"

namespace palpate::app {
namespace {

constexpr const char* kAbout =
    "palpate: put a hand into a moving volume: how its data move, what they feel and look like.\n"
    "Exit codes: 0 ok, 1 device or program failed or was stopped, 2 input or output can not be\n"
    "used, 3 the result is suspect, 4 the result failed.";

/// The command that was named, the innermost one; null if none.
const Command* chosen(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    if (!command.app->parsed()) continue;
    const Command* below = chosen(command.below);
    return below ? below : &command;
  }
  return nullptr;
}

/// In --help, outputs are told apart from inputs.
void mark_outputs(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    for (const std::string& name : command.writes)
      command.app->get_option(name)->type_name("OUTPUT");
    mark_outputs(command.below);
  }
}

std::vector<std::filesystem::path> paths_of(const CLI::App& app,
                                            const std::vector<std::string>& options) {
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : options) {
    const CLI::Option* option = app.get_option(name);
    for (const std::string& value : option->results()) paths.emplace_back(value);
    if (option->empty() && !option->get_default_str().empty())
      paths.emplace_back(option->get_default_str());
  }
  return paths;
}

int run_checked(const Command& command) {
  const auto inputs = paths_of(*command.app, command.reads);
  Status sound = check_are_files(inputs);
  if (sound) sound = check_overwrites(inputs, paths_of(*command.app, command.writes));
  if (sound) return command.run();
  fmt::print(stderr, "palpate: {}.\n", sound.error().message);
  return exit_code(sound.error());
}

int run(int argc, char** argv) {
  CLI::App program(kAbout, "palpate");
  program.require_subcommand(1);
  program.set_version_flag("--version", "palpate " PALPATE_VERSION);
  const std::vector<Command> commands = {
      add_motion(program),    add_chart(program),   add_check(program),
      add_devices(program),   add_phantom(program), add_feel(program),
      add_calibrate(program), add_plan(program),    add_demo(program)};
  mark_outputs(commands);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == int(CLI::ExitCodes::Success)) return program.exit(error);
    fmt::print(stderr, "palpate: {}. See 'palpate --help'.\n", error.what());
    return kExitBad;
  }
  const Command* command = chosen(commands);
  return command ? run_checked(*command) : int(kExitBad);
}

}  // namespace
}  // namespace palpate::app

int main(int argc, char** argv) {
  // A file that may not grow and a reader that has gone are errors of a write, not the end of a
  // program that may be holding a hand.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return palpate::app::run(argc, argv);
  } catch (const std::system_error& error) {
    // The program that read stdout has ended (as 'head' does): it wants no more.
    if (error.code() == std::errc::broken_pipe) return palpate::app::kExitInternal;
    fmt::print(stderr, "palpate: The system refused something: {}.\n", error.what());
    return palpate::app::kExitInternal;
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
