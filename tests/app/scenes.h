#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "compute/volume/phantom.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"

namespace palpate::app {

/// A heart that is quick to compute: 48^3 voxels of 2.7 mm, moving by 5 mm per frame.
inline constexpr int kHeartSize = 48;

inline Sequence small_heart(int frames = 4) {
  return shell_phantom(kHeartSize, frames);
}

inline std::string written(const Volume& volume, const std::filesystem::path& path) {
  const Status done = files::write_volume(volume, path);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  return path.string();
}

inline std::string written(const Sequence& sequence, const std::filesystem::path& path) {
  const Status done = files::write_sequence(sequence, path);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  return path.string();
}

inline std::string written(const Field& field, const std::filesystem::path& path) {
  const Status done = files::write_field(field, path);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  return path.string();
}

/// The volume at another place, as of another patient: `shift_mm` along every axis.
inline Volume shifted(Volume volume, double shift_mm) {
  volume.grid.origin_mm += glm::dvec3(shift_mm);
  return volume;
}

}  // namespace palpate::app
