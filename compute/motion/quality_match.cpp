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
/// Share of the blocks, the quietest, that measure how much of the structure is noise.
constexpr double kQuietShare = 0.1;
/// At least this share of the compared blocks is clear: with two different bodies nothing is
/// shared.
constexpr double kClearestShare = 0.1;
/// A block is textured only if its SD is above this share of its values, so that rounding does not
/// count as texture.
constexpr double kRounding = 1e-5;
/// What moving_share counts: noise may be the same in so many voxels (two along each axis),
/// and its mean square is taken so many times away before a step counts as motion.
constexpr double kVoxelsOfNoise = 8.0;
constexpr double kChance = 2.0;
constexpr double kMovingVoxels = 0.5;

/// Samples per block along each axis: about kBlockVoxels of the finest edge.
glm::ivec3 block_size(const Grid& grid) {
  glm::ivec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    const double samples = kBlockVoxels * grid.finest_mm() / grid.spacing_mm[axis];
    size[axis] = std::clamp(int(std::lround(samples)), 1, std::max(1, grid.size[axis]));
  }
  return size;
}

/// Continuous index in moving of the point x + u(x): affine in the index of x and in u.
class Partner {
 public:
  Partner(const Grid& fixed, const Grid& moving)
      : from_mm_(glm::transpose(moving.direction)), size_(moving.size) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int row = 0; row < 3; ++row) from_mm_[axis][row] /= moving.spacing_mm[row];
    }
    origin_ = moving.index_from_lps(fixed.origin_mm);
    for (int axis = 0; axis < 3; ++axis)
      step_[axis] = from_mm_ * (fixed.direction[axis] * fixed.spacing_mm[axis]);
  }
  glm::dvec3 still(int i, int j, int k) const {
    return origin_ + double(i) * step_[0] + double(j) * step_[1] + double(k) * step_[2];
  }
  glm::dvec3 moved(glm::dvec3 still, glm::dvec3 u_mm) const { return still + from_mm_ * u_mm; }
  bool inside(glm::dvec3 index) const {
    return glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5))) &&
           glm::all(glm::lessThanEqual(index, glm::dvec3(size_) - 0.5));
  }

 private:
  glm::dmat3 from_mm_, step_{0.0};
  glm::dvec3 origin_{0.0};
  glm::ivec3 size_;
};

/// First and second moments of two images over some voxels, about a value near them against
/// cancellation.
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

/// SD of a difference, collected block by block.
struct Difference {
  double n = 0.0, sum = 0.0, squares = 0.0;
  void add(double value) {
    n += 1.0;
    sum += value;
    squares += value * value;
  }
  void add(const Difference& other) {
    n += other.n;
    sum += other.sum;
    squares += other.squares;
  }
  double sd() const {
    return n > 0.0 ? std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) : 0.0;
  }
};

/// Measurements of one block.
struct Block {
  glm::ivec3 low{0}, high{0};
  bool counted = false, textured = false, textured_moving = false, compared = false;
  double voxels = 0.0, left = 0.0;
  double sd = 0.0;  ///< of F
  double before = 0.0, after = 0.0;
  /// Of the motion left: sum g g^T / q and sum r g / q.
  glm::dmat3 information{0.0};
  glm::dvec3 pull{0.0};
  Difference difference_before, difference_after;
};

/// Measures single blocks; one object per thread.
class BlockScan {
 public:
  BlockScan(const Volume& fixed, const Volume& moving, const Field& u, const Mask* mask,
            double noise_fixed, double noise_moving)
      : fixed_(fixed),
        moving_(moving),
        u_(u),
        mask_(mask),
        noise_fixed_(noise_fixed),
        noise_moving_(noise_moving),
        partner_(fixed.grid, moving.grid),
        same_frames_(same_geometry(fixed.grid, moving.grid)),
        fine_field_(same_geometry(fixed.grid, u.grid)) {}

  void look(Block& block) {
    Moments still;
    double all = 0.0;
    visit(block, [&](int i, int j, int k, size_t offset) {
      all += 1.0;
      if (mask_ && !mask_->values[offset]) return;
      const double f = double(fixed_.values[offset]);
      const double m = before_at(i, j, k, offset);
      if (still.n == 0.0) {
        still.about_f = f;
        still.about_g = m;
      }
      still.add(f, m);
    });
    block.counted = still.n > 0.0 && still.n >= 0.5 * all;
    if (!block.counted) return;
    block.voxels = still.n;
    block.sd = std::sqrt(still.variance_f());
    block.textured_moving = textured(still.variance_g(), noise_moving_, still.about_g);
    block.textured = textured(still.variance_f(), noise_fixed_, still.about_f);
    block.before = still.correlation();
    if (block.textured) compare(block, still);
  }

