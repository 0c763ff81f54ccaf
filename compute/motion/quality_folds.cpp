#include "compute/motion/quality_folds.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "compute/volume/parallel.h"

namespace palpate {
namespace {

/// One row of vectors with separate components, so that the loops below become vector instructions.
struct Row {
  std::vector<float> x, y, z;
  explicit Row(int length) : x(size_t(length)), y(size_t(length)), z(size_t(length)) {}
};

/// edge = axis + (to - from) / h for a whole row.
void edges(const glm::vec3* from, const glm::vec3* to, glm::vec3 axis, float per_mm, Row& edge) {
  const size_t length = edge.x.size();
  float* x = edge.x.data();
  float* y = edge.y.data();
  float* z = edge.z.data();
  for (size_t i = 0; i < length; ++i) {
    x[i] = axis.x + per_mm * (to[i].x - from[i].x);
    y[i] = axis.y + per_mm * (to[i].y - from[i].y);
    z[i] = axis.z + per_mm * (to[i].z - from[i].z);
  }
}

/// least[i] = min(least[i], det[a b c](i)). A NaN counts as minus infinity.
void lower_to_det(const Row& a, const Row& b, const Row& c, float* __restrict least) {
  const float *ax = a.x.data(), *ay = a.y.data(), *az = a.z.data();
  const float *bx = b.x.data(), *by = b.y.data(), *bz = b.z.data();
  const float *cx = c.x.data(), *cy = c.y.data(), *cz = c.z.data();
  const size_t length = a.x.size();
  for (size_t i = 0; i < length; ++i) {
    const float det = ax[i] * (by[i] * cz[i] - bz[i] * cy[i]) +
                      ay[i] * (bz[i] * cx[i] - bx[i] * cz[i]) +
                      az[i] * (bx[i] * cy[i] - by[i] * cx[i]);
    const float known = det == det ? det : -std::numeric_limits<float>::infinity();
    least[i] = least[i] < known ? least[i] : known;
  }
}

void average(const Row& a, const Row& b, Row& mean) {
  const auto component = [](const std::vector<float>& p, const std::vector<float>& q,
                            std::vector<float>& m) {
    for (size_t i = 0; i < m.size(); ++i) m[i] = 0.5F * (p[i] + q[i]);
  };
  component(a.x, b.x, mean.x);
  component(a.y, b.y, mean.y);
  component(a.z, b.z, mean.z);
}

/// Counts of one thread. Squares are summed about zero, since log det is of order one.
struct Tally {
  size_t voxels = 0, folded = 0, not_finite = 0, logs = 0;
  double min_det = std::numeric_limits<double>::infinity();
  double sum = 0.0, squares = 0.0;

  void add(const Tally& other) {
    voxels += other.voxels;
    folded += other.folded;
    not_finite += other.not_finite;
    logs += other.logs;
    min_det = std::min(min_det, other.min_det);
    sum += other.sum;
    squares += other.squares;
  }
};

/// Works through rows of one field; owns the buffers of one thread.
class RowScan {
 public:
  RowScan(const Field& u, const Mask* mask)
      : u_(u),
        mask_(mask),
        nx_(u.grid.size.x),
        next_x_(nx_),
        previous_x_(nx_),
        next_y_(nx_),
        previous_y_(nx_),
        next_z_(nx_),
        previous_z_(nx_),
        mean_x_(nx_),
        mean_y_(nx_),
        mean_z_(nx_),
        least_(size_t(nx_)),
        central_(size_t(nx_)) {}

  void scan(int j, int k) {
    along_x(j, k);
    along(1, j, u_.grid.size.y, j, k, next_y_, previous_y_);
    along(2, k, u_.grid.size.z, j, k, next_z_, previous_z_);
    constexpr float kNoDet = std::numeric_limits<float>::infinity();
    std::fill(least_.begin(), least_.end(), kNoDet);
    for (const Row* x : {&next_x_, &previous_x_}) {
      for (const Row* y : {&next_y_, &previous_y_}) {
        for (const Row* z : {&next_z_, &previous_z_}) lower_to_det(*x, *y, *z, least_.data());
      }
    }
    average(next_x_, previous_x_, mean_x_);
    average(next_y_, previous_y_, mean_y_);
    average(next_z_, previous_z_, mean_z_);
    std::fill(central_.begin(), central_.end(), kNoDet);
    lower_to_det(mean_x_, mean_y_, mean_z_, central_.data());
    count(j, k);
  }

