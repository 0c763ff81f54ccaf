#include "module/scene/data_box.h"

#include <algorithm>
#include <cmath>

namespace palpate {

std::array<glm::dvec3, 8> DataBox::corners() const noexcept {
  std::array<glm::dvec3, 8> all{};
  for (int c = 0; c < 8; ++c) all[size_t(c)] = corner(c);
  return all;
}

DataBox straight_box(glm::dvec3 low_m, glm::dvec3 high_m) {
  return {low_m, glm::dmat3(1.0), high_m - low_m};
}

DataBox box_of(const FrameData& frame) {
  const GridPlace* place = frame.samples().place;
  if (!place) return straight_box(frame.low_m(), frame.high_m());
  // Voxels reach half an edge beyond their centres.
  const glm::dmat3 volume_from_index = glm::inverse(place->index_from_volume);
  DataBox box;
  box.corner_m = volume_from_index * (glm::dvec3(-0.5) - place->offset);
  for (int a = 0; a < 3; ++a) {
    const double edge_m = glm::length(volume_from_index[a]);
    box.axes[a] = volume_from_index[a] / edge_m;
    box.edges_m[a] = edge_m * place->size[a];
  }
  return box;
}

std::string side_of(glm::dvec3 direction) {
  constexpr double kNamed = 0.35;  // a component that is named
  constexpr char kSides[3][2] = {{'R', 'L'}, {'I', 'S'}, {'P', 'A'}};
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  std::string side;
  for (const int a : order)
    if (std::abs(direction[a]) > kNamed) side += kSides[a][direction[a] > 0.0];
  return side;
}

}  // namespace palpate
