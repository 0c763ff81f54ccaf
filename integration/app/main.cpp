#include <fmt/format.h>

#include <cstdlib>
#include <exception>
#include <new>

#include "integration/app/command_line.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/progress.h"

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

}  // namespace

Program make_program() {
  Program program;
  program.app = std::make_unique<CLI::App>(
      fmt::format("palpate: put a hand into a moving volume: how its data move, what they feel and "
                  "look like.\n{}",
                  exit_codes_text()),
      "palpate");
  CLI::App& app = *program.app;
  app.require_subcommand(1);
  app.set_version_flag("--version", "palpate " PALPATE_VERSION);
  program.commands = {add_motion(app), add_chart(app),   add_check(app), add_devices(app),
                      add_info(app),   add_phantom(app), add_feel(app),  add_calibrate(app),
                      add_plan(app),   add_demo(app),    add_help(app),  add_write_manual(app)};
  // Before the command or behind it.
  for (CLI::App* one : with_nested_commands(app))
    if (!one->get_group().empty())
      one->add_flag(
          "--verbose", *program.verbose,
          "Also print details of the Vulkan device and the messages of the OpenXR loader");
  return program;
}

namespace {

int run(int argc, char** argv) {
  const Program program = make_program();
  try {
    program.app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == int(CLI::ExitCodes::Success)) return program.app->exit(error);
    fmt::print(stderr, "palpate: {}\n", sentence_of(*program.app, error));
    return kExitBad;
  }
  Console::set_verbose(*program.verbose);
  // The loader would tell the terminal in words of its own what we say in ours. Before any thread.
  if (!Console::verbose()) setenv("XR_LOADER_DEBUG", "none", 0);
  for (const Command& command : program.commands) {
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
