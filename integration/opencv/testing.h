#pragma once

#include <gmock/gmock.h>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"

/// GoogleTest matchers for motion fields, for the tests of any project that computes some:
///
///   EXPECT_THAT(my_field, palpate::testing::AgreesWithOpticalFlow(fixed, moving));
///   EXPECT_THAT(my_field, palpate::testing::HasNoFolds());
///   EXPECT_THAT(my_field, palpate::testing::IsWithin(truth, 0.1));
///
/// A field maps a fixed point x to x + u(x) in moving, u in mm along LPS (for data without a
/// patient: along the axes of the grid, with the default direction). "Voxel" is the finest axis of
/// the image. A failed match says what was measured. The matchers copy what they are given, so
/// temporaries are fine.
namespace palpate::testing {

using FieldMatcher = ::testing::Matcher<const Field&>;

/// Optical flow (DIS, Farneback) on slices of three orientations differs from the field's in-plane
/// part by a median of at most `voxels` and a 95th percentile of at most four times that. It takes
/// the better method of each orientation, where the two can be compared. A pair in which nothing
/// can be compared does not match.
FieldMatcher AgreesWithOpticalFlow(Volume fixed, Volume moving, double voxels = 0.5);

/// det(I + grad u) > 0 at the eight corners of every sample.
FieldMatcher HasNoFolds();

/// The mean endpoint error against the truth is at most mean_voxels, on truth's grid.
FieldMatcher IsWithin(Field truth, double mean_voxels);

/// The same, only inside a mask on truth's grid.
FieldMatcher IsWithin(Field truth, Mask mask, double mean_voxels);

/// The field followed by the other one ends within mean_voxels of the start on average, on the
/// field's grid.
FieldMatcher IsUndoneBy(Field backward, double mean_voxels);

}  // namespace palpate::testing
