#include "integration/app/command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "integration/files/scene/json_object.h"

namespace palpate::app {
namespace {

bool is_option(const std::string& word) {
  return word.size() > 1 && word.front() == '-';
}

/// "--gpu=llvmpipe" -> "--gpu".
std::string without_value(const std::string& word) {
  return word.substr(0, word.find('='));
}

/// The innermost command that was given, or the program itself.
const CLI::App& chosen(const CLI::App& program) {
  const CLI::App* app = &program;
  while (!app->get_subcommands().empty()) app = app->get_subcommands().back();
  return *app;
}

/// The first of the words that fulfils the condition, or nothing.
template <class Condition>
std::string first_of(const std::vector<std::string>& words, Condition condition) {
  const auto found = std::find_if(words.begin(), words.end(), condition);
  return found == words.end() ? std::string() : *found;
}

std::string joined_names(const std::vector<const CLI::App*>& apps) {
  std::vector<std::string> names;
  for (const CLI::App* app : apps) names.push_back(app->get_name());
  return fmt::format("{}", fmt::join(names, ", "));
}

/// "'palpate feel' and 'palpate plan' have it".
std::string owners_text(const std::vector<const CLI::App*>& owners) {
  std::vector<std::string> names;
  for (const CLI::App* owner : owners) names.push_back("'" + full_name(*owner) + "'");
  return fmt::format("{} {} it", fmt::join(names, " and "), names.size() == 1 ? "has" : "have");
}

std::string no_such_command(const CLI::App& program, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* app : shown_commands(program)) names.push_back(app->get_name());
  const std::string nearest = files::nearest_word(word, {names.begin(), names.end()});
  if (!nearest.empty())
    return fmt::format("There is no command '{}': did you mean '{}'?", word, nearest);
  return fmt::format("There is no command '{}': choose one of {}.", word, fmt::join(names, ", "));
}

std::string no_such_option(const CLI::App& program, const CLI::App& app, const std::string& word) {
  const std::string option = without_value(word);
  if (const auto owners = commands_with_option(program, option); !owners.empty())
    return fmt::format("'{}' has no option '{}': {}.", full_name(app), option, owners_text(owners));
  std::vector<std::string> names;
  for (const CLI::Option* known : shown_options(app))
    for (const std::string& name : known->get_lnames()) names.push_back(name);
  const std::string bare = option.substr(option.find_first_not_of('-') == std::string::npos
                                             ? option.size()
                                             : option.find_first_not_of('-'));
  const std::string nearest = files::nearest_word(bare, {names.begin(), names.end()});
  if (nearest.empty()) return fmt::format("'{}' has no option '{}'.", full_name(app), option);
  return fmt::format("'{}' has no option '{}': did you mean '--{}'?", full_name(app), option,
                     nearest);
}

/// Name of an option or argument as in --help.
std::string name_of(const CLI::Option& option) {
  return option.get_positional() ? option.get_name(true, false) : option.get_name();
}

/// Longer texts for errors that CLI11 explains too briefly.
std::string explained(const CLI::App& app, const CLI::ParseError& error) {
  const std::string what = error.what();
  if (dynamic_cast<const CLI::RequiredError*>(&error))
    for (const auto& all : {shown_positionals(app), shown_options(app)})
      for (const CLI::Option* option : all)
        if (option->get_required() && option->count() == 0)
          return fmt::format("'{}' needs {}: {}", full_name(app), name_of(*option),
                             option->get_description());
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error))
    if (const CLI::Option* option = app.get_option_no_throw(what.substr(0, what.find(':')))) {
      const int count = option->get_items_expected_min();
      return fmt::format("{} takes {}: {}", name_of(*option),
                         count > 1 ? fmt::format("{} values", count) : std::string("a value"),
                         option->get_description());
    }
  if (dynamic_cast<const CLI::ExcludesError*>(&error))
    if (const size_t at = what.find(" excludes "); at != std::string::npos)
      return fmt::format("{} can not be used together with {}", what.substr(0, at),
                         what.substr(at + 10));
  return what;
}

}  // namespace

std::vector<CLI::App*> with_nested_commands(CLI::App& app) {
  std::vector<CLI::App*> all = {&app};
  for (CLI::App* nested : app.get_subcommands([](CLI::App*) { return true; }))
    for (CLI::App* one : with_nested_commands(*nested)) all.push_back(one);
  return all;
}

std::vector<const CLI::App*> with_nested_commands(const CLI::App& app) {
  std::vector<const CLI::App*> all = {&app};
  for (const CLI::App* nested : app.get_subcommands([](const CLI::App*) { return true; }))
    for (const CLI::App* one : with_nested_commands(*nested)) all.push_back(one);
  return all;
}

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); });
}

std::vector<const CLI::Option*> shown_options(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) {
    return option->nonpositional() && !option->get_group().empty();
  });
}

std::vector<const CLI::Option*> shown_positionals(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) {
    return option->get_positional() && !option->get_group().empty();
  });
}

std::string full_name(const CLI::App& app) {
  return app.get_parent() ? full_name(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

std::vector<const CLI::App*> commands_with_option(const CLI::App& program,
                                                  const std::string& option) {
  std::vector<const CLI::App*> owners;
  for (const CLI::App* app : with_nested_commands(program)) {
    const CLI::Option* found = app->get_option_no_throw(option);
    if (found && found->nonpositional() && !found->get_group().empty() && !app->get_group().empty())
      owners.push_back(app);
  }
  return owners;
}

std::string sentence_of(const CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& app = chosen(program);
  const std::string see = fmt::format(" See '{} --help'.", full_name(app));
  // An unknown word is the cause of a missing one: report it first.
  const std::vector<std::string> unknown = app.remaining();
  const std::string word = first_of(unknown, [](const std::string& w) { return !is_option(w); });
  if (&app == &program) {
    // A word behind an option may be its value.
    if (const std::string option = first_of(unknown, is_option);
        !option.empty() && (word.empty() || unknown.front() != word))
      return no_such_option(program, app, option) + see;
    if (!word.empty()) return no_such_command(program, word) + see;
    return fmt::format("A command is missing: name one of {}.{}",
                       joined_names(shown_commands(program)), see);
  }
  if (const std::string option = first_of(unknown, is_option); !option.empty())
    return no_such_option(program, app, option) + see;
  if (!word.empty())
    return fmt::format("'{}' does not know what to do with '{}': leave it out.{}", full_name(app),
                       word, see);
  if (const std::string option = first_of(program.remaining(), is_option); !option.empty())
    return no_such_option(program, program, option) + see;
  std::string what = explained(app, error);
  if (!what.ends_with('.') && !what.ends_with('?')) what += '.';
  return what + see;
}

}  // namespace palpate::app
