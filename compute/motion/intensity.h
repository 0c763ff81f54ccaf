#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "compute/motion/noise.h"
#include "compute/volume/volume.h"

namespace palpate {

/// How raw intensities become numbers of order one: (I - offset) * scale. One for all frames of a
/// sequence, so that a difference between frames stays one.
struct IntensityScale {
  float offset = 0.0F;
  float scale = 1.0F;
};

/// Scales the range from the 1st to the 99th percentile to 1. Looks at no more than a few 100,000
/// voxels.
IntensityScale intensity_scale(const Volume& volume);

/// SDs of a frame's noise in the floor of local normalisation.
inline constexpr double kNoiseFloor = 2.2;

/// The floor f of local normalisation in scaled units, the one place where it is decided: 2.2 SDs
/// of the frame's noise, clamped to 0.02 to 0.25; or `asked`, if that is above 0. One for all
/// frames of a sequence, as the scale is. Any thread.
double noise_floor(const Volume& volume, const IntensityScale& scale, double asked);

/// Scaled intensities as fp16 bits, ready for upload: half the memory of a frame that waits.
struct HalfVolume {
  std::unique_ptr<uint16_t[]> bits;
  size_t count = 0;
};

HalfVolume scaled_halves(const Volume& volume, const IntensityScale& scale);

}  // namespace palpate
