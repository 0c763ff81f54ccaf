#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "compute/motion/noise.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Scales raw intensities to numbers of order one: (I - offset) * scale. The same for all frames of
/// a sequence, so that differences between frames are kept.
struct IntensityScale {
  float offset = 0.0F;
  float scale = 1.0F;
};

/// The scale that maps the range from the 1st to the 99th percentile to length 1. Samples at most a
/// few 100,000 voxels. Any thread.
IntensityScale intensity_scale(const Volume& volume);

/// The floor of local normalisation, in SDs of a frame's noise.
inline constexpr double kNoiseFloor = 2.2;

/// The floor f of local normalisation, in scaled units; decided only here. `asked`, if that is
/// above 0; else kNoiseFloor times `sd`, the noise SD of the frame, clamped to 0.02 to 0.25. The
/// same for all frames of a sequence, as the scale is. Any thread.
double noise_floor(double sd, const IntensityScale& scale, double asked);

/// What is taken from the first frame for all frames of a sequence.
struct FrameScale {
  IntensityScale intensity;
  double noise = 0.0;  ///< floor of local normalisation, see noise_floor()
};

/// intensity_scale() and noise_floor(), measured at the same time. Any thread.
FrameScale frame_scale(const Volume& volume, double asked_noise);

/// Scaled intensities as fp16 bits, ready for upload: a waiting frame takes half the memory.
struct HalfVolume {
  std::unique_ptr<uint16_t[]> bits;
  size_t count = 0;
};

/// `reuse`: memory that is no longer needed, taken if it has the right size: the system gives new
/// memory page by page, which takes longer than the conversion. Any thread.
HalfVolume scaled_halves(const Volume& volume, const IntensityScale& scale, HalfVolume reuse = {});

}  // namespace palpate
