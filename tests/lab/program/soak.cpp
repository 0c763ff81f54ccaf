#include <fmt/format.h>

#include <cstdio>
#include <limits>

#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "tests/lab/program/beside.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/soak/command_memory.h"
#include "tests/lab/soak/soak.h"

namespace palpate::app {
namespace {

// The command runs beside this program: after 30 s it has allocated all that it needs.
constexpr double kSettled_s = 30.0;
constexpr size_t kMostGrowth_bytes = 1'000'000;
// The memory that caches and the allocator keep.
constexpr int64_t kMostHeapGrowth_bytes = 16'000'000;

struct SoakCommand {
  double minutes = 10.0;
  uint32_t seed = 1;
  bool no_estimate = false;
  DeviceOptions device;
};

int run(const SoakCommand& command) {
  Console console(false, false);
  const auto palpate = program_beside("palpate");
  if (!palpate)
    return fail(console, {ErrorKind::kBadInput,
                          "The program palpate, which runs meanwhile, is not beside palpate-lab: "
                          "build it too"});
  soak::Options options;
  options.seconds = 60.0 * command.minutes;
  options.seed = command.seed;
  if (!command.no_estimate) {
    auto context = open_device(command.device, console);
    if (context) options.context = *context;
    console.say(context ? "Fields    estimated"
                        : "Fields    true ones: " + context.error().message);
  }
  const soak::CommandMemory running(palpate->string(), options.seconds + kSettled_s);
  size_t settled_bytes = 0, newest_bytes = 0;
  int told = -1;
  options.progress = [&](double seconds) {
    if (const size_t bytes = running.resident_bytes()) newest_bytes = bytes;
    if (settled_bytes == 0 && seconds >= kSettled_s) settled_bytes = newest_bytes;
    if (int(seconds) / 30 == told) return;
    told = int(seconds) / 30;
    console.say(fmt::format("{:6.0f} s of {:.0f}", seconds, options.seconds));
    std::fflush(stdout);
  };
  const soak::Report report = soak::run(options);
  fmt::print("{}", soak::text(report));
  const bool grew = report.heap_end_bytes > report.heap_early_bytes + kMostHeapGrowth_bytes;
  if (grew) fmt::print("BROKEN    the heap grew\n");
  const bool command_grew = settled_bytes > 0 && newest_bytes > settled_bytes + kMostGrowth_bytes;
  if (settled_bytes > 0)
    fmt::print(
        "{:<10}the resident size of 'palpate feel' was {:.1f} MB after {:.0f} s, {:.1f} MB at the "
        "end\n",
        command_grew ? "BROKEN" : "Command", 1e-6 * double(settled_bytes), kSettled_s,
        1e-6 * double(newest_bytes));
  const bool fine =
      report.broken.empty() && !grew && !command_grew && report.long_ticks_explained();
  return fine ? kExitOk : kExitInternal;
}

}  // namespace

Command add_soak(CLI::App& program) {
  auto command = std::make_shared<SoakCommand>();
  CLI::App* app = program.add_subcommand(
      "soak",
      "Feel a beating heart with a simulated hand while scenes and estimated fields are\n"
      "handed over and the device fails at random. Fails if a promise was broken, memory\n"
      "grew, or a period was missed that the loop has nobody else to blame for");
  app->add_option("--minutes", command->minutes, "How long")
      ->check(number_in({0.01, 100000.0}))
      ->capture_default_str();
  app->add_option("--seed", command->seed, "Of hand, faults and scenes")
      ->check(whole_number_in(0, std::numeric_limits<uint32_t>::max()))
      ->capture_default_str();
  app->add_flag("--no-estimate", command->no_estimate, "Hand over true fields, not estimated ones");
  add_device_options(*app, command->device);
  return {app, [command] { return run(*command); }, {}, {}, {}};
}

}  // namespace palpate::app
