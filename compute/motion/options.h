#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Settings of one level of the pyramid. Lengths are multiples of h, the level's voxel edge in mm.
struct LevelOptions {
  int iterations = 25;      ///< at most; convergence stops earlier
  int cell = 2;             ///< image voxels per field cell along each axis finer than 1.5 h
  double window = 3.0;      ///< Gaussian over the normal equations, SD in h
  double smoothness = 0.3;  ///< weight of the total variation, in h
  double second = 0.0;      ///< weight of the total variation of second derivatives, in h; 0: off
};

/// How the finest level yields, cell by cell, to motion that its wide window can not follow. rho is
/// what level 1 leaves unexplained: the squared difference of the normalised frames beyond noise,
/// divided by twice their variance plus `flat`. The share s of the narrow window rises smoothly
/// from 0 at rho = `low` to 1 at `high`; where s is 0 nothing changes
/// (shaders/motion/update_two.comp).
struct YieldOptions {
  /// SD of the narrow window, in h, whose step is added with the share s; 0: off
  double window = 0.0;
  double low = 0.02;      ///< rho at which s leaves 0
  double high = 0.06;     ///< rho at which s reaches 1
  double damping = 0.15;  ///< alpha where s is 1
  /// weight of the total variation where s is 1, in h; that of second derivatives does not grow
  double smoothness = 0.15;
  /// The weight of the total variation is halved where what a step explains is this many times its
  /// own noise.
  double evidence = 8.0;
  double noise = 2.0;  ///< factor on the difference that noise leaves (see noise_left())
  double flat = 0.3;   ///< keeps rho small where the frames show little structure
  /// After so many iterations it is measured which window predicts better what is left out of a fit
  /// (see PairSolver::iterate_and_choose()); where the narrow one does, its share rises from 0 to 1
  /// as its gain, relative to the structure, rises from gain_low to gain_high. 0: never
  int choose_after = 0;
  double gain_low = 0.0015, gain_high = 0.003;
};

/// The last step (compute/motion/sliding_borders.h): the result, on finer cells than were solved or
/// on the same, with the borders at which material slides. Intensities are scaled so that the range
/// from the 1st to the 99th percentile is 1.
struct SlidingOptions {
  int cell = 0;  ///< voxels per cell of the result along each axis finer than 1.5 h; 0: off
  /// share of cubic interpolation between the solved cells; the rest is linear
  double cubic = 0.85;
  /// intensity difference at which the cost is cut: all larger ones cost the same
  double limit = 0.12;
  /// A cell takes over another cell's motion if the mean squared difference falls by this share,
  /// and by this many times what noise explains.
  double share = 0.2;
  double noise = 0.25;
  /// Only from across a sliding border: where the motion differs by `apart`, in h, and by `slope`
  /// times the distance.
  double apart = 1.0, slope = 0.25;
};

/// The Demons method of the paper (kClassic), or palpate's own.
enum class MotionMethod { kPalpate, kClassic };

/// Settings of the estimation of a field. The presets are good defaults for all of them; change a
/// single number only for experiments.
struct MotionOptions {
  std::string preset = "balanced";
  MotionMethod method = MotionMethod::kPalpate;
  /// From the finest level (h = the image's finest voxel edge) to the coarsest; the last entry
  /// serves all coarser ones.
  std::vector<LevelOptions> levels;
  int finest_level = 0;   ///< 1 stops at twice the voxel edge, 2 at four times
  int coarse_levels = 0;  ///< number of levels; 0: until the coarsest image is about 24 voxels wide
  YieldOptions yield;     ///< of the finest level, if there are others
  SlidingOptions sliding;     ///< where the finest level is the image's own
  double damping = 0.1;       ///< alpha of the normal equations, per h; dimensionless
  double momentum = 0.7;      ///< share of the last change that is added before the next
  double largest_step = 1.0;  ///< of one update, in h
  /// differences of neighbours below this are smoothed, above kept as edges
  double huber_mm = 0.03;
  int filter_steps = 2;  ///< dual steps of the total variation filter per iteration, warm-started
  /// read half the voxels, by turns, in all but the first iteration of a level
  bool checkerboard = true;
  bool normalise = true;  ///< local normalisation of intensities; off for images of equal contrast
  double normalise_window = 2.9;  ///< SD of the window of local normalisation, in h
  /// floor f of local normalisation, in units of p99 - p1; 0: from the image's noise
  double noise = 0.0;
  /// bricks that move less than this (in h) per iteration rest; 0: none do
  double converged = 0.02;
  /// bricks with a smaller mean squared normalised intensity that stay in place rest
  double structure = 0.25;
  /// How far around a mask frames are prepared, so that the discrete start for large motion finds
  /// its partners there; 0: no discrete start. How far it looks says search_reach.
  double search_mm = 24.0;
  /// rho (see YieldOptions) of a level above which the discrete start looks further
  double search_above = 0.07;
  double search_reach = 4.0;      ///< how far it looks from the field there is, in the level's h
  double search_work = 1e7;       ///< voxels times labels that it may take on a level
  double min_determinant = 0.01;  ///< no voxel corner of the result has a smaller det(I + grad u)
  /// classic only: SD of the Gaussian over the field; 0: one voxel of the level
  double classic_sigma_mm = 0.0;
};

/// "fast", "balanced", "best" or "classic"; nothing for another name.
std::optional<MotionOptions> motion_preset(std::string_view name);

/// The same with the result on the solved cells: the step for sliding borders, if there is one,
/// chooses among their motions. For `fast`, and for sequences, of which every field is kept.
MotionOptions on_solved_cells(MotionOptions options);

/// The same without the step for sliding borders: for live frames, which are felt sooner so, and
/// for levels above the frames' own.
MotionOptions without_sliding_step(MotionOptions options);

/// Names of the presets, for messages.
inline constexpr std::array<std::string_view, 4> kMotionPresets = {"fast", "balanced", "best",
                                                                   "classic"};

}  // namespace palpate
