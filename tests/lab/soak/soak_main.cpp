// The main job for ten minutes with everything that may go wrong: `./run soak`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "compute/vulkan/context.h"
#include "tests/lab/soak/command_memory.h"
#include "tests/lab/soak/soak.h"

int main(int argc, char** argv) {
  using namespace palpate;
  CLI::App app(
      "Feels a beating heart with a simulated hand while scenes and estimated fields are handed "
      "over\n"
      "and the device fails at random. Ends with 1 if a promise was broken, memory grew, or a "
      "period\n"
      "was missed that the loop has nobody else to blame for.");
  soak::Options options;
  double minutes = 10.0;
  bool estimate = true;
  app.add_option("--minutes", minutes, "How long")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Of hand, faults and scenes")->capture_default_str();
  app.add_flag("!--no-estimate", estimate, "Hand over true fields instead of estimated ones");
  CLI11_PARSE(app, argc, argv);
  options.seconds = 60.0 * minutes;
  if (estimate) {
    auto context = vulkan::Context::open({});
    if (context) options.context = *context;
    fmt::print("Fields    {}\n", context ? "estimated on " + (*context)->info().name
                                         : "true ones: " + context.error().message);
  }
  // The command itself beside it: 30 s on, it has all that it will ever need.
  constexpr double kSettled_s = 30.0;
  constexpr size_t kMostGrowth_bytes = 1'000'000;
  const soak::CommandMemory command(PALPATE_PROGRAM, options.seconds + kSettled_s);
  size_t settled_bytes = 0, newest_bytes = 0;
  int told = -1;
  options.progress = [&](double seconds) {
    if (const size_t bytes = command.resident_bytes()) newest_bytes = bytes;
    if (settled_bytes == 0 && seconds >= kSettled_s) settled_bytes = newest_bytes;
    if (int(seconds) / 30 == told) return;
    told = int(seconds) / 30;
    fmt::print("{:6.0f} s of {:.0f}\n", seconds, options.seconds);
    std::fflush(stdout);
  };
  const soak::Report report = soak::run(options);
  fmt::print("{}", soak::text(report));
  // What caches and the allocator keep in hand.
  const bool grew = report.heap_end_bytes > report.heap_early_bytes + 16'000'000;
  if (grew) fmt::print("BROKEN    the heap grew\n");
  const bool command_grew = settled_bytes > 0 && newest_bytes > settled_bytes + kMostGrowth_bytes;
  if (settled_bytes > 0)
    fmt::print(
        "{:<10}the resident size of 'palpate feel' was {:.1f} MB after {:.0f} s, {:.1f} MB at the "
        "end\n",
        command_grew ? "BROKEN" : "Command", 1e-6 * double(settled_bytes), kSettled_s,
        1e-6 * double(newest_bytes));
  return report.broken.empty() && !grew && !command_grew && report.long_ticks_explained() ? 0 : 1;
}
