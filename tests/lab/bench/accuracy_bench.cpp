// How accurate palpate's motion fields are, beside their time, and beside ITK's registration
// filters in the same run on the same threads: the table of what is to be reached.

#ifdef __linux__
#include <sched.h>
#endif

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bench_commit.h"
#include "tests/lab/bench/accuracy_tables.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/studies/warm_pair.h"

namespace {

using namespace palpate;
using namespace palpate::bench;

struct Wishes {
  std::string data = PALPATE_SHARED_DATA;
  std::string device, markdown, json;
  int runs = 3, threads = 2;
};

int fail(const std::string& why, int code) {
  fmt::print(stderr, "accuracy_bench: {}\n", why);
  return code;
}

bool write(const std::string& path, const std::string& text) {
  if (path.empty()) return true;
  std::ofstream file(path);
  file << text;
  file.close();
  return bool(file);
}

/// Keeps the whole process on so many cores, so that a device that is the CPU has no more of them
/// than the peers. Before any thread starts.
bool stay_on_cores(int count) {
#ifdef __linux__
  cpu_set_t allowed, chosen;
  CPU_ZERO(&chosen);
  if (sched_getaffinity(0, sizeof(allowed), &allowed) != 0) return false;
  for (size_t core = 0; core < CPU_SETSIZE && CPU_COUNT(&chosen) < count; ++core)
    if (CPU_ISSET(core, &allowed)) CPU_SET(core, &chosen);
  return CPU_COUNT(&chosen) == count && sched_setaffinity(0, sizeof(chosen), &chosen) == 0;
#else
  return false;
#endif
}

std::string markdown_page(const Conditions& about, const Wishes& wishes,
                          const std::vector<Table>& tables) {
  std::string page = fmt::format(
      "# Accuracy and time: {}\n\nDevice {}, driver {}, commit {}, {}. {} CPU threads for "
      "palpate's "
      "device (where that is the CPU), its host code, and the peers alike; medians of {}, peers "
      "and "
      "palpate in alternation in one process. Written by `build/accuracy_bench --markdown FILE`.\n",
      about.device, about.device, about.driver, about.commit, about.date, wishes.threads,
      wishes.runs);
  for (const Table& table : tables) page += markdown(table);
  return page;
}

/// Each table is printed as soon as it is there; that of the targets, which sums them up, is put
/// first in what is returned.
std::vector<Table> measure(AccuracyBench& bench, const LungData& lung) {
  std::vector<Table> tables;
  const auto add = [&](const std::function<Table()>& make) {
    const OtherLoad others;
    Table table = make();
    table.note += others.sentence();
    fmt::print("{}", plain_text(table));
    std::fflush(stdout);
    tables.push_back(std::move(table));
  };
  // What is timed against a peer comes first: a quiet machine seldom stays so.
  add([&] { return pair_table(bench, lung); });
  add([&] { return rate_table(bench); });
  add([&] { return gain_table(bench, lung); });
  add([&] { return steps_table(bench, lung); });
  add([&] { return cycle_table(bench, lung); });
  add([&] { return consistency_table(bench, lung); });
  add([&] { return made_table(bench); });
  add([&] { return targets_table(bench); });
  std::rotate(tables.begin(), std::prev(tables.end()), tables.end());
  return tables;
}

int run(const Wishes& wishes) {
  if (!stay_on_cores(wishes.threads)) {
    return fail(
        fmt::format("The process can not be kept on {} cores: give --threads that are there.",
                    wishes.threads),
        2);
  }
  vulkan::ContextOptions options;
  options.device = wishes.device;
  const auto context = vulkan::Context::open(options);
  if (!context) return fail(context.error().message, 2);
  const auto lung = read_lung(wishes.data);
  if (!lung) return fail(lung.error().message, 2);
  const vulkan::DeviceInfo& info = (*context)->info();
  const Conditions about{info.name, info.driver, kBenchCommit,
                         fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))),
                         unsigned(wishes.threads)};
  fmt::print("{}, {}, commit {}, {}, {} threads, medians of {}\n", about.device, about.driver,
             about.commit, about.date, wishes.threads, wishes.runs);
  std::fflush(stdout);
  AccuracyBench bench{*context, wishes.threads, wishes.runs, {}};
  const std::vector<Table> tables = measure(bench, *lung);
  if (!write(wishes.markdown, markdown_page(about, wishes, tables)))
    return fail("The file " + wishes.markdown + " could not be written: choose another place.", 2);
  if (!write(wishes.json, json(about, tables)))
    return fail("The file " + wishes.json + " could not be written: choose another place.", 2);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Wishes wishes;
  CLI::App app(
      "Accuracy and time of palpate's motion fields beside ITK's, on data with known motion");
  app.add_option("data", wishes.data, "Folder that holds lung/ (default: " + wishes.data + ")");
  app.add_option("--gpu,--device", wishes.device,
                 "Number or part of the name of the Vulkan device");
  app.add_option("--runs", wishes.runs, "Timed runs, of which the median counts")
      ->check(CLI::Range(1, 100));
  app.add_option("--threads", wishes.threads, "Cores for everything")->check(CLI::Range(1, 256));
  app.add_option("--markdown", wishes.markdown, "Write the tables to this file");
  app.add_option("--json", wishes.json, "Write all numbers to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(wishes);
  } catch (const vulkan::Failure& failure) {
    return fail(failure.error().message, 1);
  } catch (const Mismatch& mismatch) {
    return fail(mismatch.what(), 1);
  } catch (const std::bad_alloc&) {
    return fail("The host has too little memory for this.", 1);
  }
}
