#include <fmt/format.h>
#include <fmt/ranges.h>

#include "integration/app/command_line.h"
#include "integration/app/exit_code.h"
#include "integration/app/program.h"
#include "integration/files/scene/json_object.h"

namespace palpate::app {
namespace {

/// Prints the help of a command, as its --help does. (CLI::App::help() would explain the command
/// that was given, which is `help`.)
void print_help(const CLI::App& app) {
  fmt::print("{}",
             app.get_formatter()->make_help(&app, full_name(app), CLI::AppFormatMode::Normal));
}

/// Prints the commands that have an option, with its description in each.
bool print_option(const CLI::App& program, const std::string& word) {
  std::string name = word.substr(0, word.find('='));
  if (!name.starts_with('-')) name = "--" + name;
  const auto owners = commands_with_option(program, name);
  for (const CLI::App* owner : owners)
    fmt::print("{}\n{}", full_name(*owner),
               CLI::Formatter().make_option(owner->get_option(name), false));
  return !owners.empty();
}

int run(const CLI::App& program, const std::vector<std::string>& words) {
  const CLI::App* app = &program;
  for (const std::string& word : words) {
    const auto commands = shown_commands(*app);
    const auto found = std::find_if(commands.begin(), commands.end(),
                                    [&](const CLI::App* one) { return one->get_name() == word; });
    if (found != commands.end()) {
      app = *found;
      continue;
    }
    if (print_option(program, word)) return kExitOk;
    std::vector<std::string> names;
    for (const CLI::App* one : commands) names.push_back(one->get_name());
    const std::string nearest = files::nearest_word(word, {names.begin(), names.end()});
    fmt::print(stderr, "{0}: There is no command and no option '{1}': {2}. See '{0} --help'.\n",
               kProgramName, word,
               nearest.empty() ? fmt::format("name one of {}", fmt::join(names, ", "))
                               : fmt::format("did you mean '{}'", nearest));
    return kExitBad;
  }
  print_help(*app);
  return kExitOk;
}

}  // namespace

Command add_help(CLI::App& program) {
  auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* app =
      program.add_subcommand("help", "Explain a command, or say which commands have an option");
  app->add_option("what", *words, "A command, as in 'chart stability', or an option, as in 'csv'");
  // The option to explain is none of this command's own.
  app->allow_extras();
  return {app,
          [&program, app, words] {
            std::vector<std::string> all = *words;
            for (const std::string& word : app->remaining()) all.push_back(word);
            return run(program, all);
          },
          {},
          {},
          {}};
}

}  // namespace palpate::app