 private:
  template <class Visit>
  void visit(const Block& block, const Visit& visit) const {
    for (int k = block.low.z; k < block.high.z; ++k) {
      for (int j = block.low.y; j < block.high.y; ++j) {
        size_t offset = fixed_.grid.offset(block.low.x, j, k);
        for (int i = block.low.x; i < block.high.x; ++i) visit(i, j, k, offset++);
      }
    }
  }

  double before_at(int i, int j, int k, size_t offset) const {
    return same_frames_ ? double(moving_.values[offset]) : sample(moving_, partner_.still(i, j, k));
  }

  /// F against W in a textured block.
  void compare(Block& block, const Moments& still) {
    f_.clear();
    w_.clear();
    seen_.clear();
    Moments moved;
    moved.about_f = still.about_f;
    moved.about_g = still.about_g;
    visit(block, [&](int i, int j, int k, size_t offset) {
      const glm::dvec3 u_mm = fine_field_
                                  ? glm::dvec3(u_.u_mm[offset])
                                  : sample_at_lps(u_, fixed_.grid.lps_from_index({i, j, k}));
      const glm::dvec3 at = partner_.moved(partner_.still(i, j, k), u_mm);
      const double f = double(fixed_.values[offset]);
      const double w = sample(moving_, at);
      const bool counts = !mask_ || mask_->values[offset];
      const bool seen = counts && partner_.inside(at);
      f_.push_back(float(f));
      w_.push_back(float(w));
      seen_.push_back(seen);
      block.left += counts && !seen;
      if (counts) block.difference_before.add(f - before_at(i, j, k, offset));
      if (!seen) return;
      moved.add(f, w);
      block.difference_after.add(f - w);
    });
    // With more than half of the block gone a correlation means nothing.
    block.compared = block.left <= 0.5 * block.voxels;
    if (!block.compared) return;
    block.after = moved.correlation();
    add_motion_left(block, moved);
  }

  /// The sums of Match::motion_left_voxels over the voxels whose neighbours are all in the block.
  void add_motion_left(Block& block, const Moments& moved) const {
    // F and W are compared as they are without mean and contrast; their mean gradient is g.
    const glm::ivec3 size = block.high - block.low;
    const double sd_f = std::sqrt(moved.variance_f()), sd_w = std::sqrt(moved.variance_g());
    if (sd_f <= 0.0 || sd_w <= 0.0) return;
    const glm::ivec3 reach = glm::ivec3(glm::greaterThanEqual(size, glm::ivec3(3)));
    const int step[3] = {1, size.x, size.x * size.y};
    const double mean_f = moved.about_f + moved.f / moved.n;
    const double mean_w = moved.about_g + moved.g / moved.n;

    // Normal equations of the shift d that is left: r = g d.
    glm::dmat3 a(0.0);
    glm::dvec3 b(0.0), sum_g(0.0);
    double squares = 0.0, sum_r = 0.0, n = 0.0;
    for (int k = reach.z; k < size.z - reach.z; ++k) {
      for (int j = reach.y; j < size.y - reach.y; ++j) {
        for (int i = reach.x; i < size.x - reach.x; ++i) {
          const int at = i * step[0] + j * step[1] + k * step[2];
          if (!seen_[size_t(at)]) continue;
          glm::dvec3 g(0.0);
          bool whole = true;
          for (int axis = 0; axis < 3; ++axis) {
            if (!reach[axis]) continue;
            const auto next = size_t(at + step[axis]), previous = size_t(at - step[axis]);
            whole = whole && seen_[next] && seen_[previous];
            g[axis] = 0.25 * (double(f_[next] - f_[previous]) / sd_f +
                              double(w_[next] - w_[previous]) / sd_w);
          }
          if (!whole) continue;
          const double r =
              (double(f_[size_t(at)]) - mean_f) / sd_f - (double(w_[size_t(at)]) - mean_w) / sd_w;
          a += glm::outerProduct(g, g);
          b += r * g;
          sum_g += g;
          sum_r += r;
          squares += r * r;
          n += 1.0;
        }
      }
    }
    if (n == 0.0 || squares == 0.0) return;
    // Normalising has removed the mean of r, so that of g is removed, too.
    a -= glm::outerProduct(sum_g, sum_g) / n;
    b -= sum_r * sum_g / n;
    block.information = n / squares * a;
    block.pull = n / squares * b;
  }

