// The numbers that the hand's side of palpate is to reach, and what was measured on this machine:
// time, accuracy, stability. The paper's own loop, built from the same parts, runs beside it.

#include "tests/lab/bench/haptics_bench.h"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bench_commit.h"
#include "tests/lab/bench/tools.h"

namespace palpate::bench {

Table goal_table(const std::string& title, const std::string& note,
                 const std::vector<Goal>& goals) {
  Table table{title,
              note,
              {{"what", "what"},
               {"others", "the paper, others"},
               {"reach", "reach"},
               {"aim", "aim"},
               {"measured", "measured"},
               {"unit", "unit"},
               {"meets", "meets"},
               {"beside", "in the same run"}},
              {}};
  for (const Goal& goal : goals) {
    const auto limit = [](const std::optional<double>& value) {
      return value ? Cell{fmt::format("{:g}", *value), *value} : nothing();
    };
    const bool aim = goal.aim && goal.measured <= *goal.aim;
    const bool open = !goal.aim && !goal.reach;
    const bool reach = goal.reach && goal.measured <= *goal.reach;
    table.rows.push_back({words(goal.what), words(goal.others), limit(goal.reach), limit(goal.aim),
                          number(goal.measured, goal.digits), words(goal.unit),
                          words(aim     ? "aim"
                                : reach ? "reach"
                                : open  ? "no goal"
                                        : "short"),
                          words(goal.beside)});
  }
  return table;
}

}  // namespace palpate::bench

namespace {

using namespace palpate;
using namespace palpate::bench;

struct Wishes {
  std::string json, csv, page;
  std::set<std::string> families;
  HapticsBench bench;
};

struct Family {
  const char* name;
  std::function<Findings(const HapticsBench&)> rows;
};

const std::vector<Family>& families() {
  static const std::vector<Family> all = {{"time", time_rows},
                                          {"force", force_rows},
                                          {"pop-through", pop_through_rows},
                                          {"back-tracking", back_track_rows},
                                          {"frame-ends", frame_end_rows},
                                          {"stability", stability_rows},
                                          {"usb", usb_rows}};
  return all;
}

/// The processor's name, as the system tells it.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown processor";
}

int fail(const std::string& why) {
  fmt::print(stderr, "haptics_bench: {}\n", why);
  return 1;
}

bool write(const std::string& path, const std::string& text) {
  if (path.empty()) return true;
  std::ofstream file(path);
  file << text;
  file.close();
  return bool(file);
}

std::vector<Table> measure(const Wishes& wishes) {
  std::vector<Goal> goals;
  std::vector<Table> tables;
  std::string note =
      "Meets: what was measured is no more than the aim, or than what is to be reached, or falls "
      "short of both.";
  for (const Family& family : families()) {
    if (!wishes.families.empty() && !wishes.families.count(family.name)) continue;
    const OtherLoad others;
    const double begin = now_s();
    Findings found = family.rows(wishes.bench);
    const std::string load = others.sentence();
    note += fmt::format(" {}: {:.0f} s.{}", family.name, now_s() - begin, load);
    for (Table& table : found.details) {
      table.note += load;
      fmt::print("{}", plain_text(table));
      tables.push_back(std::move(table));
    }
    std::fflush(stdout);
    goals.insert(goals.end(), found.goals.begin(), found.goals.end());
  }
  tables.insert(tables.begin(), goal_table("Goals", note, goals));
  fmt::print("{}", plain_text(tables.front()));
  return tables;
}

int run(const Wishes& wishes) {
  const Conditions conditions{processor(), "none", kLabCommit,
                              fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))),
                              std::thread::hardware_concurrency()};
  fmt::print("{}, commit {}, {}, {} threads\n", conditions.device, conditions.commit,
             conditions.date, conditions.threads);
  std::fflush(stdout);
  const std::vector<Table> tables = measure(wishes);
  std::string page = fmt::format(
      "# The hand: time, accuracy, stability\n\n{}, {} cores, commit {}, {}. Written by "
      "`./run bench haptics`. No GPU has a part in this.\n",
      conditions.device, conditions.threads, conditions.commit, conditions.date);
  for (const Table& table : tables) page += markdown(table);
  for (const auto& [file, text] :
       {std::pair{wishes.page, page}, std::pair{wishes.json, json(conditions, tables)},
        std::pair{wishes.csv, csv(conditions, tables)}})
    if (!write(file, text))
      return fail("The file " + file + " could not be written: choose another place.");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Wishes wishes;
  HapticsBench& bench = wishes.bench;
  bench.threads = std::max(1U, std::thread::hardware_concurrency());
  CLI::App app("Time, accuracy and stability of the haptic loop on data that it makes itself");
  std::vector<std::string> names, chosen;
  for (const Family& family : families()) names.emplace_back(family.name);
  app.add_option("--only", chosen, "These families of rows")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app.add_option("--frames", bench.frames, "Haptic frames of the search for pop-through")
      ->check(CLI::Range(int64_t(1), int64_t(100'000'000'000)));
  app.add_option("--stability-runs", bench.stability_runs, "Runs of each row of limit cycles")
      ->check(CLI::Range(1, 100'000'000));
  app.add_option("--threads", bench.threads, "For what is not timed")->check(CLI::Range(1, 1024));
  app.add_flag("--quick", bench.quick, "A fortieth of everything: does it work?");
  app.add_option("--markdown", wishes.page, "Write the tables to this file");
  app.add_option("--json", wishes.json, "Write all numbers to this file");
  app.add_option("--csv", wishes.csv, "Write all numbers to this file");
  CLI11_PARSE(app, argc, argv);
  wishes.families = {chosen.begin(), chosen.end()};
  if (!app.count("--frames")) bench.frames = bench.part(20'000'000);
  if (!app.count("--stability-runs")) bench.stability_runs = int(bench.part(10'000));
  try {
    return run(wishes);
  } catch (const Mismatch& mismatch) {
    return fail(mismatch.what());
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}
