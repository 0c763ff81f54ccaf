#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

/// The steps of the motion engine again, on the CPU, in double precision and written as their
/// equations. Each function has the name of the kernel that is compared with it
/// (shaders/motion/*.comp). Slow on purpose. Vectors are along the image axes, in mm; x fastest,
/// shape (z, y, x). All functions are pure: any thread, allocate, not real-time safe.
namespace palpate::oracle {

/// Samples on a grid, any type of value; integer indices are sample centres.
template <class T>
struct Samples {
  glm::ivec3 size{0};
  std::vector<T> values;

  Samples() = default;
  explicit Samples(glm::ivec3 samples, T value = T(0.0))
      : size(samples), values(size_t(samples.x) * size_t(samples.y) * size_t(samples.z), value) {}

  size_t offset(glm::ivec3 i) const {
    return size_t(i.x) + size_t(size.x) * (size_t(i.y) + size_t(size.y) * size_t(i.z));
  }
  T& at(glm::ivec3 i) { return values[offset(i)]; }
  const T& at(glm::ivec3 i) const { return values[offset(i)]; }
  /// The border value is clamped outside.
  const T& held(glm::ivec3 i) const { return at(glm::clamp(i, glm::ivec3(0), size - 1)); }
};

using Scalars = Samples<double>;
using Vectors = Samples<glm::dvec3>;
using Texels = Samples<glm::dvec4>;

/// Calls visit(index) for every sample of a grid, x fastest.
template <class Visit>
void for_each(glm::ivec3 size, const Visit& visit) {
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) visit(glm::ivec3(x, y, z));
}

/// The eight samples around a continuous index and their trilinear weights.
struct Tap {
  glm::ivec3 index;
  double weight;
};
std::array<Tap, 8> trilinear_taps(glm::dvec3 index);

/// The trilinear value at a continuous index, border clamped. Samples of weight 0 take no part, so
/// they may be infinite.
template <class T>
T sample(const Samples<T>& from, glm::dvec3 index) {
  T sum(0.0);
  for (const Tap& tap : trilinear_taps(index)) {
    if (tap.weight > 0.0) sum += tap.weight * from.held(tap.index);
  }
  return sum;
}

/// Number of cells of `cell` samples that cover `size` samples, per axis.
glm::ivec3 cells_of(glm::ivec3 size, glm::ivec3 cell);

/// The index in a grid of cells of the centre of sample `i` of the grid that the cells cover.
glm::dvec3 cell_index(glm::dvec3 i, glm::ivec3 cell);

// Images.

/// The gradient of a voxel outside the mask, along all axes. Its intensity is unchanged.
inline constexpr double kOutside = std::numeric_limits<double>::infinity();

/// coarse(i) = sum_k w_k fine(2 i + k), k = -1 .. 2, w = (1 3 3 1) / 8 along axes of ratio 2; axes
/// of ratio 1 are kept.
Scalars downsample(const Scalars& fine, glm::ivec3 ratio);

/// Mean of I and of I^2 over the samples of each cell that are inside the image.
Texels moments(const Scalars& image, glm::ivec3 cell);

/// The Gaussian of `sigma` samples along one axis: weights exp(-k^2 / 2 sigma^2) for |k| <= 3 sigma
/// (and at most shaders::kMaxRadius), normalised to 1; no filter below 0.3 samples. Border clamped.
Texels gauss(const Texels& image, int axis, double sigma);
/// The same along all three axes.
Texels gauss(const Texels& image, glm::dvec3 sigma);

/// (I - m) / sqrt(v + f^2) with the local mean m and variance v >= 0 from smoothed moments, read
/// trilinearly.
Scalars normalise(const Scalars& image, const Texels& moments, glm::ivec3 cell, double noise_sd);

/// (gx gy gz I): central differences in 1/mm, border clamped, within +- shaders::kLargestGradient;
/// kOutside where the mask (may be null) is 0 and, without `outermost_count`, in the first and last
/// voxel along each axis of at least shaders::kLeastForOutermost voxels.
Texels pack(const Scalars& image, glm::dvec3 spacing_mm, const Scalars* mask,
            bool outermost_count = true);

/// False for a packed texel that is marked as outside the mask.
bool inside_mask(const glm::dvec4& texel);

// One iteration.

/// The normal equations of one cell: means over all voxels of the cell, in which a voxel that does
/// not count is 0.
struct NormalEquations {
  glm::dvec3 b{0.0};      ///< mean of r g, 1/mm
  glm::dmat3 a{0.0};      ///< mean of g g^T, 1/mm^2
  double residual{0.0};   ///< mean of r^2
  double counted{0.0};    ///< share of the cell's voxels that counted
  double structure{0.0};  ///< mean of (F^2 + M^2) / 2

