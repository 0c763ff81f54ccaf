// The main job for ten minutes with everything that may go wrong: `./run soak`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "compute/vulkan/context.h"
#include "tests/soak/soak.h"

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
  int told = -1;
  options.progress = [&](double seconds) {
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
  return report.broken.empty() && !grew && report.long_ticks_explained() ? 0 : 1;
}
