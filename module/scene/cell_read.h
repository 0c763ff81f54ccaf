#pragma once

#include "module/scene/grid_place.h"
#include "module/scene/lanes.h"
#include "module/scene/motion_map.h"

namespace palpate {

/// The cell of a field in which a point lies, and where in it.
struct CellRead {
  size_t low, to_x, to_y, to_z;  ///< offsets of samples: the lowest corner, and one step along
  AxisPlace x, y, z;

  CellRead(const GridPlace& place, glm::dvec3 x_m) noexcept
      : CellRead(place.size, place.index(x_m)) {}

  /// u there by trilinear interpolation; corner(offset) gives a sample as a Quad.
  template <class Corner>
  lanes::Quad value(const Corner& corner) const noexcept {
    const auto row = [&](size_t offset) {
      const lanes::Quad first = corner(offset);
      return lanes::moved(first, x.weight, corner(offset + to_x) - first);
    };
    const auto plane = [&](size_t offset) {
      const lanes::Quad first = row(offset);
      return lanes::moved(first, y.weight, row(offset + to_y) - first);
    };
    const lanes::Quad first = plane(low);
    return lanes::moved(first, z.weight, plane(low + to_z) - first);
  }

  /// u, its Jacobian and the confidence (the Quad's last component) from the 8 corners.
  template <class Corner>
  MotionSample value_and_jacobian(const GridPlace& place, const Corner& corner) const noexcept {
    using lanes::Quad;
    // Differences first, then blends: one pass gives value and exact derivative, and u keeps the
    // precision of its differences.
    const auto row = [&](size_t offset, Quad& along_x) {
      const Quad first = corner(offset);
      along_x = corner(offset + to_x) - first;
      return lanes::moved(first, x.weight, along_x);
    };
    Quad dx00, dx10, dx01, dx11;
    const Quad v00 = row(low, dx00), v10 = row(low + to_y, dx10);
    const Quad v01 = row(low + to_z, dx01), v11 = row(low + to_y + to_z, dx11);
    const Quad dy0 = v10 - v00, dy1 = v11 - v01;
    const Quad v0 = lanes::moved(v00, y.weight, dy0), v1 = lanes::moved(v01, y.weight, dy1);
    const Quad dx0 = lanes::moved(dx00, y.weight, dx10 - dx00);
    const Quad dx1 = lanes::moved(dx01, y.weight, dx11 - dx01);
    const Quad dz = v1 - v0;
    const Quad u = lanes::moved(v0, z.weight, dz);
    const Quad per_x = x.inside * lanes::moved(dx0, z.weight, dx1 - dx0);
    const Quad per_y = y.inside * lanes::moved(dy0, z.weight, dy1 - dy0);
    const Quad per_z = z.inside * dz;
    const auto column = [&](glm::dvec3 index_per_m) {
      return lanes::xyz(index_per_m.x * per_x + index_per_m.y * per_y + index_per_m.z * per_z);
    };
    const glm::dmat3& a = place.index_from_volume;
    return {lanes::xyz(u), glm::dmat3(column(a[0]), column(a[1]), column(a[2])), u.zw[1]};
  }

 private:
  CellRead(glm::ivec3 size, glm::dvec3 index) noexcept
      : x(index.x, size.x), y(index.y, size.y), z(index.z, size.z) {
    const size_t row = size_t(size.x), slice = row * size_t(size.y);
    low = size_t(x.low) + row * size_t(y.low) + slice * size_t(z.low);
    to_x = size_t(x.step);
    to_y = row * size_t(y.step);
    to_z = slice * size_t(z.step);
  }
};

}  // namespace palpate
