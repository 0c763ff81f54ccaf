#include "tests/lab/program/commands.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "integration/app/cancel.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/files/atomic_file.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/stability/all_maps.h"
#include "tests/lab/stability/map_report.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct MapsCommand {
  std::string group;
  fs::path output = "stability.html";
  fs::path csv;
  bool quick = false;
  bool quiet = false;
  uint32_t seed = 1;
  DeviceOptions device;
};

constexpr const char* kLead =
    "Every method fails somewhere. These maps show where: each cell is a small experiment whose "
    "truth is known, harder to the right and upwards. What counts is that a method holds as far as "
    "it can, and that it says so where it does not: a failure that nobody is told of (a cross) is "
    "worse than one that is flagged (a dot).";

class MapsRun {
 public:
  MapsRun(const MapsCommand& command, Console& console, std::stop_token stop)
      : command_(command), console_(console), stop_(std::move(stop)) {}

  Status run() {
    // Checks what would end the work later.
    if (const Status can = files::check_can_write_file(command_.output); !can) return can;
    if (const Status can = report::check_plots(); !can) return can;
    std::shared_ptr<vulkan::Context> context;
    if (command_.group.empty() || command_.group == "motion") {
      auto opened = open_device(command_.device, console_);
      if (!opened) return opened.error();
      context = *opened;
      page_.conditions.emplace_back("Device", context->info().name);
    }
    const auto start = Clock::now();
    if (const Status made = make(stability::maps_of(command_.group, context)); !made) return made;
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    page_.title = "Where methods fail";
    page_.lead = kLead;
    page_.conditions.emplace_back(
        "Run", fmt::format("{}, seed {}, {}", command_.quick ? "quick" : "full", command_.seed,
                           duration_text(seconds)));
    page_.conditions.emplace_back("Program", "palpate " PALPATE_VERSION);
    page_.conditions.emplace_back("Date",
                                  fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr))));
    report::Section whole{"whole", "All together", stability::whole_meaning(maps_), {}};
    page_.sections.insert(page_.sections.begin(), std::move(whole));
    return files::write_text(command_.output, report::html(page_));
  }

  std::string summary() const {
    return fmt::format("\n{}\nWrote     {}", stability::whole_meaning(maps_),
                       command_.output.string());
  }

 private:
  Status make(const std::vector<stability::MapMaker>& makers) {
    double all = 0.0, done = 0.0;
    for (const auto& maker : makers) all += maker.seconds;
    for (const auto& maker : makers) {
      stability::Making making;
      making.quick = command_.quick;
      making.seed = command_.seed;
      making.threads = std::max(1U, std::thread::hardware_concurrency());
      making.stop = stop_;
      making.progress = [&](double share) {
        console_.progress((done + share * maker.seconds) / all, maker.doing);
      };
      console_.progress(done / all, maker.doing);
      stability::StabilityMap map = maker.make(making);
      if (stop_.stop_requested()) {
        console_.end_progress();
        return Error{ErrorKind::kCancelled, "Stopped before all maps were made"};
      }
      done += maker.seconds;
      auto section = stability::section_of(map);
      if (!section) return section.error();
      console_.say(fmt::format("{}\n  {}", map.title, stability::meaning(map)));
      page_.sections.push_back(std::move(*section));
      if (const Status written = write_csv(map); !written) return written;
      maps_.push_back(std::move(map));
    }
    console_.progress(1.0, "done");
    console_.end_progress();
    return Nothing{};
  }

  Status write_csv(const stability::StabilityMap& map) const {
    if (command_.csv.empty()) return Nothing{};
    std::error_code error;
    fs::create_directories(command_.csv, error);
    if (error)
      return Error{ErrorKind::kBadOutput, fmt::format("The folder '{}' can not be made: {}",
                                                      command_.csv.string(), error.message())};
    return files::write_text(command_.csv / (map.group + "-" + map.name + ".csv"),
                             stability::csv(map));
  }

  const MapsCommand& command_;
  Console& console_;
  std::stop_token stop_;
  report::Page page_;
  std::vector<stability::StabilityMap> maps_;
};

int run(const MapsCommand& command) {
  Console console(command.quiet, false, Steps::kLines);
  const CancelOnSignal cancel;
  MapsRun run(command, console, cancel.token());
  try {
    if (const Status done = run.run(); !done) return fail(console, done.error());
  } catch (const vulkan::Failure& failure) {
    return fail(console, failure.error());
  }
  console.say(run.summary());
  return kExitOk;
}

}  // namespace

Command add_maps(CLI::App& program) {
  auto command = std::make_shared<MapsCommand>();
  CLI::App* app = program.add_subcommand(
      "maps", "Draw maps of where methods fail, the classic ones beside palpate");
  app->add_option("group", command->group,
                  "Which maps: motion, back-tracking, loop; all if not given")
      ->check(one_of({"motion", "back-tracking", "loop"}));
  app->add_flag("--quick", command->quick, "Few cells: all maps in about a minute");
  app->add_option("-o,--out", command->output, "The report")
      ->type_name("FILE")
      ->capture_default_str();
  app->add_option("--csv", command->csv, "Folder for a table of each map")->type_name("DIR");
  app->add_option("--seed", command->seed, "Of all that is drawn at random")
      ->check(whole_number_in(0, std::numeric_limits<uint32_t>::max()))
      ->capture_default_str();
  app->add_flag("--quiet", command->quiet, "Print errors only");
  add_device_options(*app, command->device);
  return {app, [command] { return run(*command); }, {}, {"--out", "--csv"}, {}};
}

}  // namespace palpate::app
