#include "module/scene/motion_map.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>

#include "compute/volume/parallel.h"
#include "compute/volume/volume.h"
#include "module/scene/cell_read.h"
#include "module/scene/certificate.h"
#include "module/scene/lanes.h"

namespace palpate {
namespace {

/// u in volume space (m) and confidence per sample. What can not be used is marked by a negative
/// confidence.
std::vector<glm::vec4> packed(const Field& field, const Confidence* confidence) {
  const Grid& grid = field.grid;
  std::vector<float> trust;
  if (confidence) {
    trust = resampled(*confidence, grid).values;
  }
  std::vector<glm::vec4> samples(grid.count());
  const double slice_cost = 10.0 * grid.size.x * grid.size.y;
  parallel_ranges(grid.size.z, slice_cost, [&](int begin, int end) {
    for (size_t s = grid.offset(0, 0, begin); s < grid.offset(0, 0, end); ++s) {
      const glm::vec3 u(volume_from_lps(glm::dvec3(field.u_mm[s])));
      const float reach = std::abs(u.x) + std::abs(u.y) + std::abs(u.z);
      const float w = confidence ? std::clamp(trust[s], 0.0F, 1.0F) : 1.0F;
      samples[s] = reach < kAbsurdM ? glm::vec4(u, w >= 0.0F ? w : 0.0F) : glm::vec4(0, 0, 0, -1);
    }
  });
  return samples;
}

/// Certificates of all cells of one field, the clamped border included.
class Certifier {
 public:
  Certifier(const std::vector<glm::vec4>& samples, const Grid& grid)
      : samples_(samples), size_(grid.size), cells_(grid.size + 1) {
    shape_.edges = glm::vec3(1e-3 * grid.spacing_mm);
    for (int a = 0; a < 3; ++a) {
      shape_.axes[a] = glm::vec3(glm::normalize(volume_from_lps(grid.direction[a])));
    }
    still_ = certificate::bounds({}, shape_);
  }

  /// The row of cells (., j, k), j and k counted from the clamped border.
  void row(int j, int k, CellCertificate* out) const {
    for (int first = 0; first < cells_.x; first += 4) {
      const int count = std::min(4, cells_.x - first);
      certificate::CellCorners corners;
      std::array<bool, 4> unknown{};
      bool moves = false;
      for (int lane = 0; lane < count; ++lane)
        unknown[size_t(lane)] = !gather(first + lane, j, k, size_t(lane), corners, moves);
      // Where nothing moves, as in most of a heart's box, all bounds are the same.
      const auto found = moves ? certificate::bounds(corners, shape_) : still_;
      for (int lane = 0; lane < count; ++lane) {
        constexpr float kInfinite = std::numeric_limits<float>::infinity();
        out[first + lane] =
            unknown[size_t(lane)] ? CellCertificate{kInfinite, -kInfinite} : found[size_t(lane)];
      }
    }
  }

 private:
  /// False if a corner is marked as unusable. `moves` is set if the corners move differently.
  bool gather(int i, int j, int k, size_t lane, certificate::CellCorners& corners,
              bool& moves) const {
    const glm::ivec3 cell(i, j, k);
    glm::vec4 base(0.0F);
    bool known = true;
    for (int c = 0; c < 8; ++c) {
      const glm::ivec3 corner(c & 1, c >> 1 & 1, c >> 2);
      const glm::ivec3 at = glm::clamp(cell - 1 + corner, glm::ivec3(0), size_ - 1);
      const glm::vec4& sample =
          samples_[size_t(at.x) +
                   size_t(size_.x) * (size_t(at.y) + size_t(size_.y) * size_t(at.z))];
      known = known && sample.w >= 0.0F;
      if (c == 0) base = sample;
      for (size_t ch = 0; ch < 3; ++ch) {
        const float u = sample[int(ch)] - base[int(ch)];
        corners.u[size_t(c)][ch][lane] = u;
        moves = moves || u != 0.0F;
      }
    }
    return known;
  }

