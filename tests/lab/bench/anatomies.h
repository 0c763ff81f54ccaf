#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

namespace palpate::bench {

/// A pair of one anatomy with known motion, and where to score.
struct KnownCase {
  Volume fixed, moving;
  /// mm, LPS; may be sampled more coarsely than fixed.
  Field truth;
  Mask mask;                   ///< on the grid of truth
  std::optional<Mask> border;  ///< the same about a sliding border, scored beside the mask
};

/// The source of a pair: it is read or made only when it is needed.
struct CaseSource {
  std::string anatomy;  ///< pairs of one anatomy are left out together
  std::string name;
  /// Throws Mismatch if there is none.
  std::function<KnownCase()> make;
};

/// All pairs with known motion: the kit (12 pairs of 6 anatomies), the lung, and synthetic pairs.
/// Folders of `data` that are missing give no pairs.
std::vector<CaseSource> known_cases(const std::filesystem::path& data);

/// Pairs of large motion, made of one image of each of the kit's anatomies and of the lung. The
/// material moves mostly along one axis, by the number of voxels of the finest axis at the end of
/// the name. It moves less and less towards one end and the sides ("fading"), or as a cylinder in
/// still material ("sliding", whose border is scored separately). Noise and gain differ between
/// pairs. Folders of `data` that are missing give no pairs.
std::vector<CaseSource> large_motion_cases(const std::filesystem::path& data);

/// The kit's pairs and the lung in other sizes, 22 to 256 voxels along a side, and shells of fine
/// voxels. "half_": each voxel is the mean of two along every axis. "twice_": interpolated by a
/// cubic, with as much white noise as the image has. The truth is the same in mm. Folders of `data`
/// that are missing give no pairs.
std::vector<CaseSource> sized_cases(const std::filesystem::path& data);

/// The value at a continuous index by Catmull-Rom's cubic, the border value clamped outside. Any
/// thread.
double cubic(const Volume& image, glm::dvec3 index);

/// Mean endpoint error at the truth's samples in a mask, mm. Throws Mismatch if the mask is empty.
double mean_error_mm(const Field& found, const KnownCase& pair, const Mask& mask);

}  // namespace palpate::bench
