#pragma once

#include "compute/motion/estimator.h"
#include "compute/motion/quality.h"
#include "tests/motion/made_pairs.h"
#include "tests/support/device.h"

namespace palpate::test {

/// Whole estimations on the device.
class SolverTest : public DeviceTest {
 protected:
  static EstimatorOptions preset(const std::string& name) {
    EstimatorOptions options;
    options.motion = *motion_preset(name);
    return options;
  }

  PairMotion motion_of(const Volume& fixed, const Volume& moving, const EstimatorOptions& options) {
    Result<PairMotion> motion = estimate_motion(context(), fixed, moving, options);
    EXPECT_TRUE(motion) << motion.error().message;
    return motion ? *motion : PairMotion{};
  }

  /// Endpoint error in voxels where both frames show the same material.
  Spread error_voxels(const MadePair& pair, const PairMotion& motion) {
    const Mask seen = seen_in_both(pair.truth, 3.0);
    const Result<Distances> error = endpoint_error(motion.field, pair.truth, &seen);
    EXPECT_TRUE(error);
    return error ? error->voxels : Spread{};
  }
};

}  // namespace palpate::test
