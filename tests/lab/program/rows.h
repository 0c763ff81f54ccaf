#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "tests/lab/report/table.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate::app {

/// Where a command writes its rows, besides the terminal. Empty: not at all.
struct RowFiles {
  std::filesystem::path csv, json, markdown;
};
/// --csv, --json and --markdown.
void add_row_options(CLI::App& command, RowFiles& files);
/// Their names, for Command::writes.
std::vector<std::string> row_outputs();
/// To be asked before anything is measured. kBadOutput.
Status check_can_write(const RowFiles& files);

/// The tables of one run: each is printed as soon as it is there, and all are written at the end.
class Rows {
 public:
  /// `command`: as it was called, for what is written. `context`: null where no GPU has a part.
  /// Prints on what is measured.
  Rows(std::string command, const vulkan::Context* context);

  /// Measures one and prints it; its note says how busy other programs kept the machine meanwhile.
  report::Table& add(const std::function<report::Table()>& measure);
  /// Tables that were measured together, behind those that are there.
  void add(std::vector<report::Table> tables);
  /// The last one first: it sums up the others.
  void last_is_first();

  const std::vector<report::Table>& tables() const { return tables_; }
  const report::Conditions& about() const { return about_; }
  /// kBadOutput.
  Status write(const RowFiles& files) const;

 private:
  std::string command_;
  report::Conditions about_;
  std::vector<report::Table> tables_;
};

/// Runs what measures; a measurement that can not be made or would mean nothing, and a device that
/// fails, end it with one sentence on stderr. The exit code.
int measured(const std::function<int()>& run);

}  // namespace palpate::app
