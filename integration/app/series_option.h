#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <vector>

namespace palpate::app {

/// Adds --series, which chooses among the DICOM series of the folders in `inputs`: each becomes
/// "FOLDER#SERIES" (files::split_series()). Add it after the option that fills `inputs`, which must
/// live as long as `app`.
void add_series_option(CLI::App& app, std::vector<std::filesystem::path>& inputs);

}  // namespace palpate::app
