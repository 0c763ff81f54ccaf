#include "module/scene/certificate.h"

#include <algorithm>
#include <cmath>

namespace palpate::certificate {
namespace {

using lanes::Float4;
using LaneVector = std::array<Float4, 3>;

// Means and sums of some 60 float products, each rounded by 6e-8, whose terms are bounded by
// (1 + q)^3; parts of a cell are known to 8 roundings of its edges, four times magnified.
constexpr float kRounding = 2e-5F;
constexpr int kDeepestCut = 2;

Float4 dot(const LaneVector& a, const LaneVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
LaneVector cross(const LaneVector& a, const LaneVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Float4 least(Float4 a, Float4 b) {
  return a < b ? a : b;
}
Float4 greatest(Float4 a, Float4 b) {
  return a > b ? a : b;
}

/// du / d(length) along the 4 edges of each axis, in the cell's own axes. Edge e of axis a runs
/// from the corner whose two other bits (lower axis first) are those of e.
using Edges = std::array<std::array<LaneVector, 4>, 3>;

int edge_start(int axis, int edge) {
  const int first = edge & 1, second = edge >> 1;
  if (axis == 0) return first << 1 | second << 2;
  if (axis == 1) return first | second << 2;
  return first | second << 1;
}

Edges edges_of(const CellCorners& corners, const CellShape& shape) {
  Edges edges;
  for (int a = 0; a < 3; ++a)
    for (int e = 0; e < 4; ++e) {
      const auto& low = corners.u[size_t(edge_start(a, e))];
      const auto& high = corners.u[size_t(edge_start(a, e) | 1 << a)];
      const float per_m = 1.0F / shape.edges[a];
      const LaneVector d{(high[0] - low[0]) * per_m, (high[1] - low[1]) * per_m,
                         (high[2] - low[2]) * per_m};
      for (int r = 0; r < 3; ++r)
        edges[size_t(a)][size_t(e)][size_t(r)] =
            d[0] * shape.axes[r].x + d[1] * shape.axes[r].y + d[2] * shape.axes[r].z;
    }
  return edges;
}

/// Squared q: the Frobenius norm is below it because each column of the Jacobian is a blend of its
/// 4 edges, and a blend is no longer than the longest.
Float4 squared_contraction(const Edges& edges) {
  Float4 sum{};
  for (const auto& axis : edges) {
    Float4 longest{};
    for (const LaneVector& d : axis) longest = greatest(longest, dot(d, d));
    sum += longest;
  }
  return sum;
}

/// Smallest Bernstein coefficient of det(I + g D(x, y, z)) over the unit cell and g in [0, 1]; the
/// polynomial lies above it. Column a of D is bilinear in the two other coordinates, so the
/// determinant has degree 2 in each. Its 27 coefficients are means of the determinants of all
/// 64 choices of one edge per axis: those in which the same number of chosen edges lies on the
/// upper side of x, of y and of z. In g it is 1 + t g + m g^2 + d g^3, with four coefficients.
struct Least {
  Float4 bound;   ///< over all coefficients
  Float4 corner;  ///< over those that are values at corners and g = 1: the truth is not above
};

Least least_determinant(const Edges& d) {
  std::array<Float4, 27> t{}, m{}, det{};
  std::array<float, 27> count{};
  for (size_t y = 0; y < 4; ++y)
    for (size_t z = 0; z < 4; ++z) {
      const LaneVector &dy = d[1][y], &dz = d[2][z];
      const LaneVector normal = cross(dy, dz);
      const Float4 minor_yz = normal[0], trace_yz = dy[1] + dz[2];
      for (size_t x = 0; x < 4; ++x) {
        const LaneVector& dx = d[0][x];
        const size_t on_x = (y & 1) + (z & 1), on_y = (x & 1) + (z >> 1),
                     on_z = (x >> 1) + (y >> 1);
        const size_t group = on_x + 3 * on_y + 9 * on_z;
        t[group] += trace_yz + dx[0];
        m[group] += minor_yz + (dx[0] * dy[1] - dx[1] * dy[0]) + (dx[0] * dz[2] - dx[2] * dz[0]);
        det[group] += dot(dx, normal);
        count[group] += 1.0F;
      }
    }
  const Float4 one{1, 1, 1, 1};
  Least result{one, one};
  for (size_t group = 0; group < 27; ++group) {
    const float share = 1.0F / count[group];
    const Float4 tg = t[group] * share, mg = m[group] * share, dg = det[group] * share;
    const Float4 end = one + tg + mg + dg;
    const Float4 inner = least(one + tg * (1.0F / 3.0F), one + (2.0F * tg + mg) * (1.0F / 3.0F));
    result.bound = least(result.bound, least(inner, end));
    if (group % 3 != 1 && group / 3 % 3 != 1 && group / 9 != 1)
      result.corner = least(result.corner, end);
  }
  return result;
}

/// Four of the eight parts of one cell: those in the lower (half = 0) or upper half of z.
CellCorners parts_of(const CellCorners& corners, size_t lane, int half) {
  CellCorners parts;
  for (int c = 0; c < 8; ++c)
    for (size_t part = 0; part < 4; ++part) {
      const float x = 0.5F * float((c & 1) + int(part & 1));
      const float y = 0.5F * float((c >> 1 & 1) + int(part >> 1));
      const float z = 0.5F * float((c >> 2) + half);
      for (size_t ch = 0; ch < 3; ++ch) {
        float sum = 0.0F;
        for (int s = 0; s < 8; ++s)
          sum += (s & 1 ? x : 1 - x) * (s & 2 ? y : 1 - y) * (s & 4 ? z : 1 - z) *
                 corners.u[size_t(s)][ch][lane];
        parts.u[size_t(c)][ch][part] = sum;
      }
    }
  return parts;
}

/// The determinant bound of one cell after cutting it in eight.
float cut_bound(const CellCorners& corners, size_t lane, const CellShape& shape, int depth) {
  const CellShape part{0.5F * shape.edges, shape.axes};
  float worst = 1.0F;
  for (int half = 0; half < 2; ++half) {
    const CellCorners parts = parts_of(corners, lane, half);
    const Edges edges = edges_of(parts, part);
    const Least found = least_determinant(edges);
    for (size_t p = 0; p < 4; ++p) {
      float bound = found.bound[p];
      if (bound <= 0.0F && found.corner[p] > 0.0F && depth < kDeepestCut)
        bound = cut_bound(parts, p, part, depth + 1);
      worst = std::min(worst, bound);
    }
  }
  return worst;
}

}  // namespace

std::array<CellCertificate, 4> bounds(const CellCorners& corners, const CellShape& shape) noexcept {
  const Edges edges = edges_of(corners, shape);
  const Float4 squared = squared_contraction(edges);
  const Least found = least_determinant(edges);
  std::array<CellCertificate, 4> result;
  for (size_t lane = 0; lane < 4; ++lane) {
    const float q = std::sqrt(squared[lane]) * (1.0F + kRounding);
    float bound = found.bound[lane];
    if (bound <= 0.0F && found.corner[lane] > 0.0F) bound = cut_bound(corners, lane, shape, 1);
    const float reach = 1.0F + q;
    bound -= kRounding * reach * reach * reach;
    result[lane] = {q, bound};
  }
  return result;
}

}  // namespace palpate::certificate
