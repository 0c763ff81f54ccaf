#include "integration/devices/scripted_path.h"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::devices {
namespace {

/// An hour at 1 kHz is below 300 MB; a larger file is no path.
constexpr uintmax_t kMaxBytes = 1u << 29;
/// A hand is nowhere beyond this, so a larger number is a wrong unit.
constexpr double kFarthest_m = 10.0;

/// The velocity at an inner point that keeps a cubic between its points: Fritsch and Carlson's
/// harmonic mean, 0 at a turn.
double rate_between(double before, double after, double dt_before, double dt_after) {
  if (!(before * after > 0.0)) return 0.0;
  const double w1 = 2.0 * dt_after + dt_before, w2 = dt_after + 2.0 * dt_before;
  return (w1 + w2) / (w1 / before + w2 / after);
}

std::vector<glm::dvec3> rates_of(const std::vector<ScriptedPath::PathPoint>& points) {
  // Rest at both ends: a hand that waits there has no velocity.
  std::vector<glm::dvec3> rates(points.size(), glm::dvec3(0.0));
  for (size_t n = 1; n + 1 < points.size(); ++n) {
    const double before_s = points[n].time_s - points[n - 1].time_s;
    const double after_s = points[n + 1].time_s - points[n].time_s;
    const glm::dvec3 before = (points[n].position_m - points[n - 1].position_m) / before_s;
    const glm::dvec3 after = (points[n + 1].position_m - points[n].position_m) / after_s;
    for (int axis = 0; axis < 3; ++axis)
      rates[n][axis] = rate_between(before[axis], after[axis], before_s, after_s);
  }
  return rates;
}

/// The line's numbers, or nothing if it is no point.
std::optional<ScriptedPath::PathPoint> point_of(std::string_view line) {
  const auto parts = files::cells(line, ',');
  if (parts.size() < 4 || parts.size() > 5) return std::nullopt;
  double numbers[4] = {};
  for (size_t n = 0; n < 4; ++n) {
    const auto number = files::to_number(parts[n]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[n] = *number;
  }
  ScriptedPath::PathPoint point{.time_s = numbers[0],
                                .position_m = {numbers[1], numbers[2], numbers[3]}};
  if (parts.size() == 5) {
    const auto buttons = files::to_integer(parts[4]);
    if (!buttons || *buttons < 0 || *buttons > int64_t(UINT32_MAX)) return std::nullopt;
    point.buttons = uint32_t(*buttons);
  }
  return point;
}

bool is_names(std::string_view line) {
  return files::lowered(line).starts_with("t");
}

}  // namespace

ScriptedPath::ScriptedPath(std::vector<PathPoint> points, Between between)
    : points_(std::move(points)) {
  for (size_t n = 1; n < points_.size(); ++n) assert(points_[n].time_s > points_[n - 1].time_s);
  if (between == Between::kSmooth) rates_ = rates_of(points_);
}

double ScriptedPath::duration_s() const {
  return points_.empty() ? 0.0 : points_.back().time_s;
}

size_t ScriptedPath::piece_of(double time_s) const noexcept {
  const auto later = std::upper_bound(points_.begin(), points_.end(), time_s,
                                      [](double t, const PathPoint& p) { return t < p.time_s; });
  return size_t(later - points_.begin());
}

uint32_t ScriptedPath::buttons(double time_s) const noexcept {
  const size_t next = piece_of(time_s);
  return next == 0 ? 0 : points_[next - 1].buttons;
}

glm::dvec3 ScriptedPath::position_m(double time_s) const noexcept {
  if (points_.empty()) return glm::dvec3(0.0);
  const size_t next = piece_of(time_s);
  if (next == 0) return points_.front().position_m;
  if (next == points_.size()) return points_.back().position_m;
  const PathPoint &a = points_[next - 1], &b = points_[next];
  const double dt = b.time_s - a.time_s, u = (time_s - a.time_s) / dt;
  if (rates_.empty()) return glm::mix(a.position_m, b.position_m, u);
  // Cubic Hermite.
  const double w = 1.0 - u;
  return a.position_m * (w * w * (1.0 + 2.0 * u)) + b.position_m * (u * u * (3.0 - 2.0 * u)) +
         rates_[next - 1] * (dt * u * w * w) - rates_[next] * (dt * u * u * w);
}

Result<ScriptedPath> parse_path(const std::filesystem::path& file, std::string_view text,
                                ScriptedPath::Between between) {
  std::vector<ScriptedPath::PathPoint> points;
  bool may_be_names = true;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark of spreadsheets
  for (size_t number = 1; !text.empty(); ++number) {
    std::string_view line = files::take_line(text);
    line = files::trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    const auto point = point_of(line);
    if (!point && may_be_names && is_names(line)) {
      may_be_names = false;
      continue;
    }
    may_be_names = false;
    if (!point) {
      return files::bad_input(file,
                              "has no point in line {} ('{}'): write 't_s,x_m,y_m,z_m', and the "
                              "buttons as a whole number behind it if you need them",
                              number, line.substr(0, 60));
    }
    const glm::dvec3 size = glm::abs(point->position_m);
    if (std::max({size.x, size.y, size.z}) > kFarthest_m) {
      return files::bad_input(file, "is more than {} m away in line {}: positions are in metres",
                              kFarthest_m, number);
    }
    if (!points.empty() && !(point->time_s > points.back().time_s)) {
      return files::bad_input(file,
                              "goes back in time in line {} ({} s after {} s): let times rise",
                              number, point->time_s, points.back().time_s);
    }
    points.push_back(*point);
  }
  if (points.empty())
    return files::bad_input(file, "holds no points: write one 't_s,x_m,y_m,z_m' per line");
  return ScriptedPath(std::move(points), between);
}

Result<ScriptedPath> read_path(const std::filesystem::path& file, ScriptedPath::Between between) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return files::bad_input(file, "does not exist or is no file: check the name");
  if (std::filesystem::file_size(file, error) > kMaxBytes)
    return files::bad_input(file, "is too large for a path: name the right file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    return files::bad_input(file, "can not be opened ({}): check the permissions",
                            std::strerror(errno));
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return parse_path(file, text.str(), between);
}

}  // namespace palpate::devices
