#include "tests/lab/stability/map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "compute/volume/phantom_texture.h"

namespace palpate::stability {
namespace {

const char* word(Outcome outcome) {
  switch (outcome) {
    case Outcome::kHeld:
      return "held";
    case Outcome::kFlagged:
      return "failed and said so";
    case Outcome::kSilent:
      return "failed unseen";
  }
  return "";
}

/// The number of lines of cells that are held before the first that is not, in the direction of
/// difficulty.
size_t lines_held(const StabilityMap& map, size_t side) {
  const bool along_y = map.harder_along_y;
  const size_t lines = (along_y ? map.y : map.x).at.size();
  const size_t others = (along_y ? map.x : map.y).at.size();
  for (size_t n = 0; n < lines; ++n)
    for (size_t m = 0; m < others; ++m)
      if ((along_y ? map.cell(side, m, n) : map.cell(side, n, m)).outcome != Outcome::kHeld)
        return n;
  return lines;
}

std::string reach_text(const StabilityMap& map, size_t side) {
  const Axis& axis = map.harder_along_y ? map.y : map.x;
  const size_t lines = lines_held(map, side);
  if (!axis.words.empty() || lines == 0 || lines == axis.at.size()) return "";
  return fmt::format(", in every one up to {}{}{} ({})", value_text(axis, lines - 1),
                     axis.unit.empty() ? "" : " ", axis.unit, axis.name);
}

std::string capital(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = char(text[0] - 'a' + 'A');
  return text;
}

std::string side_text(const StabilityMap& map, size_t side) {
  const Side& of = map.sides[side];
  const Tally t = tally(of);
  std::string text = of.method;
  text += t.held == t.all()
              ? fmt::format(" holds in all {} cells", t.all())
              : fmt::format(" holds in {} of {} cells{}", t.held, t.all(), reach_text(map, side));
  if (t.flagged) text += fmt::format("; in {} it {}", t.flagged, of.flag);
  if (t.silent) text += fmt::format("; in {} it fails unseen", t.silent);
  if (t.flagged && !t.silent) text += "; in none it fails unseen";
  return text + ".";
}

}  // namespace

std::string value_text(const Axis& axis, size_t i) {
  if (!axis.words.empty()) return axis.words[i];
  std::string text = fmt::format("{:.3g}", axis.at[i]);
  // Not as 3.18e+03.
  if (text.find("e+") != std::string::npos) text = fmt::format("{:.0f}", std::stod(text));
  return text;
}

Tally tally(const Side& side) {
  Tally t;
  for (const Cell& cell : side.cells) {
    t.held += cell.outcome == Outcome::kHeld;
    t.flagged += cell.outcome == Outcome::kFlagged;
    t.silent += cell.outcome == Outcome::kSilent;
  }
  return t;
}

std::string meaning(const StabilityMap& map) {
  std::string text;
  for (size_t s = map.sides.size(); s-- > 0;)
    text += (text.empty() ? "" : " ") + capital(side_text(map, s));
  return text;
}

namespace {

/// As one value of a row: in quotes if it contains a comma.
std::string quoted(const std::string& text) {
  return text.find(',') == std::string::npos ? text : '"' + text + '"';
}

}  // namespace

std::string csv(const StabilityMap& map) {
  std::string text = fmt::format("method,{},{},{},outcome\n", quoted(map.x.name),
                                 quoted(map.y.name), quoted(map.colour));
  for (const Side& side : map.sides)
    for (size_t j = 0; j < map.y.at.size(); ++j)
      for (size_t i = 0; i < map.x.at.size(); ++i) {
        const Cell& cell = side.cells[i + map.x.at.size() * j];
        const auto at = [](const Axis& axis, size_t n) {
          return axis.words.empty() ? fmt::format("{:.9g}", axis.at[n]) : axis.words[n];
        };
        text += fmt::format("{},{},{},{:.9g},{}\n", quoted(side.method), at(map.x, i), at(map.y, j),
                            cell.value, word(cell.outcome));
      }
  return text;
}

void fill(StabilityMap& map, const Making& making,
          const std::function<Cell(size_t side, double x, double y)>& at) {
  const size_t wide = map.x.at.size(), cells = wide * map.y.at.size();
  for (Side& side : map.sides) side.cells.assign(cells, Cell{});
  std::atomic<size_t> next{0}, done{0};
  std::mutex mutex;
  std::exception_ptr thrown;
  const size_t all = cells * map.sides.size();
  const auto work = [&] {
    for (size_t n = next++; n < all && !making.stop.stop_requested(); n = next++) {
      // Both methods of a cell follow each other. Their input is made twice, or cached by the
      // function.
      const size_t side = n % map.sides.size(), cell = n / map.sides.size();
      try {
        map.sides[side].cells[cell] = at(side, map.x.at[cell % wide], map.y.at[cell / wide]);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!thrown) thrown = std::current_exception();
        next = all;
      }
      const size_t so_far = ++done;
      const std::lock_guard lock(mutex);
      if (making.progress) making.progress(double(so_far) / double(all));
    }
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < making.threads; ++t) others.emplace_back(work);
  work();
  others.clear();
  if (thrown) std::rethrow_exception(thrown);
}

std::vector<double> evenly(double low, double high, int n) {
  std::vector<double> at;
  for (int i = 0; i < n; ++i) at.push_back(low + (high - low) * i / std::max(1, n - 1));
  return at;
}

std::vector<double> log_evenly(double low, double high, int n) {
  std::vector<double> at;
  for (int i = 0; i < n; ++i)
    at.push_back(low * std::pow(high / low, double(i) / std::max(1, n - 1)));
  return at;
}

Axis even_axis(std::string name, std::string unit, double low, double high, int n) {
  return {std::move(name), std::move(unit), evenly(low, high, n), false, {}};
}

Axis log_axis(std::string name, std::string unit, double low, double high, int n) {
  return {std::move(name), std::move(unit), log_evenly(low, high, n), true, {}};
}

namespace {

/// Beyond the outermost cells on both sides: the drawing cuts it off.
glm::dvec2 ends_beyond(const Axis& axis) {
  const double first = axis.at.front(), last = axis.at.back();
  if (axis.logarithmic) return {0.5 * first, 2.0 * last};
  const double more = std::max(0.5, 0.5 * (last - first));
  return {first - more, last + more};
}

}  // namespace

Border border_at_x(std::string name, double x, const Axis& y) {
  const glm::dvec2 ends = ends_beyond(y);
  return {std::move(name), {{x, ends.x}, {x, ends.y}}};
}

Border border_at_y(std::string name, double y, const Axis& x) {
  const glm::dvec2 ends = ends_beyond(x);
  return {std::move(name), {{ends.x, y}, {ends.y, y}}};
}

Border border_along_x(std::string name, const std::vector<double>& x,
                      const std::function<double(double)>& y) {
  Border border{std::move(name), {}};
  for (const double at : x) border.points.push_back({at, y(at)});
  return border;
}

uint32_t cell_seed(uint32_t seed, double x, double y) {
  const auto bits = [](double v) { return uint32_t(int64_t(std::llround(v * 1e6))); };
  return texture::mixed(seed ^ texture::mixed(bits(x) ^ texture::mixed(bits(y))));
}

}  // namespace palpate::stability
