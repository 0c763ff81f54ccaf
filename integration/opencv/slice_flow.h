#pragma once

#include <stop_token>

#include "compute/volume/field.h"
#include "compute/volume/result.h"
#include "compute/volume/volume.h"
#include "integration/opencv/cross_check.h"

namespace palpate::opencv {

/// OpenCV's optical flow as a motion field, slice by slice, in three orientations.
struct SliceFlow {
  Field field;           ///< on fixed's grid
  double seconds = 0.0;  ///< flow only, all slices of all orientations
};

/// The flow from fixed to moving in every slice of the three orientations, windowed as in
/// cross_check(). Each component of the motion is visible in two of the three: their mean is taken.
/// Errors: kBadInput if slices are under 32 pixels in one direction, or the grids differ;
/// kCancelled.
Result<SliceFlow> slice_flow(FlowMethod method, const Volume& fixed, const Volume& moving,
                             const std::stop_token& stop = {});

}  // namespace palpate::opencv
