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

/// Two frames, the true motion between them, and where to score.
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

/// Adds noise of this standard deviation, different in each frame.
void add_noise(MotionPair& pair, double sd, uint32_t seed);

/// Standard deviation of a volume's values.
double deviation(const Volume& volume);

/// The result of a preset for a pair.
struct Found {
  Field field;
  Confidence confidence;
  double folded_share = 0.0;
  /// Ok also if there is no verdict.
  Trust trust = Trust::kOk;
};

/// Estimates the motion of the pair with a preset. judge: also backward, with a verdict, as
/// `palpate motion` does. Throws std::runtime_error with a message if the device fails.
Found found(const std::shared_ptr<vulkan::Context>& context, const MotionPair& pair,
            const std::string& preset, bool judge);

/// The accuracy of a result.
struct Score {
  double mean_voxels = 0.0;  ///< endpoint error, in voxels of the finest axis
  double wrong_share = 0.0;  ///< of the scored voxels with an error above a voxel
  /// The part of these whose confidence is not low.
  double unseen_share = 0.0;
};

/// Compares it with the truth inside the pair's mask. Throws std::runtime_error if the mask is
/// empty.
Score scored(const Found& found, const MotionPair& pair);

}  // namespace palpate::stability