  explicit NormalEquations(double = 0.0) {}
};

/// r = F(x) - M(x + u), g = (grad F(x) + grad M(x + u)) / 2 for every voxel x of the cell, u and M
/// trilinear. fixed and moving are packed (see pack). g = grad F(x) alone where the partner x + u
/// touches a sample outside the mask. (On a device, a sample touched with weight 0 may be enough.)
/// A voxel counts if it is in the image and in the mask and its partner is at most half a voxel
/// outside the moving image.
/// colour 0 or 1: only voxels with (x + y + z + colour) even, for twice the weight; -1: all.
Samples<NormalEquations> normal_equations(const Texels& fixed, const Texels& moving,
                                          const Vectors& field, glm::ivec3 cell,
                                          glm::dvec3 spacing_mm, int colour = -1);

/// w(x) = v(x + d) + d, d = (A + damping I)^-1 b shortened to `largest_mm`.
Vectors update(const Samples<NormalEquations>& equations, const Vectors& v, glm::dvec3 cell_mm,
               double damping_per_mm2, double largest_mm);

/// Parameters of the step of two windows, and of the weight of the total variation that follows
/// from it.
struct TwoWindows {
  double damping_per_mm2[2]{};  ///< where the share s is 0, and where it is 1
  double largest_mm = 0.0;
  double low = 0.0, high = 0.0;  ///< rho at which s leaves 0 and reaches 1
  double noise = 0.0;            ///< W, r^2 that noise leaves where it is flat
  double flat = 0.0;
  double weight = 0.0;    ///< of the total variation where s is 1, as a multiple
  double evidence = 0.0;  ///< T at which that is halved
  double voxels = 0.0;    ///< N, what the narrow window averages
};
struct TwoWindowsStep {
  Vectors w;
  Scalars more;  ///< weight of the total variation to add, as a share
};

/// d = d_w + s (A_n + l)^-1 (b_n - A_n d_w), d_w = (A_w + l)^-1 b_w, both shortened, composed as in
/// update(). s = smoothstep(low, high, rho) and l follow from what the coarser level left,
///   rho = max(0, r^2 - W (counted - q)) / (2 q + flat counted),
/// and more = s (weight / (1 + T / evidence) - 1) from T = N g / (r_n^2 - g) with
/// g = b_n . (A_n + l)^-1 b_n. chosen: null, or shares of the narrow window; its step is then added
/// with the larger one of s and the share, which falls near folding as s does, and where few voxels
/// under the narrow window count.
TwoWindowsStep update_two(const Samples<NormalEquations>& wide,
                          const Samples<NormalEquations>& narrow,
                          const Samples<NormalEquations>& coarser, const Vectors& v,
                          glm::dvec3 cell_mm, const TwoWindows& with,
                          const Scalars* chosen = nullptr);

/// Whether a cell belongs to a part, 0 or 1: blocks of 2 x 2 x 2 cells in turns along every axis.
bool is_left_out(glm::ivec3 cell, int part);

/// The equations, zero at the cells of the part.
Samples<NormalEquations> leave_out(const Samples<NormalEquations>& equations, int part);

/// k = N w |b|^2 / (r^2 tr A), q / w, u = r^2 / (2 q) and w, N the voxels of the cell.
glm::dvec4 shared_noise(const NormalEquations& equations, double voxels);

/// v + d, d = (A + damping)^-1 (b - A (v - u0)), shortened.
Vectors refit(const Samples<NormalEquations>& equations, const Vectors& v, const Vectors& u0,
              double damping_per_mm2, double largest_mm);

/// d . A d - 2 b . d of d = u - u0 at the cells of the part, 0 elsewhere.
Scalars left_out_error(const Samples<NormalEquations>& equations, const Vectors& u,
                       const Vectors& u0, int part);

/// smoothstep(low, high, -gain / structure).
double window_share(double gain, double structure, double low, double high);

/// Dual variable of the total variation: p_x, p_y, p_z. On the last cell of axis a, p_a is 0.
using Dual = std::array<Vectors, 3>;

/// u = w + div p, (div p)(i) = sum_a s_a (p_a(i) - p_a(i - e_a)).
Vectors tv_primal(const Vectors& w, const Dual& p, glm::dvec3 slope);

/// v = u + momentum (u - before).
Vectors ahead(const Vectors& u, const Vectors& before, double momentum);

/// p <- P((p + t D u) / (1 + t e / c)), P the projection onto the ball of radius c, over the nine
/// numbers of a cell together; (D u)_a(i) = s_a (u(i + e_a) - u(i)), 0 on the last cell. more:
/// null, or the amount to add to c of a cell, as a fraction of c: the mean over the cell and the
/// next one along each axis, border clamped; a thousandth of c always remains.
Dual tv_dual(const Vectors& u, const Dual& p, glm::dvec3 slope, double c_mm, double step,
             double huber_mm, const Scalars* more = nullptr);

