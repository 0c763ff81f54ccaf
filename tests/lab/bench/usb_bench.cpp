// The turnaround of a Falcon on the emulated bus, from command to answer. A program of its own: the
// emulation replaces libusb and libudev for the whole process.
#include <fmt/format.h>

#include <cstdio>

#include "tests/lab/bench/usb_turnaround.h"
#include "tests/lab/report/table.h"

int main(int argc, char** argv) {
  using namespace palpate;
  const bool quick = argc > 1 && std::string(argv[1]) == "--quick";
  if (argc > (quick ? 2 : 1)) {
    fmt::print(stderr, "usb_bench: It takes nothing but --quick.\n");
    return 2;
  }
  std::string why;
  const auto found = bench::usb_turnaround(quick ? 100 : 4000, why);
  if (!found) {
    fmt::print(stderr, "usb_bench: {}\n", why);
    return 1;
  }
  using report::number;
  using report::words;
  const report::Table table{
      "USB turnaround of an emulated Falcon",
      fmt::format(
          "{} exchanges each, us. The serial wire takes {:.0f}, palpate computes {:.1f}, 99 "
          "% are within {:.0f}. The emulation of the kernel costs most of what is not the "
          "wire. The chip's latency timer alone would take 1000.",
          found->exchanges, found->wire_us, found->ours_us, found->p99_us),
      {{"way", "way"}, {"median_us", "median"}},
      {{words("palpate"), number(found->median_us, 0)},
       {words("the same transfers, libusb alone"), number(found->bare_median_us, 0)},
       {words("palpate, the chip without event character"), number(found->timer_median_us, 0)},
       {words("write, then read, without event character"), number(found->usual_median_us, 0)}}};
  fmt::print("{}", plain_text(table));
}
