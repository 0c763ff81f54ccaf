// Speed and accuracy of palpate's motion: on synthetic pairs and on the real chest CT, the presets
// compared with ITK's Demons; the time of each part; and the results with the targets.
#include <fmt/format.h>

#include <algorithm>

#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "tests/lab/bench/motion_kernels.h"
#include "tests/lab/bench/motion_tables.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/peers.h"
#include "tests/lab/program/rows.h"

namespace palpate::app {
namespace {

using bench::CtData;
using bench::MotionBench;
namespace fs = std::filesystem;

struct MotionCommand {
  std::vector<std::string> words;
  fs::path data = "../shared/data";
  int runs = 0;
  bool quick = false, no_peers = false;
  DeviceOptions device;
  RowFiles rows;
};

/// A part of the measurements. Comparisons of times come first: a machine that is quiet now may not
/// be later.
struct Part {
  const char* word;
  bool by_default, needs_ct;
  std::function<void(MotionBench&, const CtData*, Rows&)> run;
};

const std::vector<Part>& parts() {
  static const std::vector<Part> all = {
      {"breath", true, true,
       [](MotionBench& b, const CtData* ct, Rows& rows) {
         rows.add([&] { return breath_table(b, *ct); });
       }},
      {"classic", true, false,
       [](MotionBench& b, const CtData*, Rows& rows) {
         rows.add([&] { return classic_table(b); });
       }},
      {"phantoms", true, false,
       [](MotionBench& b, const CtData*, Rows& rows) {
         rows.add([&] { return phantom_table(b); });
       }},
      {"steps", true, true,
       [](MotionBench& b, const CtData* ct, Rows& rows) { rows.add(step_tables(b, *ct)); }},
      {"gain", true, true,
       [](MotionBench& b, const CtData* ct, Rows& rows) {
         rows.add([&] { return gain_table(b, *ct); });
       }},
      {"cycle", true, true,
       [](MotionBench& b, const CtData* ct, Rows& rows) {
         rows.add([&] { return cycle_table(b, *ct); });
       }},
      {"consistency", true, true,
       [](MotionBench& b, const CtData* ct, Rows& rows) {
         rows.add([&] { return consistency_table(b, *ct); });
       }},
      {"sequences", true, false,
       [](MotionBench& b, const CtData*, Rows& rows) {
         rows.add([&] { return sequence_table(b); });
       }},
      {"rest", true, false,
       [](MotionBench& b, const CtData*, Rows& rows) {
         rows.add([&] { return resting_table(b); });
       }},
      {"kernels", true, false,
       [](MotionBench& b, const CtData*, Rows& rows) {
         rows.add([&] { return kernel_table(b, "balanced"); });
       }},
      {"large", false, false,
       [](MotionBench& b, const CtData*, Rows& rows) { rows.add([&] { return large_table(b); }); }},
  };
  return all;
}

/// The best filters: by error, and by error in a given time.
std::vector<std::unique_ptr<studies::PairMethod>> best_demons(bool quick) {
  std::vector<std::unique_ptr<studies::PairMethod>> peers;
  for (const ItkFilter& filter : {kItkFilters[2], kItkFilters[3]})
    if (auto peer = itk_peer(filter, quick ? kItkFew : kItkLong)) peers.push_back(std::move(peer));
  return peers;
}

int run(const MotionCommand& command) {
  Console console(false, false);
  if (const Status can = check_can_write(command.rows); !can) return fail(console, can.error());
  std::vector<const Part*> chosen;
  for (const Part& part : parts()) {
    const auto& words = command.words;
    const bool named = std::find(words.begin(), words.end(), part.word) != words.end();
    if (words.empty() ? part.by_default : named) chosen.push_back(&part);
  }
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  std::optional<CtData> ct;
  if (std::any_of(chosen.begin(), chosen.end(), [](const Part* part) { return part->needs_ct; })) {
    auto read = bench::read_ct(command.data);
    if (!read && !command.words.empty()) return fail(console, read.error());
    if (read)
      ct = std::move(*read);
    else
      console.say("The real CT is left out. " + read.error().message);
  }

  MotionBench bench;
  bench.context = *context;
  bench.quick = command.quick;
  bench.runs = command.runs > 0 ? command.runs : command.quick ? 1 : 3;
  const bool peers = !command.no_peers && !best_demons(true).empty();
  if (!command.no_peers && !peers)
    console.say("ITK is left out: palpate_itk_peer is not beside palpate-lab.");
  bench.peers = [=] { return peers ? best_demons(command.quick) : decltype(best_demons(false)){}; };
  if (peers) bench.demons_iteration_s = itk_demons_iteration_s;
  Rows rows("motion", context->get());
  for (const Part* part : chosen)
    if (ct || !part->needs_ct) part->run(bench, ct ? &*ct : nullptr, rows);
  if (command.words.empty() && !command.quick) {
    rows.add([&] { return targets_table(bench); });
    rows.last_is_first();
  }
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_motion(CLI::App& program) {
  auto command = std::make_shared<MotionCommand>();
  CLI::App* app = program.add_subcommand(
      "motion", "Measure speed and accuracy of the motion presets, ITK's Demons beside");
  std::vector<std::string> words;
  for (const Part& part : parts()) words.emplace_back(part.word);
  app->add_option("what", command->words,
                  "Tables; if none is named all but large, which takes 8 GB of host memory")
      ->check(one_of(words));
  app->add_option("--data", command->data, "Folder with lung/, the real CT in known motion")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--runs", command->runs,
                  "Timed runs, of which the median counts (default: 3, quick: 1)")
      ->check(whole_number_in(1, 1000));
  app->add_flag("--quick", command->quick, "Small data and one run: does everything work?");
  app->add_flag("--no-peers", command->no_peers, "Leave ITK's Demons out");
  add_device_options(*app, command->device);
  add_row_options(*app, command->rows);
  return {app,
          [command] { return measured([&] { return run(*command); }); },
          {"--data"},
          row_outputs(),
          {}};
}

}  // namespace palpate::app
