#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "integration/app/progress.h"
#include "tests/lab/bench/inputs.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/study.h"

namespace palpate::app {

/// Data that the studies of one run share.
struct ChartJob {
  studies::StudyRun run;
  std::filesystem::path data;  ///< folder with lung/
  std::optional<bench::OwnPair> own;
  Console* console = nullptr;
};

/// A study: the word on the command line, and the function that makes its part of the report.
/// Throws as documented at studies::StudyRun. Errors: input that can not be read, matplotlib
/// missing.
struct ChartStudy {
  std::string word;  ///< "motion"
  /// For --help: the question that it answers.
  std::string about;
  /// Its approximate share of the whole run's time, for the progress bar.
  double share = 1.0;
  bool by_default = true;
  std::function<Result<report::Section>(const ChartJob&)> run;
};

/// All studies, in the order of the report. A new one is one more line in chart_study.cpp.
const std::vector<ChartStudy>& chart_studies();

}  // namespace palpate::app
