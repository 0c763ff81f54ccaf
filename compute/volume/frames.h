#pragma once

#include <functional>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Frames from any source: their geometry, and a function that reads samples on demand.
struct Frames {
  std::string name;  ///< for people
  Grid grid;
  size_t count = 0;
  std::vector<double> times_s;  ///< one per frame; empty if not known
  std::string ordered_by;       ///< what gives their order; empty: their file
  /// In rising order; a frame that is asked for again may be read again.
  std::function<Result<Volume>(size_t)> read;
  bool in_memory = false;          ///< read() returns copies, in any order and repeatedly
  std::vector<std::string> notes;  ///< notes on the files for the user, a sentence each
};

}  // namespace palpate
