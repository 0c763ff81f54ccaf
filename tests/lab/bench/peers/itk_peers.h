#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// ITK's own registration filters, run on palpate's values: the peers that palpate is measured
/// against. Tests and benchmarks only. No ITK type is seen from outside.
namespace palpate::peers {

enum class ItkMethod {
  kDemons,               ///< itk::DemonsRegistrationFilter: gradient of one image (Thirion)
  kSymmetricForces,      ///< itk::SymmetricForcesDemonsRegistrationFilter
  kFastSymmetricForces,  ///< itk::FastSymmetricForcesDemonsRegistrationFilter: additive ESM
  kDiffeomorphic,        ///< itk::DiffeomorphicDemonsRegistrationFilter: composed ESM
};

/// Which image the force takes its gradient from; only the two ESM methods and, as fixed or mapped
/// moving, kDemons.
enum class ItkGradient { kSymmetric, kFixed, kWarpedMoving, kMappedMoving };

struct PeerOptions {
  ItkMethod method = ItkMethod::kDiffeomorphic;
  std::vector<unsigned> iterations = {50, 50, 30, 20};  ///< one per level, coarse to fine, factor 2
  double sigma_voxels = 2.0;     ///< Gauss over the field after each iteration, voxels of the level
  double max_step_voxels = 0.5;  ///< longest update of one iteration; ESM methods only
  ItkGradient gradient = ItkGradient::kSymmetric;
  int threads = 2;
};

struct PeerResult {
  Field field;         ///< mm, LPS, on the grid of the fixed image
  double seconds = 0;  ///< registration alone, pyramid included; no conversion, no files
};

/// Registers moving to fixed with one of ITK's filters. Errors: no level, grids that hold no
/// sample, whatever ITK throws. Not for two threads at once: ITK's thread count is one for the
/// process.
Result<PeerResult> run_itk(const Volume& fixed, const Volume& moving, const PeerOptions& options);

/// What one iteration of plain itk::DemonsRegistrationFilter costs on one level, every voxel
/// computed.
struct ItkRate {
  double voxel_iterations_per_s = 0;
  double seconds_per_iteration = 0;
  double mean_square_first = 0;  ///< difference of the images before the first update
  double mean_square_last = 0;   ///< and after the last: must be smaller, or nothing was registered
};

/// Runs `iterations` (at least 3) of plain Demons on a cube of size^3 voxels of synthetic data, 1
/// mm, a blob that moves by two voxels in a textured surround, and times them from the first
/// iteration's end to the last one's.
Result<ItkRate> itk_demons_rate(int size, int iterations, double sigma_voxels, int threads);

}  // namespace palpate::peers
