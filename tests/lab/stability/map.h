#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <stop_token>
#include <string>
#include <vector>

namespace palpate::stability {

/// The result of a method at one point of a map.
enum class Outcome : uint8_t {
  /// It succeeded.
  kHeld,
  /// It failed and reported it: a verdict, a low confidence, a named cause.
  kFlagged,
  /// It failed and reported nothing.
  kSilent,
};

/// One point of a map for one method.
struct Cell {
  /// Shown as the colour, in the map's unit.
  double value = 0.0;
  Outcome outcome = Outcome::kHeld;
};

/// One axis of a map. It has numbers, or words if the values have no order.
struct Axis {
  std::string name;        ///< "displacement"
  std::string unit;        ///< "voxels"; empty: none
  std::vector<double> at;  ///< rising; for words 0, 1, 2, ...
  bool logarithmic = false;
  std::vector<std::string> words;  ///< one for each of `at`, or none
};

/// The i-th value for people: its word, or three digits, without the unit.
std::string value_text(const Axis& axis, size_t i);

/// A theoretical border in a map: where a method should begin to fail.
struct Border {
  std::string name;                ///< "q times phase = 1 (Banach)"
  std::vector<glm::dvec2> points;  ///< in the axes' units; may leave the map
};

/// The results of one method in a map.
struct Side {
  std::string method;  ///< "palpate", "classic Demons"
  /// How it reports a failure: "fades the force with the cause 'field'"; empty: it does not.
  std::string flag;
  std::vector<Cell> cells;  ///< x fastest
};

/// Where methods hold and where they fail, over two variables that make their task harder.
struct StabilityMap {
  std::string group;  ///< "motion", "back-tracking", "loop"
  std::string name;   ///< of its files: "noise"
  std::string title;
  /// What was done in each cell, one sentence.
  std::string made;
  std::string failed;  ///< what counts as a failure, one clause: "more than 5 % of ..."
  Axis x, y;
  /// The axis along which the sentence goes.
  bool harder_along_y = false;
  /// The quantity shown as the colour.
  std::string colour, colour_unit;
  double lowest = 0.0, highest = 1.0;  ///< ends of the colours
  bool logarithmic = false;            ///< the colours
  std::vector<Border> borders;
  std::vector<Side> sides;  ///< the classic method first, palpate last

  const Cell& cell(size_t side, size_t i, size_t j) const {
    return sides[side].cells[i + x.at.size() * j];
  }
};

/// The number of cells of a side by outcome.
struct Tally {
  int held = 0, flagged = 0, silent = 0;
  int all() const { return held + flagged + silent; }
};
Tally tally(const Side& side);

/// The meaning of the map, one sentence per method computed from its numbers, palpate first.
std::string meaning(const StabilityMap& map);

/// The map as a table: one row per cell, with a first row of names.
std::string csv(const StabilityMap& map);

/// Options for making maps.
struct Making {
  bool quick = false;
  uint32_t seed = 1;
  unsigned threads = 1;
  std::stop_token stop;
  /// The share of this map that is done; may be empty.
  std::function<void(double)> progress;

  /// The number of values of an axis.
  int count(int if_quick, int if_full) const { return quick ? if_quick : if_full; }
};

/// Fills a map's cells by a function of (side, x, y), called from `making.threads` threads at once
/// (one: from the caller's). After a stop request it ends early, with the other cells unchanged.
/// Passes exceptions of the function on.
void fill(StabilityMap& map, const Making& making,
          const std::function<Cell(size_t side, double x, double y)>& at);

/// n values from low to high, at equal intervals or at equal intervals of the logarithm.
std::vector<double> evenly(double low, double high, int n);
std::vector<double> log_evenly(double low, double high, int n);

/// The same as an axis.
Axis even_axis(std::string name, std::string unit, double low, double high, int n);
Axis log_axis(std::string name, std::string unit, double low, double high, int n);

/// A border at one value of x, along all of y, and at one value of y, along all of x.
Border border_at_x(std::string name, double x, const Axis& y);
Border border_at_y(std::string name, double y, const Axis& x);
/// The border y(x) over these values of x.
Border border_along_x(std::string name, const std::vector<double>& x,
                      const std::function<double(double)>& y);

/// A seed for every cell, the same for all methods, so that they get the same input.
uint32_t cell_seed(uint32_t seed, double x, double y);

}  // namespace palpate::stability
