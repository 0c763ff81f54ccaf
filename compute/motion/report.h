#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

/// Cost of one level, and why it ended.
struct LevelReport {
  double h_mm = 0.0;
  int iterations = 0;
  bool converged = false;  ///< ended because nothing moved any more, not at the limit of iterations
  double seconds = 0.0;
  double brick_iterations = 0.0;  ///< bricks of the field computed, summed over iterations
  double searched = 0.0;          ///< nodes times labels of the discrete start before this level
  double search_seconds = 0.0;    ///< of the discrete start; included in `seconds`
  double all_brick_iterations = 0.0;  ///< brick_iterations if no brick had been left out
};

struct SolveReport {
  std::vector<LevelReport> levels;  ///< coarsest first
  double sliding_bricks = 0.0;      ///< share of bricks in which sliding borders were searched
  int repaired = 0;                 ///< rounds of fold repair
  size_t folded_cells = 0;          ///< after the repair: 0 unless it failed
  /// Ended without a field because something moved further than the moving frame was prepared.
  /// Never true in a report that an estimator delivers: it prepares a larger region and solves
  /// again.
  bool out_of_reach = false;
  double seconds = 0.0;           ///< from images on the device to the field on the device
  double backward_seconds = 0.0;  ///< of the quick field from moving to fixed, if asked for
  double prepare_seconds = 0.0;   ///< upload, pyramid and normalisation of frames that were new
};

}  // namespace palpate
