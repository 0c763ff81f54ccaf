#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/report/table.h"

namespace palpate::studies {

/// The error below which a vector counts as right, voxels of the finest axis: the confidence is the
/// probability of this.
constexpr double kRightVoxels = 0.5;

/// The calibration of confidence: of the voxels with confidence c, a share of c should be right.
/// Voxels are counted in ten bins of equal width over 0 to 1.
class Reliability {
 public:
  static constexpr size_t kBins = 10;
  struct Bin {
    double voxels = 0.0;
    double said = 0.0;   ///< sum of the confidences
    double right = 0.0;  ///< voxels whose error is at most kRightVoxels
  };

  /// weight: the number of voxels that this one represents. A confidence that is NaN counts as 0.
  void add(double confidence, bool right, double weight = 1.0);
  /// Adds another object's voxels, scaled to a total weight of 1, so that pairs have equal weight.
  void add_evenly(const Reliability& pair);

  const std::array<Bin, kBins>& bins() const { return bins_; }
  double voxels() const;
  double said() const;   ///< mean confidence; NaN without voxels
  double right() const;  ///< share of the voxels that are right; NaN without voxels
  /// Expected calibration error: the mean over the voxels of |mean confidence - share that is
  /// right| of their bin. NaN without voxels.
  double calibration_error() const;

 private:
  std::array<Bin, kBins> bins_{};
};

/// Counts the samples of the truth inside the mask (on any grid; null: all; an empty mask counts
/// none). right_mm: the error up to which a vector is right.
Reliability reliability_of(const Field& found, const Confidence& confidence, const Field& truth,
                           const Mask* mask, double right_mm);

/// How well the radii of 95 % that follow from the deviation are calibrated. Voxels of the finest
/// axis.
struct Radii {
  double said = 0.0;        ///< error_radius_mm() of all voxels that count
  double truth = 0.0;       ///< 95th percentile of the error
  double inside = 0.0;      ///< share of the voxels whose error is at most `said`
  double inside_own = 0.0;  ///< share of those whose error is at most their own radius
};

/// Of the samples of the truth that reliability_of() counts. Throws Mismatch if there are none.
Radii radii_of(const Field& found, const Deviation& deviation, const Field& truth, const Mask& mask,
               double voxel_mm);

/// A row for each pair.
report::Table radii_table(const std::vector<std::pair<std::string, Radii>>& all,
                          const std::string& title);

using NamedReliability = std::pair<std::string, Reliability>;

/// A row for each: mean confidence, share that is right, calibration error, and "share of the
/// voxels / share of them that is right" of each bin.
report::Table reliability_table(const std::vector<NamedReliability>& all, const std::string& title);

/// The reliability diagram: the share that is right over the mean confidence of each bin with at
/// least a two-hundredth of the voxels, and the diagonal of perfect calibration.
report::Chart reliability_chart(const std::vector<NamedReliability>& all, const std::string& title);

}  // namespace palpate::studies