  const Volume& fixed_;
  const Volume& moving_;
  const Field& u_;
  const Mask* mask_;
  const double noise_fixed_, noise_moving_;
  const Partner partner_;
  const bool same_frames_, fine_field_;
  std::vector<float> f_, w_;  // of one block, x fastest
  std::vector<uint8_t> seen_;
};

/// The value below which this share of the values lies; 0 without values.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The smallest SD of a clear block.
double clear_sd(const std::vector<Block>& blocks) {
  std::vector<double> all, unshared;
  for (const Block& block : blocks) {
    if (!block.compared) continue;
    all.push_back(block.sd);
    unshared.push_back(block.sd * std::sqrt(std::max(0.0, 1.0 - block.after * block.after)));
  }
  return std::min(kTexturedNoises * quantile(std::move(unshared), kQuietShare),
                  quantile(std::move(all), 1.0 - kClearestShare));
}

/// The motion that frames still show, by blocks and their clear neighbours.
class MotionLeft {
 public:
  MotionLeft(const std::vector<Block>& blocks, glm::ivec3 count, double least_sd)
      : blocks_(blocks), count_(count), least_sd_(least_sd) {}

  /// Match::motion_left_voxels and Match::moving_share.
  void measure(Match& match) const {
    double sum = 0.0, n = 0.0, shows = 0.0;
    glm::ivec3 b;
    for (b.z = 0; b.z < count_.z; ++b.z) {
      for (b.y = 0; b.y < count_.y; ++b.y) {
        for (b.x = 0; b.x < count_.x; ++b.x) {
          if (!clear(at(b))) continue;
          const Sums all = sums(b, glm::ivec3(1));
          sum += glm::length(glm::inverse(glm::dmat3(1.0) + all.information) * all.pull);
          n += 1.0;
          for (int axis = 0; axis < 3; ++axis) {
            glm::ivec3 reach(1);
            reach[axis] = 0;
            if (!beyond_chance(sums(b, reach))) continue;
            shows += 1.0;
            break;
          }
        }
      }
    }
    if (n == 0.0) return;
    match.motion_left_voxels = sum / n;
    match.moving_share = shows / n;
  }

 private:
  struct Sums {
    glm::dmat3 information{0.0};
    glm::dvec3 pull{0.0};
  };

  const Block& at(glm::ivec3 b) const {
    return blocks_[size_t(b.x) + size_t(count_.x) * (size_t(b.y) + size_t(count_.y) * size_t(b.z))];
  }
  bool clear(const Block& block) const { return block.compared && block.sd >= least_sd_; }

  Sums sums(glm::ivec3 b, glm::ivec3 reach) const {
    Sums result;
    const glm::ivec3 low = glm::max(b - reach, glm::ivec3(0)),
                     high = glm::min(b + reach + 1, count_);
    glm::ivec3 c;
    for (c.z = low.z; c.z < high.z; ++c.z)
      for (c.y = low.y; c.y < high.y; ++c.y)
        for (c.x = low.x; c.x < high.x; ++c.x) {
          if (!clear(at(c))) continue;
          result.information += at(c).information;
          result.pull += at(c).pull;
        }
    return result;
  }

  static bool beyond_chance(const Sums& sums) {
    const glm::dmat3 inverse = glm::inverse(glm::dmat3(kVoxelsOfNoise) + sums.information);
    const glm::dvec3 d = inverse * sums.pull;
    const glm::dmat3 noise = kVoxelsOfNoise * inverse * sums.information * inverse;
    const double variance = noise[0][0] + noise[1][1] + noise[2][2];
    return glm::dot(d, d) > kChance * variance + kMovingVoxels * kMovingVoxels;
  }

  const std::vector<Block>& blocks_;
  const glm::ivec3 count_;
  const double least_sd_;
};

