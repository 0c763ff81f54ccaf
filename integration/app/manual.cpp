// The manual pages and shell completions, generated from the same definitions as --help.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "integration/app/command_line.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/outputs.h"
#include "integration/app/progress.h"
#include "integration/app/session_flags.h"
#include "integration/files/atomic_file.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using Apps = std::vector<const CLI::App*>;

/// Kind of an option's value, for the shells.
enum class OptionValue { kNone, kWords, kFile, kFolder, kPath, kOther };

std::string without(std::string text, const std::string& what) {
  const size_t at = text.find(what);
  return at == std::string::npos ? text : text.erase(at, what.size());
}

/// The words in a type such as "TEXT:{mha,nrrd}".
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t open = type.find('{'), close = type.find('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos) return words;
  std::string word;
  for (size_t at = open + 1; at <= close; ++at) {
    if (at < close && type[at] != ',') {
      word += type[at];
    } else {
      words.push_back(std::exchange(word, {}));
    }
  }
  return words;
}

OptionValue value_of(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return OptionValue::kNone;
  if (!words_of(option).empty()) return OptionValue::kWords;
  // Outputs are named OUTPUT, OUTPUT_FILE or OUTPUT_DIR.
  std::string type = option.get_type_name();
  if (type.starts_with("OUTPUT")) type = type.size() > 7 ? type.substr(7) : "PATH";
  if (type.starts_with("FILE")) return OptionValue::kFile;
  if (type.starts_with("DIR")) return OptionValue::kFolder;
  if (type.starts_with("PATH")) return OptionValue::kPath;
  return OptionValue::kOther;
}

