#include "integration/devices/polhem_protocol.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "module/haptics/force_vector.h"

namespace palpate::devices::polhem {
namespace {

constexpr int kForceCommand = 2;
constexpr double kMostMillinewtons = 32767.0;
constexpr size_t kNumbers = 8;  // three of place, four angles, info
// Further from the middle than any arm is long: what a device says then is none.
constexpr double kFarthest_mm = 1000.0;

// The device: x towards the user, y right, z up.
glm::dvec3 from_device(glm::dvec3 v) {
  return {v.y, v.z, v.x};
}
glm::dvec3 to_device(glm::dvec3 v) {
  return {v.z, v.x, v.y};
}

int millinewtons(double force_n) {
  return int(std::lround(std::clamp(1e3 * force_n, -kMostMillinewtons, kMostMillinewtons)));
}

/// All numbers of a line, and nothing else in it.
bool numbers_of(std::string_view line, std::array<double, kNumbers>& numbers) {
  const char* at = line.data();
  const char* const end = at + line.size();
  const auto skip = [&] {
    while (at < end && (*at == ' ' || *at == '\r')) ++at;
  };
  for (double& number : numbers) {
    skip();
    const auto [last, error] = std::from_chars(at, end, number);
    // Two numbers have a blank between them.
    if (error != std::errc() || (last < end && *last != ' ' && *last != '\r')) return false;
    at = last;
  }
  skip();
  return at == end;
}

}  // namespace

std::string force_line(glm::dvec3 force_n) {
  const glm::dvec3 f = to_device(force_n);
  std::string line = fmt::format("{} {} {} {} 0 0 0", millinewtons(f.x), millinewtons(f.y),
                                 millinewtons(f.z), kForceCommand);
  line.resize(kLineBytes - 1, ' ');
  return line + '\n';
}

std::optional<PolhemAnswer> answer_of(std::string_view line) {
  std::array<double, kNumbers> numbers;
  if (!numbers_of(line, numbers)) return std::nullopt;
  for (const double number : numbers)
    if (!std::isfinite(number)) return std::nullopt;
  const glm::dvec3 place_mm(numbers[0], numbers[1], numbers[2]);
  if (length_of(place_mm) > kFarthest_mm || std::abs(numbers[7]) > kMostMillinewtons)
    return std::nullopt;
  return PolhemAnswer{1e-3 * from_device(place_mm), int(numbers[7])};
}

void LineSplitter::read(std::string_view bytes) {
  for (const char byte : bytes) {
    if (byte == '\n') {
      end_line();
    } else if (line_.size() < kLineBytes) {
      line_ += byte;
    } else {
      too_long_ = true;
    }
  }
}

std::optional<PolhemAnswer> LineSplitter::take() noexcept {
  const std::optional<PolhemAnswer> newest = newest_;
  newest_.reset();
  return newest;
}

void LineSplitter::end_line() {
  // An answer may be followed by an empty rest.
  if (too_long_ || line_.find_first_not_of(" \r") != std::string::npos) {
    ++count;
    const auto answer = too_long_ ? std::nullopt : answer_of(line_);
    if (answer) newest_ = answer;
    garbage |= !answer;
  }
  line_.clear();
  too_long_ = false;
}

}  // namespace palpate::devices::polhem