Match summed_up(const std::vector<Block>& blocks, double least_sd) {
  Match match;

  // Counts over all blocks, sums over those that can be compared, correlations over the clear ones.
  Difference before, after;
  double left = 0.0, textured_voxels = 0.0;
  double sum_before = 0.0, sum_after = 0.0;
  size_t mismatched = 0;
  for (const Block& block : blocks) {
    match.blocks += block.counted;
    match.textured_moving += block.textured_moving;
    if (!block.textured) continue;
    ++match.textured;
    left += block.left;
    textured_voxels += block.voxels;
    if (!block.compared) continue;
    ++match.compared;
    before.add(block.difference_before);
    after.add(block.difference_after);
    if (!(block.sd >= least_sd)) continue;
    ++match.clear;
    sum_before += block.before;
    sum_after += block.after;
    mismatched += block.after < kMatched;
  }
  match.difference_sd_before = before.sd();
  match.difference_sd_after = after.sd();
  if (match.textured > 0) match.leaving = left / textured_voxels;
  // If nothing can be compared, everything counts as lost.
  if (match.clear == 0) return match;
  const auto clear = double(match.clear);
  match.correlation_before = sum_before / clear;
  match.correlation_after = sum_after / clear;
  match.mismatched = double(mismatched) / clear;
  return match;
}

}  // namespace

Volume warped(const Volume& moving, const Field& u, const Grid& onto) {
  const Field fine = resampled(u, onto);
  const Partner partner(onto, moving.grid);
  Volume result{onto, std::vector<float>(onto.count())};
  parallel_ranges(onto.size.z, 40.0 * onto.size.x * onto.size.y, [&](int first, int last) {
    for (int k = first; k < last; ++k)
      for (int j = 0; j < onto.size.y; ++j)
        for (int i = 0; i < onto.size.x; ++i) {
          const size_t offset = onto.offset(i, j, k);
          const glm::dvec3 at =
              partner.moved(partner.still(i, j, k), glm::dvec3(fine.u_mm[offset]));
          result.values[offset] = float(sample(moving, at));
        }
  });
  return result;
}

Result<Match> match(const Volume& fixed, const Volume& moving, const Field& u, const Mask* mask,
                    Mask* structure) {
  const Grid& grid = fixed.grid;
  if (mask && !same_geometry(mask->grid, grid)) {
    return Error{ErrorKind::kBadInput,
                 "The mask and the fixed frame lie on different grids; use a mask of the fixed "
                 "frame's grid."};
  }

  // 1. Every block of the image: texture, correlation before and after, motion that is left.
  const double noise_fixed = noise_sd(fixed), noise_moving = noise_sd(moving);
  const glm::ivec3 size = block_size(grid);
  const glm::ivec3 count = (grid.size + size - 1) / size;
  std::vector<Block> blocks(size_t(count.x) * size_t(count.y) * size_t(count.z));
  // Each task is a row of blocks.
  parallel_ranges(count.y * count.z, 40.0 * grid.size.x * size.y * size.z,
                  [&](int first, int last) {
                    BlockScan scan(fixed, moving, u, mask, noise_fixed, noise_moving);
                    for (int row = first; row < last; ++row) {
                      for (int i = 0; i < count.x; ++i) {
                        Block& block = blocks[size_t(row) * size_t(count.x) + size_t(i)];
                        block.low = glm::ivec3(i, row % count.y, row / count.y) * size;
                        block.high = glm::min(block.low + size, grid.size);
                        scan.look(block);
                      }
                    }
                  });

  // 2. Which blocks are clear, and the sums over those.
  const double least_sd = clear_sd(blocks);
  Match result = summed_up(blocks, least_sd);
  MotionLeft(blocks, count, least_sd).measure(result);
  result.noise_sd_fixed = noise_fixed;
  result.noise_sd_moving = noise_moving;
  if (result.blocks == 0) {
    return Error{ErrorKind::kBadInput,
                 "The mask is empty, so there is nothing to compare; check it."};
  }

  // 3. Where there is structure, as a mask.
  if (!structure) return result;
  *structure = {grid, std::vector<uint8_t>(grid.count())};
  for (const Block& block : blocks) {
    if (!block.compared || !(block.sd >= least_sd)) continue;
    for (int k = block.low.z; k < block.high.z; ++k)
      for (int j = block.low.y; j < block.high.y; ++j)
        for (int i = block.low.x; i < block.high.x; ++i) {
          const size_t offset = grid.offset(i, j, k);
          structure->values[offset] = !mask || mask->values[offset];
        }
  }
  return result;
}

}  // namespace palpate
