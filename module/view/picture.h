#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// A picture on the host, an eye's: row 0 at the top.
struct Picture {
  int width = 0, height = 0;
  /// R in the lowest byte, then G, B, and coverage; sRGB
  std::vector<uint32_t> colours;
  std::vector<float> depths;  ///< near_m / depth along the eye's axis; 0 where nothing is
};

}  // namespace palpate