/// "-o", "--output": the forms that are typed.
std::vector<std::string> spellings(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> option_spellings(const CLI::App& app) {
  std::vector<std::string> all;
  for (const CLI::Option* option : shown_options(app))
    for (std::string& name : spellings(*option)) all.push_back(std::move(name));
  return all;
}

std::vector<std::string> names_of(const Apps& apps) {
  std::vector<std::string> names;
  for (const CLI::App* app : apps) names.push_back(app->get_name());
  return names;
}

/// All commands with a page or a completion of their own.
Apps shown_apps(const CLI::App& program) {
  Apps apps;
  for (const CLI::App* app : with_nested_commands(program))
    if (!app->get_group().empty()) apps.push_back(app);
  return apps;
}

// Manual pages ------------------------------------------------------------------------------------

/// Text that troff prints unchanged. A line of `text` stays one line.
std::string troff(const std::string& text) {
  std::string out;
  for (size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    const bool line_start = at == 0 || text[at - 1] == '\n';
    if (line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '\'')
      out += "\\(aq";
    else if (c == '^')
      out += "\\(ha";
    else if (c == '~')
      out += "\\(ti";
    else
      out += c;
  }
  return out;
}

std::string bold(const std::string& text) {
  return "\\fB" + troff(text) + "\\fR";
}
std::string italic(const std::string& text) {
  return "\\fI" + troff(text) + "\\fR";
}

/// "palpate-chart-stability".
std::string page_name(const CLI::App& app) {
  std::string name = full_name(app);
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

/// The placeholder of a value: NAME in "--gpu NAME", else the type without its range.
std::string value_word(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.substr(0, type.find(':'));
}

/// Range and default of a value.
std::string limits_text(const CLI::Option& option) {
  std::vector<std::string> parts;
  const std::string type = option.get_type_name();
  const std::vector<std::string> words = words_of(option);
  if (!words.empty())
    parts.push_back(fmt::format("One of {}", fmt::join(words, ", ")));
  else if (const size_t colon = type.find(':'); colon != std::string::npos)
    parts.push_back("A number " + type.substr(colon + 1));
  if (!option.get_default_str().empty() && option.get_items_expected_max() > 0)
    parts.push_back("Default: " + without(option.get_default_str(), "\""));
  std::vector<std::string> others;
  for (const CLI::Option* other : option.get_excludes()) others.push_back(other->get_name());
  std::sort(others.begin(), others.end());
  if (!others.empty())
    parts.push_back(fmt::format("Not together with {}", fmt::join(others, ", ")));
  std::string text;
  for (const std::string& part : parts) text += part + ".\n";
  return text;
}

std::string sentence_text(std::string text) {
  if (!text.empty() && !text.ends_with('.')) text += '.';
  return text;
}

std::string option_item(const CLI::Option& option, bool positional) {
  std::string names;
  if (positional) {
    names = italic(option.get_name(true, false));
  } else {
    for (const std::string& name : spellings(option))
      names += (names.empty() ? "" : ", ") + bold(name);
    if (option.get_items_expected_max() > 0) names += " " + italic(value_word(option));
    if (option.get_items_expected_min() > 1) names += " " + italic(value_word(option));
    if (option.get_items_expected_max() > 2) names += " ...";
  }
  return fmt::format(".TP\n{}\n{}\n{}", names, troff(sentence_text(option.get_description())),
                     troff(limits_text(option)));
}

std::string synopsis(const CLI::App& app) {
  std::string line = bold(full_name(app));
  if (!shown_options(app).empty()) line += " [" + italic("options") + "]";
  for (const CLI::Option* one : shown_positionals(app)) {
    std::string name = italic(one->get_name(true, false));
    if (one->get_items_expected_max() > 1) name += " ...";
    line += one->get_required() ? " " + name : " [" + name + "]";
  }
  if (!shown_commands(app).empty()) {
    const std::string command = italic("command") + " [" + italic("arguments") + "]";
    line += app.get_require_subcommand_min() > 0 ? " " + command : "";
  }
  return line;
}

std::string man_page(const CLI::App& app, const Apps& all) {
  const bool whole = app.get_parent() == nullptr;
  // The first line of the program's description; its exit codes have a section of their own.
  std::string about = app.get_description();
  about = about.substr(0, about.find('\n'));
  if (whole) about = without(about, "palpate: ");
  std::string page = fmt::format(
      ".TH \"{}\" \"1\" \"\" \"palpate {}\" \"palpate\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}\n",
      troff(page_name(app)), PALPATE_VERSION, troff(page_name(app)),
      troff(about.ends_with('.') ? about.substr(0, about.size() - 1) : about), synopsis(app));
  const auto positionals = shown_positionals(app);
  if (!positionals.empty()) page += ".SH ARGUMENTS\n";
  for (const CLI::Option* one : positionals) page += option_item(*one, true);
  if (const Apps commands = shown_commands(app); !commands.empty()) {
    page += ".SH COMMANDS\n";
    for (const CLI::App* command : commands)
      page +=
          fmt::format(".TP\n{}\n{} See {}(1).\n", bold(command->get_name()),
                      troff(sentence_text(command->get_description())), bold(page_name(*command)));
  }
  page += ".SH OPTIONS\n";
  for (const CLI::Option* one : shown_options(app)) page += option_item(*one, false);
  page += ".SH EXIT STATUS\n";
  for (const ExitMeaning& one : kExitMeanings)
    page += fmt::format(".TP\n.B {}\n{}.\n", int(one.code), troff(one.meaning));
  if (whole) {
    page += fmt::format(
        ".SH ENVIRONMENT\n.TP\n{}\nFolder for what palpate keeps: the ticks around a fault, what "
        "was measured of this machine. Default: {}.\n.TP\n{}\nThe manifest of the OpenXR runtime "
        "to use.\n",
        bold("XDG_STATE_HOME"), troff("~/.local/state"), bold("XR_RUNTIME_JSON"));
  }
  std::vector<std::string> others;
  for (const CLI::App* other : all)
    if (other != &app) others.push_back(bold(page_name(*other)) + "(1)");
  page += fmt::format(".SH SEE ALSO\n{}\n", fmt::join(others, ",\n"));
  return page;
}

// bash --------------------------------------------------------------------------------------------

/// One word per line, since some contain spaces.
std::string bash_words(const std::vector<std::string>& words) {
  return fmt::format("_palpate_words $'{}'", fmt::join(words, "\\n"));
}

/// A bash command that completes the value of an option, or a positional argument.
std::string bash_values(const CLI::Option& option, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = words_of(option);
  words.insert(words.end(), more.begin(), more.end());
  switch (value_of(option)) {
    case OptionValue::kFolder:
      return "_palpate_paths -d";
    case OptionValue::kFile:
    case OptionValue::kPath:
      return "_palpate_paths -f";
    default:
      return words.empty() ? ":" : bash_words(words);
  }
}

std::string bash_completion(const CLI::App& program) {
  std::string text =
      "# bash completion for palpate, made from the definitions of its commands.\n"
      "_palpate_words() {\n"
      "  local IFS=$'\\n' word\n"
      "  for word in $(compgen -W \"$1\" -- \"$cur\"); do COMPREPLY+=(\"$(printf %q \"$word\")\"); "
      "done\n"
      "}\n"
      "_palpate_paths() {\n"
      "  compopt -o filenames 2>/dev/null\n"
      "  mapfile -t COMPREPLY < <(compgen \"$1\" -- \"$cur\")\n"
      "}\n"
      "_palpate() {\n"
      "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} command=palpate "
      "word at\n"
      "  COMPREPLY=()\n"
      "  # bash takes the '=' of --option=value for a word.\n"
      "  if [[ $cur == = ]]; then cur=; "
      "elif [[ $prev == = ]]; then prev=${COMP_WORDS[COMP_CWORD - 2]}; fi\n"
      "  for ((at = 1; at < COMP_CWORD; ++at)); do\n"
      "    word=${COMP_WORDS[at]}\n"
      "    case \"$command $word\" in\n";
  const Apps apps = shown_apps(program);
  for (const CLI::App* app : apps)
    for (const CLI::App* nested : shown_commands(*app))
      text += fmt::format("      '{} {}') command='{}' ;;\n", full_name(*app), nested->get_name(),
                          full_name(*nested));
  text += "    esac\n  done\n  case \"$command $prev\" in\n";
  for (const CLI::App* app : apps)
    for (const CLI::Option* option : shown_options(*app)) {
      if (value_of(*option) == OptionValue::kNone) continue;
      std::vector<std::string> patterns;
      for (const std::string& name : spellings(*option))
        patterns.push_back(fmt::format("'{} {}'", full_name(*app), name));
      text +=
          fmt::format("    {}) {}; return ;;\n", fmt::join(patterns, " | "), bash_values(*option));
    }
  text += "  esac\n  if [[ $cur == -* ]]; then\n    case $command in\n";
  for (const CLI::App* app : apps)
    text += fmt::format("      '{}') {} ;;\n", full_name(*app), bash_words(option_spellings(*app)));
  text += "    esac\n    return\n  fi\n  case $command in\n";
  for (const CLI::App* app : apps) {
    std::vector<std::string> names = names_of(shown_commands(*app));
    // "palpate help" completes commands.
    if (app->get_name() == "help") names = names_of(shown_commands(program));
    const auto positionals = shown_positionals(*app);
    std::string values = names.empty() ? ":" : bash_words(names);
    if (!positionals.empty() && value_of(*positionals.front()) != OptionValue::kOther)
      values = bash_values(*positionals.front(), names);
    text += fmt::format("    '{}') {} ;;\n", full_name(*app), values);
  }
  text += "  esac\n}\ncomplete -F _palpate palpate\n";
  return text;
}

// zsh ---------------------------------------------------------------------------------------------

/// In single quotes, as part of an argument of _arguments or _describe.
std::string zsh_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      out += std::string("\\") + c;
    else
      out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::vector<std::string> zsh_words(const CLI::Option& option) {
  std::vector<std::string> words = words_of(option);
  for (std::string& word : words)
    for (size_t at = word.find(' '); at != std::string::npos; at = word.find(' ', at + 2))
      word.insert(at, "\\");
  return words;
}

std::string zsh_value(const CLI::Option& option) {
  switch (value_of(option)) {
    case OptionValue::kNone:
      return "";
    case OptionValue::kWords:
      return fmt::format(":value:({})", fmt::join(zsh_words(option), " "));
    case OptionValue::kFolder:
      return ":folder:_files -/";
    case OptionValue::kFile:
    case OptionValue::kPath:
      return ":file:_files";
    case OptionValue::kOther:
      return ":value:";
  }
  return "";
}

std::string zsh_function(const CLI::App& app) {
  std::string name = full_name(app);
  std::replace(name.begin(), name.end(), ' ', '_');
  return "_" + name;
}

std::string zsh_completion(const CLI::App& program) {
  std::string text = "#compdef palpate\n# Made from the definitions of palpate's commands.\n";
  for (const CLI::App* app : shown_apps(program)) {
    text += fmt::format("\n{}() {{\n  local line state\n  _arguments -C", zsh_function(*app));
    for (const CLI::Option* option : shown_options(*app))
      for (const std::string& name : spellings(*option))
        text += fmt::format(" \\\n    '*{}[{}]{}'", name, zsh_text(option->get_description()),
                            zsh_value(*option));
    const Apps commands = shown_commands(*app);
    const auto positionals = shown_positionals(*app);
    if (!commands.empty()) {
      text +=
          " \\\n    '1: :->command' \\\n    '*:: :->arguments'\n  case $state in\n    command)\n"
          "      local -a commands=(";
      for (const CLI::App* command : commands)
        text += fmt::format("\n        '{}:{}'", command->get_name(),
                            zsh_text(command->get_description()));
      text += "\n      )\n      _describe command commands\n";
      if (!positionals.empty()) text += "      _files\n";
      text += "      ;;\n    arguments)\n      case $line[1] in\n";
      for (const CLI::App* command : commands)
        text += fmt::format("        {}) {} ;;\n", command->get_name(), zsh_function(*command));
      text += fmt::format("{}      esac\n      ;;\n  esac\n",
                          positionals.empty() ? "" : "        *) _files ;;\n");
    } else if (!positionals.empty()) {
      const CLI::Option& first = *positionals.front();
      const bool any = value_of(first) == OptionValue::kOther;
      text += fmt::format(" \\\n    '*{}'\n", any ? ":value:" : zsh_value(first));
    } else {
      text += "\n";
    }
    text += "}\n";
  }
  return text + "\n_palpate \"$@\"\n";
}

Status write_manual(const CLI::App& program, const fs::path& folder) {
  const auto write = [&](const fs::path& below, const std::string& name, const std::string& text) {
    auto outputs = Outputs::into(folder / below);
    if (!outputs) return Status(outputs.error());
    const auto path = outputs->stage(name);
    if (!path) return Status(path.error());
    if (const Status written = files::write_text(*path, text); !written)
      return Status(outputs->in_place(written.error()));
    return outputs->publish();
  };
  const Apps apps = shown_apps(program);
  for (const CLI::App* app : apps)
    if (const Status done = write("man1", page_name(*app) + ".1", man_page(*app, apps)); !done)
      return done;
  if (const Status done = write("bash", "palpate", bash_completion(program)); !done) return done;
  if (const Status done = write("zsh", "_palpate", zsh_completion(program)); !done) return done;
  return write(".", "options.md", options_page());
}

}  // namespace

Command add_write_manual(CLI::App& program) {
  auto folder = std::make_shared<fs::path>();
  CLI::App* app = program.add_subcommand(
      "write-manual", "Write the manual pages (man1) and completions (bash, zsh) into a folder");
  app->group("");
  app->add_option("folder", *folder, "Folder")->type_name("DIR")->required();
  return {app,
          [&program, folder]() -> int {
            Console console(true, false);
            const Status done = write_manual(program, *folder);
            return done ? int(kExitOk) : fail(console, done.error());
          },
          {},
          {},
          {}};
}

}  // namespace palpate::app
