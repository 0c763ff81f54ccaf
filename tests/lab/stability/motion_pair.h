#pragma once

#include <functional>
#include <memory>
#include <string>

#include "compute/motion/estimator.h"
#include "compute/motion/verdict.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate::stability {

/// Two frames, what the truth is between them, and where to score.
struct MotionPair {
  Volume fixed, moving;
  Field truth;  ///< on fixed's grid, mm
  Mask mask;    ///< voxels of fixed that count
};

/// The grid of most maps: `size` voxels of 1 mm each way.
Grid cube(int size);

/// moving is `body` (of LPS mm) and fixed is body(x + u(x)), so that u is the truth even where it
/// folds. Scored where x and x + u(x) are 4 voxels inside.
MotionPair pair_of(const Grid& grid, const std::function<double(glm::dvec3)>& body,
                   const std::function<glm::dvec3(glm::dvec3)>& u_mm);

/// Adds noise of so large a standard deviation, another in each frame.
void add_noise(MotionPair& pair, double sd, uint32_t seed);

/// Standard deviation of a volume's values.
double deviation(const Volume& volume);

/// What a preset found for a pair.
struct Found {
  Field field;
  Confidence confidence;
  double folded_share = 0.0;
  Trust trust = Trust::kOk;  ///< ok also where nothing was judged
};

/// Estimates the motion of the pair with a preset. judge: also back, and a verdict of it all, as
/// `palpate motion` does. Throws std::runtime_error with a sentence where the device fails.
Found found(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
            const std::string& preset, bool judge);

/// How good that is.
struct Score {
  double mean_voxels = 0.0;  ///< endpoint error, in voxels of the finest axis
  double wrong_share = 0.0;  ///< of the scored voxels with an error above a voxel
  /// of those: with a confidence that is not low, which speaks for them
  double unseen_share = 0.0;
};

/// Holds it against the truth where the pair's mask is set. Throws std::runtime_error where that is
/// nowhere.
Score scored(const Found& found, const MotionPair& pair);

}  // namespace palpate::stability
