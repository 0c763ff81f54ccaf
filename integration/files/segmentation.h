#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "compute/volume/volume.h"

namespace palpate::files {

/// One part that a segmentation marks out.
struct LabelledPart {
  std::string name;        ///< as the file says, or "label 3"
  glm::vec3 colour{1.0F};  ///< red, green, blue, 0 to 1; as the file says, or one of its own
  int32_t label = 0;       ///< the value of its samples
  size_t layer = 0;        ///< of Segmentation::layers
};

/// The parts at one time, as samples with whole numbers. Parts that overlap lie in several layers,
/// on one grid.
struct Segmentation {
  std::filesystem::path file;
  Grid grid;
  std::vector<std::vector<int32_t>> layers;  ///< shape (nz, ny, nx) each
  std::vector<LabelledPart> parts;  ///< that have samples, in the file's order; at least one

  /// The samples of all parts that are meant by one of `labels`: a part's name, or its value as a
  /// decimal number. kBadInput in one sentence that says which parts there are if one means none.
  Result<Mask> mask(const std::vector<std::string>& labels) const;
  /// The colour of the first part that is meant; white if none is.
  glm::vec3 colour(const std::vector<std::string>& labels) const;
};

/// A file of a segmentation: 3D Slicer's .seg.nrrd, with names, colours and layers, or a
/// label map in any format of one file, in which every value but 0 is a part. Where it lies in
/// space is what its grid says; Segmentation_ReferenceImageExtentOffset adds nothing to that. A
/// label map of several frames (4D) gives one segmentation for each. kBadInput in one sentence:
/// what can not be read, samples that are not whole numbers, more than 1000 labels, no label at
/// all. Any thread.
Result<std::vector<Segmentation>> read_segmentation(const std::filesystem::path& file);

/// Whether the header of a file says that it is 3D Slicer's.
bool is_slicer_segmentation(const std::filesystem::path& file);

}  // namespace palpate::files
