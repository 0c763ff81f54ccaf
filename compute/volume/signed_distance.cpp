#include "compute/volume/signed_distance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "compute/volume/parallel.h"
#include "compute/volume/portable.h"
#include "compute/volume/sheet_distance.h"

namespace palpate {
namespace {

constexpr float kFarAway = std::numeric_limits<float>::infinity();

// SD of the Gaussian that removes the steps of the voxels, in edges of a (nearly isotropic) voxel.
constexpr double kSmooth = 1.5;
// A wall thinner than twice this many SDs of the Gaussian gets a narrower one: at this ratio the
// Gaussian of a tent moves the tent's foot by 0.03 SDs.
constexpr double kThin = 1.75;
// Samples around the mask: the reach of the Gaussian, and what a reader samples.
constexpr int kMargin = 7;
// Slices more than this times as far apart as the voxels in them are interpolated.
constexpr double kThick = 1.5;

/// The samples of a grid along one of its axes.
struct GridLines {
  GridLines(const Grid& grid, int axis)
      : length(grid.size[axis]),
        stride(axis == 0   ? 1
               : axis == 1 ? size_t(grid.size.x)
                           : size_t(grid.size.x) * size_t(grid.size.y)),
        inner(stride),
        count(int(grid.count() / size_t(length))) {}
  /// Offset of the first sample of line n.
  size_t start(int n) const {
    return size_t(n) / inner * inner * size_t(length) + size_t(n) % inner;
  }
  int length;
  size_t stride, inner;
  int count;
};

/// Calls work(values, buffer of the line's length) for all lines along an axis. The line's samples
/// are gathered in `buffer` and written back afterwards.
template <class Work>
void along(std::vector<float>& values, const Grid& grid, int axis, const Work& work) {
  const GridLines lines(grid, axis);
  parallel_ranges(lines.count, 20.0 * lines.length, [&](int begin, int end) {
    std::vector<float> line(size_t(lines.length));
    auto scratch = work.scratch(lines.length);
    for (int n = begin; n < end; ++n) {
      const size_t start = lines.start(n);
      for (int i = 0; i < lines.length; ++i)
        line[size_t(i)] = values[start + size_t(i) * lines.stride];
      work(line, scratch);
      for (int i = 0; i < lines.length; ++i)
        values[start + size_t(i) * lines.stride] = line[size_t(i)];
    }
  });
}

/// One axis of the distance transform: f(i) <- min over q of f(q) + (h max(0, |i - q| - 1/2))^2,
/// the squared distance to boxes of one voxel. The nearest edge of another voxel's box is midway
/// between samples, so this is the lower envelope (Felzenszwalb and Huttenlocher 2012) of parabolas
/// at these midpoints, each as high as the lower one of its two neighbours.
struct EnvelopeAlong {
  double h_mm;
  struct Scratch {
    std::vector<int> site;      ///< per parabola of the envelope: the sample before it
    std::vector<double> begin;  ///< where each of them begins to be the lowest
    std::vector<double> height;
  };
  Scratch scratch(int length) const {
    return {std::vector<int>(size_t(length)), std::vector<double>(size_t(length)),
            std::vector<double>(size_t(length))};
  }
  void operator()(std::vector<float>& f, Scratch& s) const {
    const int n = int(f.size());
    int parabolas = 0;
    for (int m = 0; m + 1 < n; ++m) {
      const float lower = std::min(f[size_t(m)], f[size_t(m) + 1]);
      if (lower == kFarAway) continue;
      // In units of the spacing.
      const double height = double(lower) / (h_mm * h_mm), at = m + 0.5;
      double begin = -std::numeric_limits<double>::infinity();
      while (parabolas > 0) {
        const size_t last = size_t(parabolas - 1);
        const double other = s.site[last] + 0.5;
        begin = 0.5 * (at + other + (height - s.height[last]) / (at - other));
        if (begin > s.begin[last]) break;
        --parabolas;
      }
      if (parabolas == 0) begin = -std::numeric_limits<double>::infinity();
      s.site[size_t(parabolas)] = m;
      s.height[size_t(parabolas)] = height;
      s.begin[size_t(parabolas)] = begin;
      ++parabolas;
    }
    int p = 0;
    for (int i = 0; i < n && parabolas > 0; ++i) {
      while (p + 1 < parabolas && s.begin[size_t(p) + 1] <= i) ++p;
      const double away = i - (s.site[size_t(p)] + 0.5);
      f[size_t(i)] =
          std::min(f[size_t(i)], float(h_mm * h_mm * (away * away + s.height[size_t(p)])));
    }
  }
};

/// A Gaussian along an axis, clamped to the edge.
struct GaussianAlong {
  explicit GaussianAlong(double sigma_samples) {
    const int radius = int(std::ceil(3.5 * sigma_samples));
    double sum = 0.0;
    for (int i = 0; i <= radius; ++i) {
      weight.push_back(portable::exp(-0.5 * i * i / (sigma_samples * sigma_samples)));
      sum += (i ? 2.0 : 1.0) * weight.back();
    }
    for (double& w : weight) w /= sum;
  }
  std::vector<float> scratch(int length) const { return std::vector<float>(size_t(length)); }
  void operator()(std::vector<float>& line, std::vector<float>& from) const {
    from = line;
    const int last = int(line.size()) - 1;
    for (int i = 0; i <= last; ++i) {
      double sum = weight[0] * from[size_t(i)];
      for (int d = 1; d < int(weight.size()); ++d)
        sum += weight[size_t(d)] *
               (from[size_t(std::max(i - d, 0))] + from[size_t(std::min(i + d, last))]);
      line[size_t(i)] = float(sum);
    }
  }
  std::vector<double> weight;
};

/// The largest value among the neighbouring samples along an axis.
struct LargestAlong {
  int reach;
  std::vector<float> scratch(int length) const { return std::vector<float>(size_t(length)); }
  void operator()(std::vector<float>& line, std::vector<float>& from) const {
    from = line;
    const int last = int(line.size()) - 1;
    for (int i = 0; i <= last; ++i)
      line[size_t(i)] = *std::max_element(from.begin() + std::max(i - reach, 0),
                                          from.begin() + std::min(i + reach, last) + 1);
  }
};

void smooth(std::vector<float>& values, const Grid& grid, double sigma_mm) {
  for (int axis = 0; axis < 3; ++axis)
    along(values, grid, axis, GaussianAlong(sigma_mm / grid.spacing_mm[axis]));
}

/// The share of `sigma_mm` by which a distance may be smoothed, 0 to 1: 1 unless the part inside,
/// or the gap outside, is so thin that its sides would merge. The thickness near a sample is
/// measured by how far the distance gets on either side of the border.
std::vector<float> smoothing_share(const Volume& distance, double sigma_mm) {
  const auto half_thickness = [&](float side) {
    std::vector<float> most = distance.values;
    for (float& d : most) d *= side;
    for (int axis = 0; axis < 3; ++axis) {
      const int reach = int(std::ceil(kThin * sigma_mm / distance.grid.spacing_mm[axis]));
      along(most, distance.grid, axis, LargestAlong{reach});
    }
    // Seen from the other side of the border it is farther away.
    for (size_t i = 0; i < most.size(); ++i) most[i] += std::max(0.0F, -side * distance.values[i]);
    return most;
  };
  std::vector<float> share = half_thickness(1.0F);
  const std::vector<float> outside = half_thickness(-1.0F);
  for (size_t i = 0; i < share.size(); ++i)
    share[i] = float(std::clamp(std::min(share[i], outside[i]) / (kThin * sigma_mm), 0.0, 1.0));
  // Without steps, but not larger where it is small: a sheet of one voxel would vanish.
  const std::vector<float> sharp = share;
  smooth(share, distance.grid, sigma_mm);
  for (size_t i = 0; i < share.size(); ++i) share[i] = std::min(share[i], sharp[i]);
  return share;
}

/// The signed distance to the border of the mask along the given axes only: all three, or those of
/// a slice. Infinite without a border.
std::vector<float> distance_along(const Mask& mask, std::array<bool, 3> axes) {
  const auto squared_to = [&](bool counting) {
    std::vector<float> f(mask.values.size());
    for (size_t i = 0; i < f.size(); ++i)
      f[i] = (mask.values[i] != 0) == counting ? 0.0F : kFarAway;
    for (int axis = 0; axis < 3; ++axis)
      if (axes[size_t(axis)]) along(f, mask.grid, axis, EnvelopeAlong{mask.grid.spacing_mm[axis]});
    return f;
  };
  std::vector<float> distance = squared_to(true);
  const std::vector<float> to_outside = squared_to(false);
  for (size_t i = 0; i < distance.size(); ++i)
    distance[i] = mask.values[i] ? std::sqrt(to_outside[i]) : -std::sqrt(distance[i]);
  return distance;
}

/// The part of a mask's grid that begins at `low`; it may extend beyond the mask, where nothing
/// counts.
Mask part_of(const Mask& mask, glm::ivec3 low, glm::ivec3 size) {
  Mask part{mask.grid, std::vector<uint8_t>(size_t(size.x) * size_t(size.y) * size_t(size.z))};
  part.grid.size = size;
  part.grid.origin_mm = mask.grid.lps_from_index(glm::dvec3(low));
  const glm::ivec3 from = glm::max(low, glm::ivec3(0));
  const glm::ivec3 to = glm::min(low + size, mask.grid.size);
  for (int k = from.z; k < to.z; ++k)
    for (int j = from.y; j < to.y; ++j)
      for (int i = from.x; i < to.x; ++i)
        part.values[part.grid.offset(i - low.x, j - low.y, k - low.z)] =
            mask.values[mask.grid.offset(i, j, k)];
  return part;
}

/// The first and last index of the voxels that count.
std::pair<glm::ivec3, glm::ivec3> bounds_of(const Mask& mask) {
  glm::ivec3 low = mask.grid.size, high(-1);
  for (int k = 0; k < mask.grid.size.z; ++k)
    for (int j = 0; j < mask.grid.size.y; ++j)
      for (int i = 0; i < mask.grid.size.x; ++i)
        if (mask.values[mask.grid.offset(i, j, k)]) {
          low = glm::min(low, glm::ivec3(i, j, k));
          high = glm::max(high, glm::ivec3(i, j, k));
        }
  return {low, high};
}

/// The number of steps into which the distance between slices is divided along the coarsest axis,
/// so that it is like the next finer one.
std::pair<int, int> thick_axis(const Grid& grid) {
  const glm::dvec3 h = grid.spacing_mm;
  const int axis = h.x > h.y ? (h.x > h.z ? 0 : 2) : (h.y > h.z ? 1 : 2);
  const double next = std::max(h[(axis + 1) % 3], h[(axis + 2) % 3]);
  return {axis, h[axis] > kThick * next ? int(std::lround(h[axis] / next)) : 1};
}

/// Inserts slices by shape: a voxel counts where the interpolated distances within the slices
/// (Catmull-Rom) are above 0. Each distance is clipped to the distance between slices, so a part
/// that ends in the next slice ends midway.
Mask with_slices_between(const Mask& mask, int axis, int steps) {
  const double h = mask.grid.spacing_mm[axis];
  std::array<bool, 3> in_slice{true, true, true};
  in_slice[size_t(axis)] = false;
  std::vector<float> distance = distance_along(mask, in_slice);
  for (float& d : distance) d = std::clamp(d, -float(h), float(h));
  Mask fine{mask.grid, {}};
  fine.grid.size[axis] = (mask.grid.size[axis] - 1) * steps + 1;
  fine.grid.spacing_mm[axis] = h / steps;
  fine.values.resize(fine.grid.count());
  const GridLines from(mask.grid, axis), to(fine.grid, axis);
  parallel_ranges(from.count, 20.0 * to.length, [&](int begin, int end) {
    for (int n = begin; n < end; ++n) {
      const float* const line = &distance[from.start(n)];
      const auto at = [&](int k) {
        return double(line[size_t(std::clamp(k, 0, from.length - 1)) * from.stride]);
      };
      for (int i = 0; i < to.length; ++i) {
        const int k = i / steps;
        const double t = double(i % steps) / steps;
        const double a = at(k - 1), b = at(k), c = at(k + 1), d = at(k + 2);
        const double between =
            b +
            0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)));
        fine.values[to.start(n) + size_t(i) * to.stride] = between > 0.0;
      }
    }
  });
  return fine;
}

}  // namespace

