#include <fmt/format.h>

#include <stdexcept>

#include "tests/lab/bench/haptics_bench.h"
#include "tests/lab/bench/usb_turnaround.h"

namespace palpate::bench {

Findings usb_rows(const HapticsBench& bench) {
  std::string why;
  const auto found = usb_turnaround(int(bench.part(4000)), why);
  if (!found) throw std::runtime_error(why);
  Findings findings;
  Goal goal;
  goal.what = "USB turnaround, command to answer, emulated Falcon, median";
  goal.others = "1000: the latency timer";
  goal.unit = "us";
  goal.measured = found->median_us;
  goal.digits = 0;
  goal.beside = fmt::format(
      "{:.0f} the serial wire, {:.1f} palpate computes; the same transfers by libusb alone {:.0f}; "
      "99 % within {:.0f}",
      found->wire_us, found->ours_us, found->bare_median_us, found->p99_us);
  findings.goals.push_back(goal);
  findings.details.push_back(
      {"USB turnaround of an emulated Falcon",
       fmt::format("{} exchanges each, us. The emulation of the kernel costs most of what is not "
                   "the wire.",
                   found->exchanges),
       {{"way", "way"}, {"median_us", "median"}},
       {{words("palpate"), number(found->median_us, 0)},
        {words("the same transfers, libusb alone"), number(found->bare_median_us, 0)},
        {words("palpate, the chip without event character"), number(found->timer_median_us, 0)},
        {words("write, then read, without event character"), number(found->usual_median_us, 0)}}});
  return findings;
}

}  // namespace palpate::bench