  const std::vector<glm::vec4>& samples_;
  glm::ivec3 size_, cells_;
  certificate::CellShape shape_;
  std::array<CellCertificate, 4> still_;  ///< of cells whose corners move alike
};

}  // namespace

std::shared_ptr<const MotionMap> MotionMap::of(const Field& field, const Confidence* confidence) {
  assert(field.u_mm.size() == field.grid.count() && field.grid.count() > 0);
  std::shared_ptr<MotionMap> map(new MotionMap);
  map->place_ = GridPlace(field.grid);
  map->cell_m_ = 1e-3 * field.grid.finest_mm();
  map->samples_ = packed(field, confidence);

  const glm::ivec3 cells = field.grid.size + 1;
  map->cells_.resize(size_t(cells.x) * size_t(cells.y) * size_t(cells.z));
  const Certifier certifier(map->samples_, field.grid);
  std::mutex guard;
  parallel_ranges(cells.z, 500.0 * cells.x * cells.y, [&](int begin, int end) {
    float contraction = 0.0F, determinant = 1.0F;
    size_t folded = 0;
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < cells.y; ++j) {
        CellCertificate* out =
            map->cells_.data() + size_t(cells.x) * (size_t(j) + size_t(cells.y) * size_t(k));
        certifier.row(j, k, out);
        for (int i = 0; i < cells.x; ++i) {
          contraction = std::max(contraction, out[i].contraction);
          determinant = std::min(determinant, out[i].determinant);
          folded += out[i].determinant <= 0.0F;
        }
      }
    const std::lock_guard<std::mutex> lock(guard);
    map->worst_contraction_ = std::max(map->worst_contraction_, contraction);
    map->worst_determinant_ = std::min(map->worst_determinant_, determinant);
    map->folded_cells_ += folded;
  });
  size_t moving = 0;
  const glm::ivec3 size = field.grid.size;
  parallel_ranges(size.z, 10.0 * size.x * size.y, [&](int begin, int end) {
    double largest_m = 0.0;
    size_t of_these = 0;
    for (size_t s = field.grid.offset(0, 0, begin); s < field.grid.offset(0, 0, end); ++s) {
      glm::vec4& sample = map->samples_[s];
      sample.w = std::max(sample.w, 0.0F);
      const double u_m = glm::length(glm::dvec3(sample));
      largest_m = std::max(largest_m, u_m);
      of_these += u_m > 0.01 * map->cell_m_;
    }
    const std::lock_guard<std::mutex> lock(guard);
    map->largest_u_m_ = std::max(map->largest_u_m_, largest_m);
    moving += of_these;
  });
  map->moving_share_ = double(moving) / double(map->samples_.size());
  return map;
}

MotionSample MotionMap::sample(glm::dvec3 x_m) const noexcept {
  const auto corner = [this](size_t offset) { return lanes::load(samples_[offset]); };
  return CellRead(place_, x_m).value_and_jacobian(place_, corner);
}

glm::dvec3 MotionMap::displacement(glm::dvec3 x_m) const noexcept {
  const auto corner = [this](size_t offset) { return lanes::load(samples_[offset]); };
  return lanes::xyz(CellRead(place_, x_m).value(corner));
}

CellCertificate MotionMap::certificate(glm::dvec3 x_m) const noexcept {
  const glm::dvec3 index = place_.index(x_m);
  size_t offset = 0;
  for (int a = 2; a >= 0; --a) {
    const double last = double(place_.size[a]);
    // The border cell before the first sample is 0: adding 1 first makes the cut towards zero a
    // floor. In this order NaN becomes 0.
    const int cell = int(std::max(0.0, std::min(index[a] + 1.0, last)));
    offset = offset * size_t(place_.size[a] + 1) + size_t(cell);
  }
  return cells_[offset];
}

}  // namespace palpate
