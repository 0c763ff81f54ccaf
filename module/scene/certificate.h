#pragma once

#include <array>

#include "module/scene/lanes.h"
#include "module/scene/motion_map.h"

/// Bounds of a trilinear motion over a cell, four cells at a time.
namespace palpate::certificate {

/// u at the 8 corners of four cells less u at corner 0, by channel: u[corner][channel] holds one
/// float per cell. Corner c is at (c & 1, (c >> 1) & 1, c >> 2).
struct CellCorners {
  std::array<std::array<lanes::Float4, 3>, 8> u{};
};

/// How the cells lie: lengths and directions of their axes.
struct CellShape {
  glm::vec3 edges;  ///< m
  glm::mat3 axes;   ///< columns are the unit vectors of i, j, k in the space of u
};

/// The certificates of four cells. Sound: they hold at every place in the cell and for every g in
/// [0, 1], rounding included. Where the first determinant bound says "may fold", the cell is cut in
/// eight, twice at most, for a sharper bound.
std::array<CellCertificate, 4> bounds(const CellCorners& corners, const CellShape& shape) noexcept;

}  // namespace palpate::certificate
