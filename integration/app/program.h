#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

namespace palpate::app {

/// A command of a program: its options, and the function to run after parsing.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;  ///< returns the exit code
  /// The options (and positional names) whose values are files or folders that the command reads,
  /// and those that it writes: no output may be an input, see check_overwrites().
  std::vector<std::string> reads, writes;
  std::vector<Command> below;  ///< commands within this one
};

/// A program: its description in --help, its options and all commands. The command line, the
/// command `help`, the manual pages and the completions are generated from it.
struct CommandLine {
  std::unique_ptr<CLI::App> app;
  std::vector<Command> commands;
  std::shared_ptr<bool> verbose = std::make_shared<bool>(false);
};

/// "palpate": the program's name at the start of messages. Every program defines it, and
/// make_program().
extern const char* const kProgramName;
CommandLine make_program();

/// A program without commands: description, exit codes, --version.
CommandLine described_program(const std::string& about);
/// Adds the commands, in the order of --help, each with --verbose.
void add_commands(CommandLine& program, std::vector<Command> commands);

/// The body of main(): parses, checks that no output is an input, runs the command. Returns the
/// exit code; every error is one sentence on stderr.
int run_program(int argc, char** argv);

/// What a failed call to the system means, and what to do; without a full stop.
std::string system_sentence(const std::system_error& error);

/// The command `help`, for every program; it looks up the other commands when it runs.
Command add_help(CLI::App& program);

}  // namespace palpate::app