/// Dual variable of the total variation of second derivatives: q_xx, q_yy, q_zz, q_xy, q_xz, q_yz.
/// 0 in cells whose difference would need a cell that does not exist.
using SecondDual = std::array<Vectors, 6>;

/// w - D2^T q with (D2 u)_aa(i) = s_a^2 (u(i - e_a) - 2 u(i) + u(i + e_a)) and, for a < b,
/// (D2 u)_ab(i) = sqrt(2) s_a s_b (u(i) - u(i + e_a) - u(i + e_b) + u(i + e_a + e_b)).
Vectors tv_second_primal(const Vectors& w, const SecondDual& q, glm::dvec3 slope);

/// q <- P((q + t D2 u) / (1 + t e / c)), P the projection onto the ball of radius c, over the 18
/// numbers of a cell together. more: as in tv_dual(), but it only reduces the weight.
SecondDual tv_second_dual(const Vectors& u, const SecondDual& q, glm::dvec3 slope, double c_mm,
                          double step, double huber_mm, const Scalars* more = nullptr);

// Fields.

/// to(i) = from(scale i + offset), trilinear, border clamped.
Vectors upsample(const Vectors& from, glm::ivec3 to_cells, glm::dvec3 scale, glm::dvec3 offset);

/// Per brick of shaders::kBrick^3 cells: x = the largest |u - seen| in units of `unit_mm`, y = the
/// largest structure / counted among cells of which at least a hundredth counted, z = the largest
/// |u| in units of `unit_mm`.
Vectors measure(const Vectors& field, const Vectors& seen,
                const Samples<NormalEquations>& equations, double unit_mm);

/// The difference that a coarser level left unexplained in a cell: max(0, r^2 - W (counted - q)) /
/// (2 q + flat counted), W = noise.
double left_over(const NormalEquations& left, double noise, double flat);

/// Parameters of the deviation, beside the equations and the field.
struct Judging {
  double voxels = 1.0;  ///< N, what the window averages
  double h_mm = 1.0;
  glm::dvec3 spacing_mm{1.0}, cell_mm{1.0};
};

/// The deviation of the field, along (x) and across (y) the image gradient, mm, and the confidence
/// (z), 0 to 1, from its normal equations under the narrow window.
///   SD^2(l) = min(r^2 / (N l h^2), kUnknown), l: an eigenvalue of A without the gradients that
///             noise of r^2 alone would give; an axis of one cell is as certain as all others
///   rest = min(|(A + (kRestDamping / h)^2)^-1 b| / h, 1)
///   g = the largest difference to one of the six neighbours per mm
///   base = h (rest + kRest)^0.4 (g + kSteep)^0.8 / clamp(counted, kLeastShare, 1)
///   along = kAlong base (SD^2(largest l) + kCertain)^(1/4)
///   across = kAcross base (SD^2(smallest l) + kCertain)^(1/4)
///   both at least kGuess h sqrt(SD^2(largest l) / kUnknown)
///   radius = kErrorRadius sqrt(along^2 + 2 across^2)
///   confidence = 1 / (1 + (2 radius / h)^kErrorTail / 19)
/// Where less than a hundredth of the cell counted: confidence 0, rest 1, SD^2 kUnknown.
Vectors deviation(const Samples<NormalEquations>& equations, const Vectors& field,
                  const Judging& with);

/// Per cell the smallest det(I + grad u) at any of the 8 corners of the unit cubes of voxels whose
/// lowest voxel is in the cell, with the cube's three edges at the corner as differences. And at
/// the cell's middle the same with cubes of cells; 1 where there is no cube. Without `between` at
/// the middles only. Along an axis of one voxel u is constant. The cell folds if the determinant is
/// at most the limit.
Scalars folds(const Vectors& field, glm::ivec3 cell, glm::ivec3 image_size, glm::dvec3 spacing_mm,
              bool between);

/// Cells with a flagged cell at a distance of at most 1 get (1 2 1)/4 along each axis of the field,
/// the others keep it.
Vectors blend(const Scalars& flags, const Vectors& field);

/// Like blend(), but only along the field's jump: u / 2 + (u(i - d) + u(i + d)) / 4, d as long as
/// `length` cells along its longest axis, along the largest difference to one of the six
/// neighbours.
Vectors blend_along(const Scalars& flags, const Vectors& field, glm::dvec3 cell_mm, int length);
/// The sum of the distances of u(i + m) to u(i) and its six neighbours', for m = 0 and the six unit
/// steps +x +y +z -x -y -z: the cell's vector median has the least.
std::array<double, 7> distances_around(const Vectors& field, glm::ivec3 i);
/// Whether any cell within 1 of i is flagged.
bool touches(const Scalars& flags, glm::ivec3 i);

