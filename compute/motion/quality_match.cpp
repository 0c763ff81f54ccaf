#include "compute/motion/quality_match.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

constexpr double kBlockVoxels = 7.0;
constexpr double kTexturedNoises = 3.0;
constexpr double kMatched = 0.5;
/// A block is textured only if its SD is also above this share of its values: rounding is not
/// texture.
constexpr double kRounding = 1e-5;

/// Samples per block along each axis: about kBlockVoxels of the finest edge.
glm::ivec3 block_size(const Grid& grid) {
  glm::ivec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    const double samples = kBlockVoxels * grid.finest_mm() / grid.spacing_mm[axis];
    size[axis] = std::clamp(int(std::lround(samples)), 1, std::max(1, grid.size[axis]));
  }
  return size;
}

/// The slices [first, first + count) of a grid.
Grid slab(const Grid& grid, int first, int count) {
  Grid part = grid;
  part.size.z = count;
  part.origin_mm = grid.lps_from_index({0.0, 0.0, double(first)});
  return part;
}

struct Warp {
  Volume values;
  std::vector<uint8_t> inside;  ///< x + u(x) lies inside the moving volume
};

Warp warp(const Volume& moving, const Field& u, const Grid& onto) {
  const Field fine = resampled(u, onto);
  Warp result{{onto, std::vector<float>(onto.count())}, std::vector<uint8_t>(onto.count())};
  const glm::dvec3 end = glm::dvec3(moving.grid.size) - 0.5;
  parallel_ranges(onto.size.y, 40.0 * onto.size.x * onto.size.z, [&](int first, int last) {
    for (int k = 0; k < onto.size.z; ++k) {
      for (int j = first; j < last; ++j) {
        for (int i = 0; i < onto.size.x; ++i) {
          const size_t offset = onto.offset(i, j, k);
          const glm::dvec3 there_mm =
              onto.lps_from_index({i, j, k}) + glm::dvec3(fine.u_mm[offset]);
          const glm::dvec3 index = moving.grid.index_from_lps(there_mm);
          result.values.values[offset] = float(sample(moving, index));
          result.inside[offset] = glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
                                  glm::all(glm::lessThanEqual(index, end));
        }
      }
    }
  });
  return result;
}

/// First and second moments of two images over some voxels, about a value near them so that nothing
/// cancels.
struct Moments {
  double about_f = 0.0, about_g = 0.0;
  double n = 0.0, f = 0.0, g = 0.0, ff = 0.0, gg = 0.0, fg = 0.0;

  void add(double value_f, double value_g) {
    const double a = value_f - about_f;
    const double b = value_g - about_g;
    n += 1.0;
    f += a;
    g += b;
    ff += a * a;
    gg += b * b;
    fg += a * b;
  }
  double variance_f() const { return n > 0.0 ? std::max(0.0, ff / n - f * f / (n * n)) : 0.0; }
  double variance_g() const { return n > 0.0 ? std::max(0.0, gg / n - g * g / (n * n)) : 0.0; }
  /// 0 where one of the two is constant: a flat image matches nothing.
  double correlation() const {
    const double scale = std::sqrt(variance_f() * variance_g());
    const double flat =
        kRounding * kRounding * (std::abs(about_f) + 1e-30) * (std::abs(about_g) + 1e-30);
    if (n == 0.0 || scale <= flat) return 0.0;
    return std::clamp((fg / n - f * g / (n * n)) / scale, -1.0, 1.0);
  }
};

bool textured(double variance, double noise, double value) {
  const double limit = std::max(kTexturedNoises * noise, kRounding * std::abs(value));
  return variance > limit * limit;
}

/// SD of a difference, collected over the whole volume.
struct Difference {
  double n = 0.0, sum = 0.0, squares = 0.0;
  void add(double value) {
    n += 1.0;
    sum += value;
    squares += value * value;
  }
  double sd() const {
    return n > 0.0 ? std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) : 0.0;
  }
};

/// One layer of blocks: `depth` slices of fixed from `first`, and the moving frame on the same
/// samples.
struct Layer {
  const Volume& fixed;
  const Mask* mask;
  int first;
  Volume before;
  Warp after;
};

class Comparison {
 public:
  Comparison(double noise_fixed, double noise_moving) {
    match_.noise_sd_fixed = noise_fixed;
    match_.noise_sd_moving = noise_moving;
  }

  void add(const Layer& layer, glm::ivec3 block) {
    const glm::ivec3 size = layer.before.grid.size;
    for (int j = 0; j < size.y; j += block.y) {
      for (int i = 0; i < size.x; i += block.x) {
        add_block(layer, {i, j, 0}, glm::min(glm::ivec3(i, j, 0) + block, size));
      }
    }
  }

