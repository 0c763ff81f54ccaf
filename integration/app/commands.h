#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace palpate::app {

/// A command of the program: its options, and what to do once they are parsed.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;  ///< returns the exit code
  /// The options (and positional names) whose values are files or folders that the command reads,
  /// and those that it writes: no output may be an input, see check_overwrites().
  std::vector<std::string> reads, writes;
  std::vector<Command> below;  ///< commands within this one
};

/// The program: what --help says of it, its options and all commands. The command line, `palpate
/// help`, the manual pages and the completions are made from it.
struct Program {
  std::unique_ptr<CLI::App> app;
  std::vector<Command> commands;
  std::shared_ptr<bool> verbose = std::make_shared<bool>(false);
};
Program make_program();

/// Each adds itself to the program. One file per command.
Command add_calibrate(CLI::App& program);
Command add_motion(CLI::App& program);
Command add_chart(CLI::App& program);
Command add_check(CLI::App& program);
Command add_convert(CLI::App& program);
Command add_devices(CLI::App& program);
Command add_demo(CLI::App& program);
Command add_feel(CLI::App& program);
Command add_info(CLI::App& program);
Command add_plan(CLI::App& program);
Command add_phantom(CLI::App& program);
/// Both know the other commands once they run.
Command add_help(CLI::App& program);
/// In no help: writes the manual pages and completions that are installed.
Command add_write_manual(CLI::App& program);
Command add_view(CLI::App& program);

}  // namespace palpate::app
