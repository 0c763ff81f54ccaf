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

/// The files to which a command writes its rows, besides the terminal. Empty: none.
struct RowFiles {
  std::filesystem::path csv, json, markdown;
};
/// --csv, --json and --markdown.
void add_row_options(CLI::App& command, RowFiles& files);
/// Their names, for Command::writes.
std::vector<std::string> row_outputs();
/// Call before anything is measured. kBadOutput.
Status check_can_write(const RowFiles& files);

/// The tables of one run: each is printed as soon as it is complete, and all are written at the
/// end.
class Rows {
 public:
  /// `command`: the command line, for the files. `context`: null if no GPU is used. Prints the
  /// measured device and machine.
  Rows(std::string command, const vulkan::Context* context);

  /// Measures one table and prints it; its note has the load by other programs during this time.
  report::Table& add(const std::function<report::Table()>& measure);
  /// Adds tables that were measured together, after the existing ones.
  void add(std::vector<report::Table> tables);
  /// Moves the last table, which summarises the others, to the front.
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

/// Runs measurements. If one can not be made or would mean nothing, or if a device fails, it ends
/// them with one sentence on stderr. Returns the exit status.
int measured(const std::function<int()>& run);

}  // namespace palpate::app
