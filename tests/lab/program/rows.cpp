#include "tests/lab/program/rows.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/program.h"
#include "integration/app/version.h"
#include "integration/files/atomic_file.h"
#include "tests/lab/studies/measuring.h"
#include "tests/lab/studies/other_load.h"

namespace palpate::app {
namespace {

/// The processor's name, as reported by the system.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown processor";
}

void print(const report::Table& table) {
  fmt::print("{}", plain_text(table));
  std::fflush(stdout);
}

}  // namespace

void add_row_options(CLI::App& command, RowFiles& files) {
  for (const auto& [name, file, what] : {std::tuple("--csv", &files.csv, "All numbers as CSV"),
                                         {"--json", &files.json, "All numbers as JSON"},
                                         {"--markdown", &files.markdown, "The tables as Markdown"}})
    command.add_option(name, *file, what)->type_name("FILE");
}

std::vector<std::string> row_outputs() {
  return {"--csv", "--json", "--markdown"};
}

Status check_can_write(const RowFiles& files) {
  for (const auto& file : {files.csv, files.json, files.markdown})
    if (!file.empty())
      if (const Status can = files::check_can_write_file(file); !can) return can;
  return Nothing{};
}

Rows::Rows(std::string command, const vulkan::Context* context)
    : command_(std::move(command)),
      about_{context ? context->info().name : processor(),
             context ? context->info().driver : "none", built_commit(),
             fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))),
             std::thread::hardware_concurrency()} {
  fmt::print("{}, driver {}, {} threads, commit {}, {}\n", about_.device, about_.driver,
             about_.threads, about_.commit, about_.date);
  std::fflush(stdout);
}

report::Table& Rows::add(const std::function<report::Table()>& measure) {
  const studies::OtherLoad others;
  report::Table table = measure();
  table.note += others.sentence();
  print(table);
  return tables_.emplace_back(std::move(table));
}

void Rows::add(std::vector<report::Table> tables) {
  for (report::Table& table : tables) {
    print(table);
    tables_.push_back(std::move(table));
  }
}

void Rows::last_is_first() {
  if (!tables_.empty()) std::rotate(tables_.begin(), tables_.end() - 1, tables_.end());
}

Status Rows::write(const RowFiles& files) const {
  std::string page = fmt::format(
      "# palpate-lab {}\n\nDevice {}, driver {}, commit {}, {}; {} threads of the host.\n",
      command_, about_.device, about_.driver, about_.commit, about_.date, about_.threads);
  for (const report::Table& table : tables_) page += markdown(table);
  for (const auto& [file, text] : {std::pair(files.csv, csv(about_, tables_)),
                                   {files.json, json(about_, tables_)},
                                   {files.markdown, page}})
    if (!file.empty())
      if (const Status written = files::write_text(file, text); !written) return written;
  return Nothing{};
}

int measured(const std::function<int()>& run) {
  std::string why;
  try {
    return run();
  } catch (const studies::Mismatch& mismatch) {
    why = mismatch.what();
  } catch (const vulkan::Failure& failure) {
    why = failure.error().message;
  }
  fmt::print(stderr, "{}: {}\n", kProgramName, why);
  return kExitInternal;
}

}  // namespace palpate::app
