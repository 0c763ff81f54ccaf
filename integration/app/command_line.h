#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace palpate::app {

/// The app itself, its commands, their commands, and so on, in the order in which they were added.
std::vector<CLI::App*> with_nested_commands(CLI::App& app);
std::vector<const CLI::App*> with_nested_commands(const CLI::App& app);

/// The commands of an app that --help shows.
std::vector<const CLI::App*> shown_commands(const CLI::App& app);

/// The options and flags, or the positional arguments, that --help shows, --help itself included.
std::vector<const CLI::Option*> shown_options(const CLI::App& app);
std::vector<const CLI::Option*> shown_positionals(const CLI::App& app);

/// "palpate chart stability".
std::string full_name(const CLI::App& app);

/// The commands that have an option of this name ("--csv"), or none.
std::vector<const CLI::App*> commands_with_option(const CLI::App& program,
                                                  const std::string& option);

/// One sentence on the error of a command line that could not be parsed, and another one that says
/// where to look. Unknown commands and options come with the nearest known one, or with the command
/// that has the option. `program`: after parse().
std::string sentence_of(const CLI::App& program, const CLI::ParseError& error);

}  // namespace palpate::app
