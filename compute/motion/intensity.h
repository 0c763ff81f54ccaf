#pragma once

#include <cstdint>
#include <vector>

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

/// Noise SD in the volume's own unit: 1.4826 median |I(i-1) - 2 I(i) + I(i+1)| / sqrt(6) along x,
/// which structure hardly moves and smooth regions of any slope do not. Voxels in a run of equal
/// values (air that a scanner clipped) say nothing and are passed over. Reads low where the noise
/// is smooth, as in resampled images.
double noise_sd(const Volume& volume);

/// Scaled intensities as fp16 bits, ready for upload: half the memory of a frame that waits.
struct HalfVolume {
  std::vector<uint16_t> bits;
};

HalfVolume scaled_halves(const Volume& volume, const IntensityScale& scale);

}  // namespace palpate
