// The goals for the haptic loop, and the values measured on this machine: time, accuracy,
// stability. The paper's own loop, built from the same parts, runs for comparison.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <thread>

#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/rows.h"

namespace palpate::app {
namespace {

using namespace palpate::bench;

struct FeelCommand {
  std::vector<std::string> words;
  FeelBench bench;
  RowFiles rows;
};

/// A part of the measurements.
struct Part {
  const char* word;
  std::function<Findings(const FeelBench&)> run;
};

const std::vector<Part>& parts() {
  static const std::vector<Part> all = {{"time", time_rows},
                                        {"force", force_rows},
                                        {"darts", dart_rows},
                                        {"back-tracking", back_track_rows},
                                        {"frame-ends", frame_end_rows},
                                        {"stability", stability_rows}};
  return all;
}

/// All goals as one table: what, others, reach, aim, measured, which limit is met, remarks.
Table goal_table(const std::string& note, const std::vector<Goal>& goals) {
  Table table{"Goals",
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

int run(const FeelCommand& command) {
  Console console(false, false);
  if (const Status can = check_can_write(command.rows); !can) return fail(console, can.error());
  Rows rows("feel", nullptr);
  std::vector<Goal> goals;
  std::string note =
      "Meets: the measured value is at most `aim`, at most `reach`, or `short` of both.";
  for (const Part& part : parts()) {
    const auto& words = command.words;
    if (!words.empty() && std::find(words.begin(), words.end(), part.word) == words.end()) continue;
    const OtherLoad others;
    const double begin = now_s();
    Findings found = part.run(command.bench);
    const std::string load = others.sentence();
    note += fmt::format(" {}: {:.0f} s.{}", part.word, now_s() - begin, load);
    for (Table& table : found.details) table.note += load;
    rows.add(std::move(found.details));
    goals.insert(goals.end(), found.goals.begin(), found.goals.end());
  }
  rows.add({goal_table(note, goals)});
  rows.last_is_first();
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_feel(CLI::App& program) {
  auto command = std::make_shared<FeelCommand>();
  FeelBench& bench = command->bench;
  bench.threads = std::max(1U, std::thread::hardware_concurrency());
  CLI::App* app = program.add_subcommand(
      "feel", "Measure time, accuracy and stability of the haptic loop, the paper's loop beside");
  std::vector<std::string> words;
  for (const Part& part : parts()) words.emplace_back(part.word);
  app->add_option("what", command->words, "Tables; all if none is named")->check(one_of(words));
  auto* frames =
      app->add_option("--frames", bench.frames,
                      "Haptic frames of the search for pop-through (default: 20 million)")
          ->check(whole_number_in(1, 100'000'000'000));
  auto* runs = app->add_option("--stability-runs", bench.stability_runs,
                               "Runs of each row of limit cycles (default: 10000)")
                   ->check(whole_number_in(1, 100'000'000));
  app->add_option("--lead-share", bench.lead_share,
                  "Of the delay, what the loop's lead takes back in the rows of limit cycles")
      ->check(number_in({0.0, 1.0}))
      ->capture_default_str();
  app->add_option("--threads", bench.threads, "For what is not timed (default: all)")
      ->check(whole_number_in(1, 1024));
  app->add_flag("--quick", bench.quick, "A fortieth of everything: does it work?");
  add_row_options(*app, command->rows);
  return {app,
          [command, frames, runs] {
            FeelBench& how = command->bench;
            if (frames->empty()) how.frames = how.part(20'000'000);
            if (runs->empty()) how.stability_runs = int(how.part(10'000));
            return measured([&] { return run(*command); });
          },
          {},
          row_outputs(),
          {}};
}

}  // namespace palpate::app