  const Tally& tally() const { return tally_; }

 private:
  const glm::vec3* row(int j, int k) const { return u_.u_mm.data() + u_.grid.offset(0, j, k); }

  void along_x(int j, int k) {
    const glm::vec3 axis(u_.grid.direction[0]);
    const float per_mm = float(1.0 / u_.grid.spacing_mm.x);
    const glm::vec3* u = row(j, k);
    const auto set = [&](Row& edge, int i, glm::vec3 value) {
      edge.x[size_t(i)] = value.x;
      edge.y[size_t(i)] = value.y;
      edge.z[size_t(i)] = value.z;
    };
    for (int i = 0; i + 1 < nx_; ++i) {
      const glm::vec3 edge = axis + per_mm * (u[i + 1] - u[i]);
      set(next_x_, i, edge);
      set(previous_x_, i + 1, edge);
    }
    set(next_x_, nx_ - 1, nx_ > 1 ? axis + per_mm * (u[nx_ - 1] - u[nx_ - 2]) : axis);
    set(previous_x_, 0, nx_ > 1 ? axis + per_mm * (u[1] - u[0]) : axis);
  }

  /// The edges to the next and the previous row along y or z; at the border the existing one is
  /// used for both.
  void along(int axis, int place, int size, int j, int k, Row& next, Row& previous) {
    const glm::vec3 unit(u_.grid.direction[axis]);
    const float per_mm = float(1.0 / u_.grid.spacing_mm[axis]);
    const glm::ivec2 step = axis == 1 ? glm::ivec2(1, 0) : glm::ivec2(0, 1);
    const int forward = place + 1 < size ? 1 : 0;
    const int backward = place > 0 ? 1 : 0;
    const glm::vec3* here = row(j, k);
    const glm::vec3* above = row(j + forward * step.x, k + forward * step.y);
    const glm::vec3* below = row(j - backward * step.x, k - backward * step.y);
    edges(forward ? here : below, forward ? above : here, unit, per_mm, next);
    edges(backward ? below : here, backward ? here : above, unit, per_mm, previous);
  }

  void count(int j, int k) {
    const size_t first = u_.grid.offset(0, j, k);
    for (size_t i = 0; i < size_t(nx_); ++i) {
      if (mask_ && !mask_->values[first + i]) continue;
      ++tally_.voxels;
      const glm::vec3& u = u_.u_mm[first + i];
      tally_.not_finite += !std::isfinite(u.x + u.y + u.z);
      tally_.folded += !(least_[i] > 0.0F);
      tally_.min_det = std::min(tally_.min_det, double(least_[i]));
      if (central_[i] > 0.0F && std::isfinite(central_[i])) {
        const double log_det = double(std::log(central_[i]));
        ++tally_.logs;
        tally_.sum += log_det;
        tally_.squares += log_det * log_det;
      }
    }
  }

  const Field& u_;
  const Mask* mask_;
  int nx_;
  Row next_x_, previous_x_, next_y_, previous_y_, next_z_, previous_z_, mean_x_, mean_y_, mean_z_;
  std::vector<float> least_, central_;
  Tally tally_;
};

}  // namespace

Folds folds(const Field& u, const Mask* mask) {
  assert(u.u_mm.size() == u.grid.count());
  assert(!mask || mask->grid.size == u.grid.size);
  Tally total;
  if (u.grid.count() > 0) {
    std::mutex guard;
    const double slice_cost = 60.0 * u.grid.size.x * u.grid.size.y;
    parallel_ranges(u.grid.size.z, slice_cost, [&](int begin, int end) {
      RowScan scan(u, mask);
      for (int k = begin; k < end; ++k) {
        for (int j = 0; j < u.grid.size.y; ++j) scan.scan(j, k);
      }
      const std::lock_guard<std::mutex> lock(guard);
      total.add(scan.tally());
    });
  }
  Folds result;
  result.voxels = total.voxels;
  result.folded = total.folded;
  result.not_finite = total.not_finite;
  if (total.voxels > 0) result.min_det = total.min_det;
  if (total.logs > 0) {
    const double mean = total.sum / double(total.logs);
    result.sd_log_det = std::sqrt(std::max(0.0, total.squares / double(total.logs) - mean * mean));
  }
  return result;
}

}  // namespace palpate
