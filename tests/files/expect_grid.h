#pragma once

#include <gtest/gtest.h>

#include <string>

#include "compute/volume/grid.h"

namespace palpate::files {

/// Every number of the grid within a tolerance. Text formats store doubles to 1e-9 or better, as
/// their writers print them (ITK prints 17 digits in NRRD, 15 or fewer in MetaImage); NIfTI stores
/// single precision, 6e-8 of values up to 200.
inline constexpr double kTextToleranceMm = 1e-9;
inline constexpr double kNiftiToleranceMm = 3e-5;
inline double tolerance_of(const std::string& file) {
  return file.find(".nii") != std::string::npos ? kNiftiToleranceMm : kTextToleranceMm;
}

inline void expect_grid(const Grid& found, const Grid& wanted, double tolerance) {
  EXPECT_EQ(found.size, wanted.size);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.spacing_mm[c], wanted.spacing_mm[c], tolerance) << "spacing " << c;
    EXPECT_NEAR(found.origin_mm[c], wanted.origin_mm[c], tolerance) << "origin " << c;
    for (int r = 0; r < 3; ++r)
      EXPECT_NEAR(found.direction[c][r], wanted.direction[c][r], tolerance) << c << ' ' << r;
  }
}

}  // namespace palpate::files
