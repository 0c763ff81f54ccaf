#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "integration/running/session_options.h"

namespace palpate::app {

/// Of the live page, where `--web` has no number.
constexpr int kWebPort = 18946;

/// The options of the program that the table of session options gives: the only place that knows
/// their spelling. `--key` without the unit, `--no-key` for what is on without it; a few have older
/// names.

/// "--watchdog", "--no-real-time": the first spelling of an option.
std::string flag_of(const running::SessionOption& option);
/// A sentence of a library with each `key` of an option written as the option of the program.
std::string with_flags(std::string_view sentence);

/// Adds the options of these keys, or all of palpate feel. `request` must outlive the parsing.
void add_session_options(CLI::App& app, running::SessionRequest& request,
                         std::initializer_list<std::string_view> keys);
void add_session_options(CLI::App& app, running::SessionRequest& request);

/// `more`, and those options of the table that `app` has and whose values are read, or written: a
/// run may not write over what it reads.
std::vector<std::string> input_options(const CLI::App& app, std::vector<std::string> more);
std::vector<std::string> output_options(const CLI::App& app, std::vector<std::string> more);

/// The table of options for the documentation, in Markdown.
std::string options_page();

}  // namespace palpate::app
