// The USB turnaround by itself: what ./run bench haptics prints as one of its rows.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

#include "tests/bench/usb_turnaround.h"

int main(int argc, char** argv) {
  const int exchanges = argc > 1 ? std::atoi(argv[1]) : 2000;
  std::string why;
  const auto found = palpate::bench::usb_turnaround(exchanges > 0 ? exchanges : 2000, why);
  if (!found) {
    fmt::print(stderr, "usb_bench: {}\n", why);
    return 1;
  }
  fmt::print(
      "USB turnaround of an emulated Falcon, us, {} exchanges each\n"
      "  palpate                             median {:6.0f}   99 % within {:.0f}\n"
      "  of which the serial wire                   {:6.0f}   (computed: 16 bytes each way)\n"
      "  of which palpate computes                  {:6.2f}\n"
      "  the same transfers, libusb alone    median {:6.0f}\n"
      "  palpate, without event character    median {:6.0f}\n"
      "  write, then read, without it        median {:6.0f}\n",
      found->exchanges, found->median_us, found->p99_us, found->wire_us, found->ours_us,
      found->bare_median_us, found->timer_median_us, found->usual_median_us);
  return 0;
}
