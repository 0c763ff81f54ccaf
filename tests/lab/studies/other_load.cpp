#include "tests/lab/studies/other_load.h"

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "tests/lab/studies/measuring.h"

namespace palpate::studies {
namespace {

// s: the system counts in hundredths of a second.
constexpr double kShortest = 0.5;

/// Core seconds that all other programs, without those that this one called, have used since the
/// machine started; -1 if unknown.
double others_s() {
#ifdef __linux__
  std::ifstream stat("/proc/stat");
  std::string cpu;
  double user = 0, nice = 0, system = 0, idle = 0, wait = 0, interrupts = 0, soft = 0;
  if (!(stat >> cpu >> user >> nice >> system >> idle >> wait >> interrupts >> soft)) return -1.0;
  // Programs that this one has called and waited for do not count as others.
  rusage own{}, called{};
  if (getrusage(RUSAGE_SELF, &own) != 0 || getrusage(RUSAGE_CHILDREN, &called) != 0) return -1.0;
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return (user + nice + system + interrupts + soft) / double(sysconf(_SC_CLK_TCK)) -
         seconds(own.ru_utime) - seconds(own.ru_stime) - seconds(called.ru_utime) -
         seconds(called.ru_stime);
#else
  return -1.0;
#endif
}

}  // namespace

OtherLoad::OtherLoad() : begin_s_(now_s()), others_begin_s_(others_s()) {}

std::string OtherLoad::sentence() const {
  const double passed_s = now_s() - begin_s_;
  const double others = others_s();
  if (others < 0.0 || others_begin_s_ < 0.0 || passed_s < kShortest) return {};
  // Both clocks have a resolution of a hundredth of a second, so a difference can be slightly below
  // zero.
  const double cores = std::max(0.0, (others - others_begin_s_) / passed_s);
  return fmt::format(" Other programs used {:.2f} cores meanwhile.", cores);
}

}  // namespace palpate::studies
