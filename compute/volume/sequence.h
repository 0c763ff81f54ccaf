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

/// Times for frames whose times nobody knows: all frames in one second, as a heart beats, but at
/// most 30 of them a second. Closed to a cycle after one more step. The first time is 0.
std::vector<double> assumed_times(size_t frames);

/// True if these are the assumed ones, as far as a file keeps numbers.
bool are_assumed_times(const std::vector<double>& times_s);

}  // namespace palpate
