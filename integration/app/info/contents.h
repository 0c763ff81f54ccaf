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

/// The values of one frame; of vectors their lengths, in the file's unit.
struct Values {
  float low = 0.0F, high = 0.0F;  ///< of those that are finite
  double mean = 0.0;              ///< likewise
  size_t count = 0, not_finite = 0;
  glm::ivec3 first_not_finite{0};  ///< its voxel
  std::vector<float> different;    ///< rising; empty if there are more than kMostLabels
  bool whole = true;               ///< all are whole numbers
  uint64_t hash = 0;               ///< of the values in their order

  static constexpr size_t kMostLabels = 32;
};

/// What one input of the program is. All that is not known stays empty.
struct Contents {
  std::filesystem::path path;
  std::string kind;    ///< one word for programs: volume, labels, sequence, vectors, scene, ...
  std::string what;    ///< the same for people: "a sequence of 8 frames"
  std::string format;  ///< "NRRD, 16-bit integers, packed"
  std::optional<Grid> grid;
  size_t frames = 0, components = 0;
  std::vector<double> times_s;  ///< one per frame, if the file says
  std::vector<Values> values;   ///< one per frame
  std::optional<Folds> folds;   ///< of vectors, taken for a displacement field
  double memory_bytes = 0.0;    ///< of all frames, as palpate keeps them
  /// Label and text of what else is to be said.
  std::vector<std::pair<std::string, std::string>> more;
  std::string use;                    ///< what palpate does with it
  std::vector<std::string> problems;  ///< what is suspicious, a sentence each
};

/// Called with the share of an image that is read, 0 to 1, on the reading thread.
using OnShare = std::function<void(double)>;

/// Reads the input whole: an image file, a folder of images or of DICOM slices, a scene, a
/// calibration, a recording, a table of points or ticks. Values that are not finite are counted,
/// not refused. kBadInput with a sentence if it can not be read. Any thread; memory of one frame,
/// or of one field.
Result<Contents> contents_of(const std::filesystem::path& path, const OnShare& on_share);

/// How two images lie to each other.
struct Together {
  bool same_grid = false;
  double overlap = 0.0;    ///< share of the first's volume that lies in the second's
  std::string difference;  ///< "a size of ... where frame 0 has ..."; empty on the same grid
};
Together together(const Grid& first, const Grid& other);

/// "L-P-S": to which side of the patient each axis leads, i first.
std::string axes_letters(const Grid& grid);
/// The angle between the grid's axes and the patient's, degrees, of the axis that is off most.
double oblique_degrees(const Grid& grid);

}  // namespace palpate::app
