#pragma once

#include "compute/volume/volume.h"

namespace palpate {

/// SD of the white noise in a volume, in the volume's own unit. Every sample is filtered by the
/// product of second differences (1, -2, 1) along each axis that has three samples or more, which
/// removes all structure that is smooth along any one axis; the noise SD is 1.4826 median
/// |filtered| / sqrt(6)^axes. Places where all neighbours are equal (padding outside a scanner's
/// circle) do not count. Noise that a scanner has blurred comes out smaller than it is; structure
/// that is rough along all axes adds to it (heart phantom of 64^3 with an SD of 18: 18.3). 0 for a
/// constant volume. Looks at no more than a few 100,000 samples. Any thread.
double noise_sd(const Volume& volume);

}  // namespace palpate
