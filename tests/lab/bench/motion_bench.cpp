// How fast palpate estimates motion on a device, with its accuracy beside it. Makes its own data
// and needs nothing but the Vulkan loader, so that it can be copied to any machine.

#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bench_commit.h"
#include "compute/volume/grid.h"
#include "tests/lab/bench/motion_bench_cases.h"
#include "tests/lab/bench/motion_bench_kernels.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace {

using namespace palpate;
using namespace palpate::bench;

struct Wishes {
  std::string device, json, csv, append;
  int runs = 5;
  bool quick = false, large = false;
};

int fail(const std::string& why) {
  fmt::print(stderr, "motion_bench: {}\n", why);
  return 1;
}

bool write(const std::string& path, const std::string& text,
           std::ios::openmode mode = std::ios::trunc) {
  if (path.empty()) return true;
  std::ofstream file(path, mode);
  file << text;
  file.close();
  return bool(file);
}

/// Prints each table as soon as it is there.
std::vector<Table> measure(const Bench& bench, bool large) {
  std::vector<Table> tables;
  const auto add = [&](const std::function<Table()>& make) {
    const OtherLoad others;
    Table table = make();
    table.note += others.sentence();
    fmt::print("{}", plain_text(table));
    std::fflush(stdout);
    tables.push_back(std::move(table));
  };
  add([&] { return phantom_table(bench); });
  add([&] { return sequence_table(bench); });
  add([&] { return resting_table(bench); });
  add([&] { return classic_table(bench); });
  add([&] { return kernel_table(bench, "balanced"); });
  if (large) add([&] { return large_table(bench); });
  return tables;
}

int run(const Wishes& wishes) {
  vulkan::ContextOptions options;
  options.device = wishes.device;
  const auto context = vulkan::Context::open(options);
  if (!context) return fail(context.error().message);
  const vulkan::DeviceInfo& info = (*context)->info();
  Conditions conditions{info.name, info.driver, kBenchCommit,
                        fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))),
                        std::thread::hardware_concurrency()};
  fmt::print("{} ({}), {}, commit {}, {}, {} host threads, median of {}\n", info.name, info.kind,
             info.driver, conditions.commit, conditions.date, conditions.threads, wishes.runs);
  std::fflush(stdout);
  const std::vector<Table> tables = measure({*context, wishes.runs, wishes.quick}, wishes.large);
  if (!write(wishes.json, json(conditions, tables)))
    return fail("The file " + wishes.json + " could not be written: choose another place.");
  if (!write(wishes.csv, csv(conditions, tables)))
    return fail("The file " + wishes.csv + " could not be written: choose another place.");
  std::string page = fmt::format(
      "\n# motion_bench\n\nDevice {}, driver {}, commit {}, {}; {} host threads; medians of {} "
      "runs of "
      "`build/motion_bench`, in a process of its own.\n",
      conditions.device, conditions.driver, conditions.commit, conditions.date, conditions.threads,
      wishes.runs);
  for (const Table& table : tables) page += markdown(table);
  if (!write(wishes.append, page, std::ios::app))
    return fail("The file " + wishes.append + " could not be written: choose another place.");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Wishes wishes;
  CLI::App app("Accuracy and speed of palpate's motion estimation on data that it makes itself");
  app.add_option("--gpu,--device", wishes.device,
                 "Number or part of the name of the Vulkan device");
  app.add_option("--runs", wishes.runs, "Timed runs, of which the median counts")
      ->check(CLI::Range(1, 1000));
  app.add_flag("--quick", wishes.quick, "Small grids, one run: does everything work?");
  app.add_flag("--large", wishes.large, "Also 512 x 512 x 400 (takes 8 GB of host memory)");
  app.add_option("--json", wishes.json, "Write all numbers to this file");
  app.add_option("--csv", wishes.csv, "Write all numbers to this file");
  app.add_option("--append", wishes.append, "Add the tables to this file, as Markdown");
  CLI11_PARSE(app, argc, argv);
  if (wishes.quick && !app.count("--runs")) wishes.runs = 1;
  try {
    return run(wishes);
  } catch (const vulkan::Failure& failure) {
    return fail(failure.error().message);
  } catch (const Mismatch& mismatch) {
    return fail(mismatch.what());
  } catch (const std::bad_alloc&) {
    return fail("The host has too little memory for this: leave --large out.");
  }
}
