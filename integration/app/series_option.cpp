#include "integration/app/series_option.h"

#include <fmt/format.h>

namespace palpate::app {

void add_series_option(CLI::App& app, std::vector<std::filesystem::path>& inputs) {
  app.add_option_function<std::string>(
         "--series",
         [&inputs](const std::string& series) {
           for (std::filesystem::path& input : inputs) {
             std::error_code error;
             if (!std::filesystem::is_directory(input, error) && input.filename() != "DICOMDIR") {
               throw CLI::ValidationError(
                   "--series", fmt::format("chooses among the DICOM series of a folder, but '{}' "
                                           "is none: name the folder",
                                           input.string()));
             }
             input += "#" + series;
           }
         },
         "DICOM: which series of the folder, by number or name ('palpate info FOLDER' lists them); "
         "several frames in their order: 3,5")
      ->type_name("SERIES");
}

}  // namespace palpate::app
