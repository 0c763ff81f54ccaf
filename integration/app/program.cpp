#include "integration/app/program.h"

#include <fmt/format.h>

#include <cstdlib>
#include <exception>
#include <new>
#include <system_error>

#include "integration/app/command_line.h"
#include "integration/app/exit_code.h"
#include "integration/app/overwrite.h"
#include "integration/app/process.h"
#include "integration/app/progress.h"
#include "integration/app/version.h"

namespace palpate::app {
namespace {

/// "Exit codes: 0 ok, 1 ...", in lines of a terminal's width.
std::string exit_codes_text() {
  constexpr size_t kWidth = 90;
  std::string text = "Exit codes:";
  size_t line = text.size();
  for (const ExitMeaning& one : kExitMeanings) {
    const std::string next =
        fmt::format(" {} {}{}", int(one.code), one.meaning, one.code == kExitFailed ? "." : ",");
    if (line + next.size() > kWidth) {
      text += '\n' + next.substr(1);
      line = next.size() - 1;
    } else {
      text += next;
      line += next.size();
    }
  }
  return text;
}

/// In --help, outputs are told apart from inputs: FILE becomes OUTPUT_FILE, DIR OUTPUT_DIR, and an
/// output that may be either OUTPUT.
void mark_outputs(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    for (const std::string& name : command.writes) {
      CLI::Option* option = command.app->get_option(name);
      const std::string type = option->get_type_name();
      option->type_name(type == "FILE" || type == "DIR" ? "OUTPUT_" + type : "OUTPUT");
    }
    mark_outputs(command.below);
  }
}

/// The innermost command that was given; null if none.
const Command* chosen(const std::vector<Command>& commands) {
  for (const Command& command : commands) {
    if (!command.app->parsed()) continue;
    const Command* below = chosen(command.below);
    return below ? below : &command;
  }
  return nullptr;
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
  Status checked = check_are_files(inputs);
  if (checked) checked = check_overwrites(inputs, paths_of(*command.app, command.writes));
  if (checked) return command.run();
  fmt::print(stderr, "{}: {}.\n", kProgramName, checked.error().message);
  return exit_code(checked.error());
}

int run(int argc, char** argv) {
  const CommandLine program = make_program();
  try {
    program.app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == int(CLI::ExitCodes::Success)) return program.app->exit(error);
    fmt::print(stderr, "{}: {}\n", kProgramName, sentence_of(*program.app, error));
    return kExitBad;
  }
  Console::set_verbose(*program.verbose);
  // Switches off the loader's own messages, since palpate reports the same. Before any thread
  // starts.
  if (!Console::verbose()) set_if_missing("XR_LOADER_DEBUG", "none");
  const Command* command = chosen(program.commands);
  return command ? run_checked(*command) : int(kExitBad);
}

}  // namespace

std::string system_sentence(const std::system_error& error) {
  // Of the calls that the C++ library makes for the program only the start of a thread says this.
  if (error.code() == std::errc::resource_unavailable_try_again)
    return "No further thread could be started: end other programs, or allow more processes "
           "(ulimit -u; in a container or a job of Slurm its limit of tasks)";
  if (error.code() == std::errc::too_many_files_open)
    return "No further file could be opened: allow more open files (ulimit -n)";
  return fmt::format("A call to the system failed: {}", error.what());
}

CommandLine described_program(const std::string& about) {
  CommandLine program;
  program.app = std::make_unique<CLI::App>(
      fmt::format("{}: {}\n{}", kProgramName, about, exit_codes_text()), kProgramName);
  program.app->require_subcommand(1);
  // The flags are called after the whole line is parsed: --verbose may stand on either side.
  program.app->set_version_flag("-V,--version", [app = program.app.get()] {
    return version_text(kProgramName, app->get_option("--verbose")->count() > 0);
  });
  return program;
}

void add_commands(CommandLine& program, std::vector<Command> commands) {
  program.commands = std::move(commands);
  mark_outputs(program.commands);
  // The option may stand before or behind the command.
  for (CLI::App* one : with_nested_commands(*program.app))
    if (!one->get_group().empty())
      one->add_flag(
          "--verbose", *program.verbose,
          std::string("Also print details of the Vulkan device and the messages of the OpenXR "
                      "loader") +
              (one == program.app.get() ? "; with --version the commit, the build and the driver"
                                        : ""));
}

int run_program(int argc, char** argv) {
  prepare_process(argc, argv);
  try {
    return run(argc, argv);
  } catch (const std::system_error& error) {
    // The program that read stdout has ended (as 'head' does).
    if (error.code() == std::errc::broken_pipe) return kExitInternal;
    fmt::print(stderr, "{}: {}.\n", kProgramName, system_sentence(error));
    return kExitInternal;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "{}: The memory of this machine is used up: crop the volumes, or use fewer "
               "frames.\n",
               kProgramName);
    return kExitBad;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: An error that should not happen: {}.\n", kProgramName, error.what());
    return kExitInternal;
  }
}

}  // namespace palpate::app
