#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compute/motion/quality_folds.h"
#include "compute/volume/grid.h"
#include "compute/volume/result.h"

namespace palpate::app {

/// The values of one frame, or the lengths of vectors, in the file's unit.
struct Values {
  float low = 0.0F, high = 0.0F;  ///< of the finite ones
  double mean = 0.0;              ///< likewise
  size_t count = 0, not_finite = 0;
  glm::ivec3 first_not_finite{0};  ///< its voxel
  /// distinct values, rising; empty if there are more than kMostLabels
  std::vector<float> different;
  bool whole = true;  ///< all values are integers
  uint64_t hash = 0;  ///< of the values in their order

  static constexpr size_t kMostLabels = 32;
};

/// What an input is. Unknown properties stay empty.
struct Contents {
  std::filesystem::path path;
  std::string kind;    ///< one word for programs: volume, labels, sequence, vectors, scene, ...
  std::string what;    ///< the same for people: "a sequence of 8 frames"
  std::string format;  ///< "NRRD, 16-bit integers, packed"
  std::optional<Grid> grid;
  size_t frames = 0, components = 0;
  std::vector<double> times_s;  ///< one per frame, if the file contains them
  std::vector<Values> values;   ///< one per frame
  std::optional<Folds> folds;   ///< of vectors, taken for a displacement field
  double memory_bytes = 0.0;    ///< of all frames, as palpate keeps them
  /// Label and text of further properties.
  std::vector<std::pair<std::string, std::string>> more;
  std::string use;                    ///< what palpate does with it
  std::vector<std::string> problems;  ///< suspicious findings, a sentence each
};

/// Called with the share of an image that is read, 0 to 1, on the reading thread.
using OnShare = std::function<void(double)>;

/// Reads the whole input: an image file, a folder of images or of DICOM slices, a scene, a
/// calibration, a recording, a table of points or ticks. Values that are not finite are counted,
/// not refused. Errors: kBadInput with a sentence if it can not be read. Any thread; takes the
/// memory of one frame or one field.
Result<Contents> contents_of(const std::filesystem::path& path, const OnShare& on_share);

/// The relative position of two images.
struct Together {
  bool same_grid = false;
  double overlap = 0.0;    ///< share of the first one's volume that lies in the second one
  std::string difference;  ///< "a size of ... where frame 0 has ..."; empty on the same grid
};
Together together(const Grid& first, const Grid& other);

/// "L-P-S": the direction of each axis in the patient, i first.
std::string axes_letters(const Grid& grid);
/// The largest angle between an axis of the grid and the patient's nearest one, degrees.
double oblique_degrees(const Grid& grid);

}  // namespace palpate::app
