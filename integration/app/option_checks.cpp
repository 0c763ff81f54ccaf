#include "integration/app/option_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <filesystem>
#include <optional>

#include "compute/motion/options.h"
#include "integration/files/scene/json_object.h"
#include "module/haptics/servo/real_time.h"

namespace palpate::app {
namespace {

template <class Number>
std::optional<Number> number_of(const std::string& text) {
  Number number{};
  // People write "+3"; from_chars does not accept it.
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || rest != end) return std::nullopt;
  return number;
}

}  // namespace

CLI::Validator number_in(const files::NumberRange& range) {
  const std::string wanted = files::text_of(range);
  const auto check = [range, wanted](std::string& text) {
    const auto number = number_of<double>(text);
    if (number && files::is_in(*number, range)) return std::string();
    return fmt::format("{} is expected, not '{}'", wanted, text);
  };
  constexpr std::string_view kArticle = "a number ";
  return CLI::Validator(
      check, wanted.size() > kArticle.size() ? wanted.substr(kArticle.size()) : std::string());
}

CLI::Validator whole_number_in(int64_t low, int64_t high) {
  const std::string range = fmt::format("from {} to {}", low, high);
  const auto check = [low, high, range](std::string& text) {
    const auto number = number_of<int64_t>(text);
    if (number && *number >= low && *number <= high) return std::string();
    return fmt::format("a whole number {} is expected, not '{}'", range, text);
  };
  return CLI::Validator(check, range);
}

void add_nan_as(CLI::App& app, std::optional<float>& nan_as, const std::string& what_for) {
  app.add_option_function<float>(
         "--nan-as", [&nan_as](float value) { nan_as = value; },
         "What samples become that are NaN" + what_for)
      ->type_name("VALUE")
      ->check(number_in(files::kAnyNumber));
}

CLI::Validator whole_number_in(const files::NumberRange& range) {
  return whole_number_in(int64_t(range.low), int64_t(range.high));
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string description = fmt::format("{{{}}}", fmt::join(words, ","));
  const auto check = [words = std::move(words)](std::string& text) {
    if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
    const std::string near = files::nearest_word(text, {words.begin(), words.end()});
    return fmt::format("'{}' is not known: {}choose one of {}", text,
                       near.empty() ? "" : fmt::format("did you mean '{}'? Otherwise ", near),
                       fmt::join(words, ", "));
  };
  return CLI::Validator(check, description);
}

CLI::Validator one_of_the_presets() {
  return one_of({kMotionPresets.begin(), kMotionPresets.end()});
}

CLI::Validator an_existing_file() {
  const auto check = [](std::string& text) {
    std::error_code error;
    const std::filesystem::path path(text);
    const bool is_file =
        std::filesystem::exists(path, error) && !std::filesystem::is_directory(path, error);
    return is_file ? std::string() : fmt::format("'{}' is not a file: check the name", text);
  };
  return CLI::Validator(check, "");
}

CLI::Validator an_existing_folder() {
  const auto check = [](std::string& text) {
    std::error_code error;
    return std::filesystem::is_directory(text, error)
               ? std::string()
               : fmt::format("'{}' is not a folder: check the name", text);
  };
  return CLI::Validator(check, "");
}

CLI::Validator an_existing_path() {
  const auto check = [](std::string& text) {
    std::error_code error;
    return std::filesystem::exists(text, error)
               ? std::string()
               : fmt::format("'{}' does not exist: check the name", text);
  };
  return CLI::Validator(check, "");
}

CLI::Validator a_core() {
  const auto check = [](std::string& text) {
    const std::vector<int> usable = usable_cores();
    const auto wanted = number_of<int>(text);
    if (wanted && std::find(usable.begin(), usable.end(), *wanted) != usable.end())
      return std::string();
    const bool in_a_row =
        !usable.empty() && usable.back() - usable.front() + 1 == int(usable.size());
    return fmt::format("this machine has {} cores for palpate: give one of {}, not '{}'",
                       usable.size(),
                       in_a_row ? fmt::format("{} to {}", usable.front(), usable.back())
                                : fmt::format("{}", fmt::join(usable, ", ")),
                       text);
  };
  return CLI::Validator(check, "");
}

}  // namespace palpate::app