Volume smoothed(const Volume& volume, double sigma_mm) {
  Volume out = volume;
  if (sigma_mm > 0.0) smooth(out.values, out.grid, sigma_mm);
  return out;
}

Volume exact_signed_distance(const Mask& inside) {
  // With a layer around it in which nothing counts.
  const Mask around = part_of(inside, glm::ivec3(-1), inside.grid.size + 2);
  const std::vector<float> distance = distance_along(around, {true, true, true});
  Volume out{inside.grid, std::vector<float>(inside.grid.count())};
  for (int k = 0; k < out.grid.size.z; ++k)
    for (int j = 0; j < out.grid.size.y; ++j)
      for (int i = 0; i < out.grid.size.x; ++i)
        out.values[out.grid.offset(i, j, k)] = distance[around.grid.offset(i + 1, j + 1, k + 1)];
  return out;
}

Volume signed_distance(const Mask& inside) {
  const auto [low, high] = bounds_of(inside);
  assert(high.x >= low.x);
  const auto [axis, steps] = thick_axis(inside.grid);
  glm::ivec3 margin(kMargin);
  margin[axis] = (kMargin + steps - 1) / steps + 1;
  Mask mask = part_of(inside, low - margin, high - low + 1 + 2 * margin);
  if (steps > 1) mask = with_slices_between(mask, axis, steps);
  Volume out{mask.grid, distance_along(mask, {true, true, true})};
  const glm::dvec3 h = mask.grid.spacing_mm;
  const double sigma_mm = kSmooth * std::max({h.x, h.y, h.z});
  const std::vector<float> share = smoothing_share(out, sigma_mm);
  std::vector<float> half = out.values;
  smooth(half, out.grid, 0.5 * sigma_mm);
  std::vector<float> full = half;
  smooth(full, out.grid, std::sqrt(0.75) * sigma_mm);
  // A Gaussian between two widths is blended by variance from those on both sides.
  for (size_t i = 0; i < full.size(); ++i) {
    const float variance = share[i] * share[i];
    out.values[i] = variance < 0.25F ? std::lerp(out.values[i], half[i], 4.0F * variance)
                                     : std::lerp(half[i], full[i], (variance - 0.25F) / 0.75F);
  }
  return with_sheets(mask, std::move(out));
}

}  // namespace palpate
