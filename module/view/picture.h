#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace palpate {

/// A picture on the host, an eye's: row 0 at the top.
struct Picture {
  int width = 0, height = 0;
  /// R in the lowest byte, then G, B, and coverage; sRGB
  std::vector<uint32_t> colours;
  std::vector<float> depths;  ///< near_m / depth along the eye's axis; 0 where nothing is
};

/// The linear light of a picture's colour, 0 to 1.
glm::vec3 light_of(uint32_t colour);
/// The colour of linear light, which is cut to 0 to 1; coverage: 0 to 255. Off by at most one.
uint32_t colour_of(glm::vec3 light, uint32_t coverage = 255);

}  // namespace palpate
