#pragma once

#include <limits>
#include <vector>

#include "compute/volume/volume.h"
#include "integration/app/info/contents.h"
#include "integration/files/raster/raster.h"

namespace palpate::app {

/// Counts the values of a frame of this size.
class ValueCounter {
 public:
  explicit ValueCounter(glm::ivec3 size) : size_(size) { values_.hash = 0xcbf29ce484222325ULL; }
  /// voxel: index in the frame, i fastest.
  void add(float value, size_t voxel);
  Values values() const;

 private:
  glm::ivec3 size_;
  Values values_;
  float low_ = std::numeric_limits<float>::infinity();
  float high_ = -std::numeric_limits<float>::infinity();
  float last_ = std::numeric_limits<float>::quiet_NaN();
  double sum_ = 0.0;
  bool many_ = false;  ///< more distinct values than labels have
};

Values values_of(const Volume& volume);

/// Of each frame of a file; for vectors over all components together. Reads the file once.
Result<std::vector<Values>> values_of(const files::Raster& raster, const OnShare& on_share);

}  // namespace palpate::app
