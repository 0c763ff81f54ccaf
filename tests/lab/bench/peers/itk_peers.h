#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"

/// ITK's own registration filters on palpate's values: the peers with which palpate is compared.
/// Tests and benchmarks only. No ITK type is in the interface.
namespace palpate::peers {

enum class ItkMethod {
  kDemons,               ///< itk::DemonsRegistrationFilter: gradient of one image (Thirion)
  kSymmetricForces,      ///< itk::SymmetricForcesDemonsRegistrationFilter
  kFastSymmetricForces,  ///< itk::FastSymmetricForcesDemonsRegistrationFilter: additive ESM
  kDiffeomorphic,        ///< itk::DiffeomorphicDemonsRegistrationFilter: composed ESM
};

/// The image whose gradient the force uses; only for the two ESM methods and, as fixed or mapped
/// moving, for kDemons.
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

/// Registers moving to fixed with one of ITK's filters. Errors: no level, grids without a sample,
/// every exception of ITK. Not for two threads at once: ITK has one thread count per process.
Result<PeerResult> run_itk(const Volume& fixed, const Volume& moving, const PeerOptions& options);

/// The time of one iteration of plain itk::DemonsRegistrationFilter on one level, every voxel
/// computed.
struct ItkRate {
  double voxel_iterations_per_s = 0;
  double seconds_per_iteration = 0;
  double mean_square_first = 0;  ///< difference of the images before the first update
  /// The same after the last update: must be smaller, else nothing was registered.
  double mean_square_last = 0;
};

/// Runs `iterations` (at least 3) of plain Demons on a cube of size^3 voxels of 1 mm of synthetic
/// data, a blob that moves by two voxels in textured surroundings. It times them from the end of
/// the first iteration to the end of the last one.
Result<ItkRate> itk_demons_rate(int size, int iterations, double sigma_voxels, int threads);

}  // namespace palpate::peers
