#include "integration/files/frame_times.h"

#include <cmath>
#include <string>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {

std::optional<double> seconds_per(std::string_view unit) {
  const std::string name = lowered(trimmed(unit));
  if (name == "s" || name == "sec" || name == "second" || name == "seconds") return 1.0;
  if (name == "ms" || name == "msec" || name == "millisecond" || name == "milliseconds")
    return 1e-3;
  if (name == "us" || name == "usec" || name == "\u00b5s" || name == "microsecond" ||
      name == "microseconds")
    return 1e-6;
  if (name == "min" || name == "minute" || name == "minutes") return 60.0;
  return std::nullopt;
}

bool is_rising(const std::vector<double>& times) {
  for (size_t k = 0; k < times.size(); ++k) {
    if (!std::isfinite(times[k]) || (k > 0 && !(times[k] > times[k - 1]))) return false;
  }
  return true;
}

Status check_rising(const std::filesystem::path& file, const std::vector<double>& times) {
  for (size_t k = 1; k < times.size(); ++k) {
    if (times[k] > times[k - 1]) continue;
    return bad_input(
        file,
        "has frame {} at {} s but frame {} at {} s: put the frames in the order of their times",
        k - 1, times[k - 1], k, times[k]);
  }
  if (!is_rising(times))
    return bad_input(file, "has a frame time that is not finite: correct its header");
  return Nothing{};
}

std::vector<double> counted_times(size_t frames) {
  std::vector<double> times(frames);
  for (size_t k = 0; k < frames; ++k) times[k] = double(k);
  return times;
}

}  // namespace palpate::files