/// from(scale i + offset): Catmull and Rom's cubic along each axis, weighted by `cubic`, plus the
/// linear interpolation with the remaining weight; border clamped.
Vectors upsample_cubic(const Vectors& from, glm::ivec3 to_cells, glm::dvec3 scale,
                       glm::dvec3 offset, double cubic);

// The step for sliding borders.

/// The offset in cells from a cell to candidate number `candidate`: the distance changes fastest,
/// then the axis, then the side (positive first).
glm::ivec3 candidate_offset(int candidate, glm::ivec3 step);

/// Per cell the means of F, M(x + u), F^2 and F M(x + u) over every second voxel along each axis,
/// beginning with the cell's second one (or its only one). M = F where the partner is more than
/// half a voxel outside or the packed texel is marked as outside the mask.
Texels sliding_moments(const Scalars& fixed, const Scalars& moving, const Texels& packed,
                       const Vectors& field, glm::ivec3 cell, glm::dvec3 spacing_mm);

/// Parameters of the comparison of intensities.
struct SlidingCost {
  glm::ivec3 cell{1};         ///< voxels per cell
  glm::ivec3 coarse_cell{1};  ///< voxels per cell of the moments
  glm::dvec3 spacing_mm{1.0};
  double limit = 1.0, noise = 0.0;
};
/// Mean over a cell's voxels of min(1, (a F + b - M(x + v))^2 / limit^2), v[cell] the motion that
/// is tried; 0 for voxels outside the mask or whose partner by `own` is outside, 1 for those whose
/// partner by v is outside. a = (E[FM] - E[F]E[M] + noise^2) / (E[F^2] - E[F]^2 + noise^2), b =
/// E[M] - a E[F], from moments read trilinearly at the cell's middle.
Scalars sliding_cost(const Scalars& fixed, const Scalars& moving, const Texels& packed,
                     const Texels& moments, const Vectors& own, const Vectors& v,
                     const SlidingCost& with);

/// The condition of a border: motions that differ by `apart_mm` and by `slope` over their distance.
struct AcrossBorder {
  glm::ivec3 step{1};
  glm::dvec3 cell_mm{1.0};
  double apart_mm = 0.0, slope = 0.0;
};
/// Whether a cell has candidate `candidate`: inside the field and across a border.
bool has_candidate(const Vectors& field, glm::ivec3 cell, int candidate, const AcrossBorder& with);

// The discrete start. Labels are whole-voxel displacements from -reach to +reach, x fastest.

/// The displacement of label number `label`, voxels.
glm::ivec3 label_of(int label, glm::ivec3 reach);

/// cost[label](node) = mean over the node's voxels in the mask of
///   min(|F(x) - M(x + round(base(node)) + label)|, cut),
/// base in voxels; a partner outside the image costs the cut. 0 for a node without any voxel.
std::vector<Scalars> matching_cost(const Texels& fixed, const Texels& moving, const Vectors& base,
                                   glm::ivec3 cell, glm::ivec3 reach, double cut);

/// (1 2 1)/4 along one axis; clamped at the border and where a neighbour is not `listed` (above 0).
Scalars smooth_cost(const Scalars& cost, const Scalars& listed, int axis);

/// The minimum of a parabola through the costs of three neighbouring labels, from -1/2 to 1/2 of a
/// voxel from the middle one; 0 where the middle one is not the lowest.
double lowest_between(double before, double here, double after);

/// u + s (other - u), s = smoothstep(least, all, (r^2_now - r^2_then - 2 max(0, w_now - w_then)) /
/// (2 q_now + flat w_now)): of two fields the one with the smaller difference between the frames.
Vectors choose(const Samples<NormalEquations>& now, const Samples<NormalEquations>& then,
               const Vectors& u, const Vectors& other, double least, double all, double flat);

/// The cost of label `label` at node `node`, with a price on its distance from u (in voxels).
double coupled_cost(const std::vector<Scalars>& cost, int label, glm::ivec3 node, glm::ivec3 reach,
                    glm::dvec3 u_voxels, double price);

// The iteration of the classic method.

/// M - d g / (|g|^2 + d^2) per voxel, d = L1(x + M) - L0(x), g = grad L0, all in units of the
/// voxel. M is unchanged where both gradient and difference are zero, and outside the mask.
Vectors classic_force(const Texels& fixed, const Texels& moving, const Vectors& field,
                      glm::dvec3 spacing_mm);

}  // namespace palpate::oracle
