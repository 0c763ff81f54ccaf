#pragma once

#include <string>
#include <vector>

#include "compute/volume/volume.h"

namespace palpate {

/// Frames of one moving volume, all on the same grid.
struct Sequence {
  std::string name;             ///< for messages: the file or folder it came from
  std::vector<Volume> frames;   ///< at least one
  std::vector<double> times_s;  ///< one per frame, rising; 0, 1, 2, ... where the file has none
  bool times_known = false;     ///< false if times_s is only a count
};

}  // namespace palpate
