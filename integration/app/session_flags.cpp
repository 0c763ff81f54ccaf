#include "integration/app/session_flags.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "integration/app/force_device.h"
#include "integration/app/option_checks.h"

namespace palpate::app {
namespace {

using running::PathUse;
using running::SessionOption;
using running::SessionRequest;

/// An option whose spelling or unit is not the table's.
struct Spelling {
  std::string_view key;
  const char* names;
  const char* help = nullptr;  ///< instead of the table's, where the meaning is turned round
  double per_unit = 1.0;       ///< numbers of the program in one unit of the table
  const char* unit = "";
};
constexpr Spelling kSpellings[] = {
    {"iso_value", "--iso-value,--level"},
    {"frames_per_second", "--fps,--frames-per-second"},
    {"segment_names", "--segment"},
    {"forget_motion", "--estimate"},
    {"motion", "--no-motion", "Feel the frames as they are, without motion between them"},
    {"cyclic", "--not-cyclic", "The last frame does not lead back to the first"},
    {"crc", "--no-crc",
     "igtl://...: accept messages whose sender computes no CRC (PLUS does so if it is not asked "
     "to); the same as ?crc=none behind the address"},
    {"real_time", "--no-real-time", "Ask the system for no priority and no locked memory"},
    {"tool", "--tool-name"},
    {"tool_radius_mm", "--tool-radius"},
    {"watchdog_s", "--watchdog", "A tick later than this is a fault, ms (5; simulated: 50)", 1e3,
     "ms"},
};

/// What is shown for a value in --help.
constexpr std::pair<std::string_view, const char*> kTypeNames[] = {
    {"segment_names", "NAME"}, {"image", "NAME"},    {"transform", "NAME"},      {"tool", "NAME"},
    {"nan_as", "VALUE"},       {"black_box", "DIR"}, {"serve", "PORT"},          {"values", "WORD"},
    {"wall", "WORD"},          {"web", "PORT"},      {"web_address", "ADDRESS"},
};

const Spelling* spelling_of(const SessionOption& option) {
  const auto* const found = std::find_if(std::begin(kSpellings), std::end(kSpellings),
                                         [&](const Spelling& s) { return s.key == option.key; });
  return found == std::end(kSpellings) ? nullptr : found;
}

/// The key without its unit, with hyphens: "stiffness_n_per_m" is "stiffness".
std::string stem_of(const SessionOption& option) {
  std::string unit = option.range.unit;
  std::string suffix = "_";
  for (const char c : unit)
    suffix += c == '/' ? std::string("_per_") : std::string(1, char(std::tolower(c)));
  std::string stem(option.key);
  if (!unit.empty() && stem.ends_with(suffix)) stem.resize(stem.size() - suffix.size());
  std::replace(stem.begin(), stem.end(), '_', '-');
  return stem;
}

std::string names_of(const SessionOption& option) {
  if (const Spelling* spelling = spelling_of(option)) return spelling->names;
  const bool is_turned_off = running::type_of(option) == "flag" && option.fallback == "true";
  return (is_turned_off ? "--no-" : "--") + stem_of(option);
}

std::string help_of(const SessionOption& option) {
  const Spelling* const spelling = spelling_of(option);
  return with_flags(spelling && spelling->help ? spelling->help : option.help);
}

void set(SessionRequest& request, const SessionOption& option, const nlohmann::json& value) {
  if (const Status done = running::set_option(request, option, value); !done)
    throw CLI::ValidationError(flag_of(option), done.error().message);
}

CLI::Option* add_number(CLI::App& app, SessionRequest& request, const SessionOption& option) {
  const Spelling* const spelling = spelling_of(option);
  const double per_unit = spelling ? spelling->per_unit : 1.0;
  const files::NumberRange range =
      per_unit == 1.0 ? option.range : files::in_unit(option.range, per_unit, spelling->unit);
  if (running::type_of(option) == "whole number") {
    if (option.key == "web")
      // The port may be left out.
      return app
          .add_option_function<std::string>(
              names_of(option),
              [&](const std::string& port) {
                set(request, option, port.empty() ? kWebPort : std::stoi(port));
              },
              help_of(option))
          ->expected(0, 1)
          ->check([range](const std::string& port) {
            return port.empty() ? std::string() : whole_number_in(range)(port);
          });
    if (option.key == "core")
      return app
          .add_option_function<int>(
              names_of(option), [&](const int& core) { set(request, option, core); },
              help_of(option))
          ->check(a_core());
    return app
        .add_option_function<int64_t>(
            names_of(option), [&](const int64_t& number) { set(request, option, number); },
            help_of(option))
        ->check(whole_number_in(range));
  }
  if (option.words.empty())
    return app
        .add_option_function<double>(
            names_of(option),
            [&, per_unit](const double& number) { set(request, option, number / per_unit); },
            help_of(option))
        ->check(number_in(range));
  // A number, or a word.
  return app
      .add_option_function<std::string>(
          names_of(option),
          [&](const std::string& text) {
            const bool is_word =
                std::find(option.words.begin(), option.words.end(), text) != option.words.end();
            set(request, option, is_word ? nlohmann::json(text) : nlohmann::json(std::stod(text)));
          },
          help_of(option))
      ->check([range, words = option.words](const std::string& text) {
        const std::string wrong = number_in(range)(text);
        if (wrong.empty() || std::find(words.begin(), words.end(), text) != words.end())
          return std::string();
        std::string either;
        for (const std::string_view word : words) either += "'" + std::string(word) + "' or ";
        return either + wrong;
      });
}

/// What looks at a path before a long run.
void check_path(CLI::Option& shown, const SessionOption& option) {
  const char* type = "";
  switch (option.path) {
    case PathUse::kNone:
      return;
    case PathUse::kFile:
      type = "FILE";
      // The Falcon's firmware is looked for by the device, with a sentence of its own.
      if (option.key != "falcon_firmware") shown.check(an_existing_file());
      break;
    case PathUse::kFolder:
      type = "DIR";
      shown.check(an_existing_folder());
      break;
    case PathUse::kFileOrFolder:
      type = "PATH";
      shown.check(an_existing_path());
      break;
    case PathUse::kOutputFile:
      type = "FILE";
      break;
    case PathUse::kOutputFolder:
      type = "DIR";
      break;
  }
  shown.type_name(type);
}

void add_option(CLI::App& app, SessionRequest& request, const SessionOption& option) {
  const std::string_view type = running::type_of(option);
  if (type == "flag") {
    app.add_flag_callback(
        names_of(option), [&] { set(request, option, option.fallback != "true"); },
        help_of(option));
    return;
  }
  CLI::Option* shown = nullptr;
  if (type == "number" || type == "whole number") {
    shown = add_number(app, request, option);
  } else if (type == "paths" || type == "texts") {
    shown = app.add_option_function<std::vector<std::string>>(
        names_of(option),
        [&](const std::vector<std::string>& texts) { set(request, option, texts); },
        help_of(option));
  } else {
    shown = app.add_option_function<std::string>(
        names_of(option), [&](const std::string& text) { set(request, option, text); },
        help_of(option));
    if (type == "word") shown->check(one_of({option.words.begin(), option.words.end()}));
    if (option.key == "device") shown->check(a_force_device({"controller", "mouse", "simulated"}));
  }
  check_path(*shown, option);
  for (const auto& [key, name] : kTypeNames)
    if (key == option.key) shown->type_name(name);
  if (!option.fallback.empty()) shown->default_str(std::string(option.fallback));
}

std::vector<std::string> flags_with(const CLI::App& app, bool output,
                                    std::vector<std::string> flags) {
  for (const SessionOption& option : running::session_options()) {
    const bool writes =
        option.path == PathUse::kOutputFile || option.path == PathUse::kOutputFolder;
    // A path of the simulated hand may be a file.
    const bool reads = (option.path != PathUse::kNone && !writes) || option.key == "path";
    if ((output ? writes : reads) && app.get_option_no_throw(flag_of(option)))
      flags.push_back(flag_of(option));
  }
  return flags;
}

/// "1 to 1000 ms", "values, region, ridges", "a path".
std::string values_text(const SessionOption& option) {
  if (!option.words.empty() && running::type_of(option) == "word")
    return fmt::format("{}", fmt::join(option.words, ", "));
  const bool is_number = running::type_of(option).ends_with("number");
  if (!is_number)
    return option.fallback == "true" ? "flag, on" : std::string(running::type_of(option));
  constexpr std::string_view kArticle = "a number";
  std::string range = files::text_of(option.range);
  if (range.starts_with(kArticle))
    range = range.substr(std::min(range.size(), kArticle.size() + 1));
  if (range.empty()) range = "a number";
  for (const std::string_view word : option.words) range = fmt::format("{}, or {}", word, range);
  return range;
}

}  // namespace

std::string options_page() {
  std::string page =
      "# Options of a session\n\n"
      "Made from the table in `integration/running/session_options.cpp`: do not edit it here "
      "(`palpate write-manual FOLDER` writes `FOLDER/options.md`).\n\n"
      "The name is the keyword of Python's `Session`, the key in the text of options of "
      "`palpate.h` (`PalSceneInfo.options`, `PalSessionInfo.options`), and the key in the section "
      "`session` of a scene file. Ranges and meanings are the same everywhere.\n\n"
      "| name | program | values | without it | field of palpate.h | in a scene file | meaning |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const SessionOption& option : running::session_options())
    page += fmt::format(
        "| `{}` | {} | {} | {} | {} | {} | {}. |\n", option.key,
        option.doors & running::kProgramDoor ? fmt::format("`{}`", names_of(option)) : "-",
        values_text(option), option.fallback.empty() ? "-" : option.fallback,
        option.c_field.empty() ? "-" : fmt::format("`{}`", option.c_field),
        option.doors & running::kSceneFileDoor ? "yes" : "-", option.help);
  return page;
}

std::string flag_of(const SessionOption& option) {
  const std::string names = names_of(option);
  return names.substr(0, names.find(','));
}

std::string with_flags(std::string_view sentence) {
  std::string text(sentence);
  for (size_t from = text.find('`'); from != std::string::npos; from = text.find('`', from)) {
    const size_t to = text.find('`', from + 1);
    if (to == std::string::npos) break;
    const SessionOption* const option =
        running::find_option(std::string_view(text).substr(from + 1, to - from - 1));
    if (!option) {
      from = to + 1;
      continue;
    }
    text.replace(from, to - from + 1, flag_of(*option));
  }
  return text;
}

void add_session_options(CLI::App& app, SessionRequest& request,
                         std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) add_option(app, request, *running::find_option(key));
}

void add_session_options(CLI::App& app, SessionRequest& request) {
  for (const SessionOption& option : running::session_options())
    if (option.doors & running::kProgramDoor) add_option(app, request, option);
}

std::vector<std::string> input_options(const CLI::App& app, std::vector<std::string> more) {
  return flags_with(app, false, std::move(more));
}

std::vector<std::string> output_options(const CLI::App& app, std::vector<std::string> more) {
  return flags_with(app, true, std::move(more));
}

}  // namespace palpate::app