  Match result() {
    match_.difference_sd_before = before_.sd();
    match_.difference_sd_after = after_.sd();
    if (match_.textured > 0) match_.leaving = left_ / textured_voxels_;
    // With nothing left to compare everything counts as lost.
    match_.mismatched = 1.0;
    if (match_.compared > 0) {
      const double blocks = double(match_.compared);
      match_.correlation_before = sum_before_ / blocks;
      match_.correlation_after = sum_after_ / blocks;
      match_.mismatched = double(mismatched_) / blocks;
    }
    return match_;
  }

 private:
  void add_block(const Layer& layer, glm::ivec3 low, glm::ivec3 high) {
    const Grid& grid = layer.before.grid;
    const size_t first = layer.fixed.grid.offset(0, 0, layer.first);
    Moments still, moved;
    double voxels = 0.0;
    double left = 0.0;
    for (int k = low.z; k < high.z; ++k) {
      for (int j = low.y; j < high.y; ++j) {
        for (int i = low.x; i < high.x; ++i) {
          const size_t offset = grid.offset(i, j, k);
          voxels += 1.0;
          if (layer.mask && !layer.mask->values[first + offset]) continue;
          const double f = double(layer.fixed.values[first + offset]);
          const double m = double(layer.before.values[offset]);
          if (still.n == 0.0) {
            still.about_f = moved.about_f = f;
            still.about_g = moved.about_g = m;
          }
          still.add(f, m);
          before_.add(f - m);
          if (!layer.after.inside[offset]) {
            left += 1.0;
            continue;
          }
          const double w = double(layer.after.values.values[offset]);
          moved.add(f, w);
          after_.add(f - w);
        }
      }
    }
    if (still.n > 0.0 && still.n >= 0.5 * voxels) add_measures(still, moved, left);
  }

  void add_measures(const Moments& still, const Moments& moved, double left) {
    ++match_.blocks;
    match_.textured_moving += textured(still.variance_g(), match_.noise_sd_moving, still.about_g);
    if (!textured(still.variance_f(), match_.noise_sd_fixed, still.about_f)) return;
    ++match_.textured;
    left_ += left;
    textured_voxels_ += still.n;
    // Half of a block gone is no basis for a correlation any more.
    if (left > 0.5 * still.n) return;
    ++match_.compared;
    sum_before_ += still.correlation();
    sum_after_ += moved.correlation();
    mismatched_ += moved.correlation() < kMatched;
  }

  Match match_;
  Difference before_, after_;
  double sum_before_ = 0.0, sum_after_ = 0.0, left_ = 0.0, textured_voxels_ = 0.0;
  size_t mismatched_ = 0;
};

}  // namespace

Volume warped(const Volume& moving, const Field& u, const Grid& onto) {
  return warp(moving, u, onto).values;
}

Result<Match> match(const Volume& fixed, const Volume& moving, const Field& u, const Mask* mask) {
  const Grid& grid = fixed.grid;
  if (mask && !same_geometry(mask->grid, grid)) {
    return Error{ErrorKind::kBadInput,
                 "The mask and the fixed frame lie on different grids; use a mask of the fixed "
                 "frame's grid."};
  }
  Comparison comparison(noise_sd(fixed), noise_sd(moving));
  const glm::ivec3 block = block_size(grid);
  for (int first = 0; first < grid.size.z; first += block.z) {
    const Grid part = slab(grid, first, std::min(block.z, grid.size.z - first));
    comparison.add({fixed, mask, first, resampled(moving, part), warp(moving, u, part)}, block);
  }
  const Match result = comparison.result();
  if (result.blocks == 0) {
    return Error{ErrorKind::kBadInput,
                 "The mask is empty, so there is nothing to compare; check it."};
  }
  return result;
}

Mask textured_voxels(const Volume& volume) {
  const Grid& grid = volume.grid;
  const glm::ivec3 block = block_size(grid);
  const double noise = noise_sd(volume);
  Mask mask{grid, std::vector<uint8_t>(grid.count())};
  const auto for_block = [&](glm::ivec3 low, const auto& visit) {
    const glm::ivec3 high = glm::min(low + block, grid.size);
    for (int k = low.z; k < high.z; ++k)
      for (int j = low.y; j < high.y; ++j)
        for (int i = low.x; i < high.x; ++i) visit(grid.offset(i, j, k));
  };
  for (int k = 0; k < grid.size.z; k += block.z) {
    for (int j = 0; j < grid.size.y; j += block.y) {
      for (int i = 0; i < grid.size.x; i += block.x) {
        Moments moments;
        moments.about_f = double(volume.at(i, j, k));
        for_block({i, j, k}, [&](size_t n) { moments.add(double(volume.values[n]), 0.0); });
        if (!textured(moments.variance_f(), noise, moments.about_f)) continue;
        for_block({i, j, k}, [&](size_t n) { mask.values[n] = 1; });
      }
    }
  }
  return mask;
}

}  // namespace palpate
