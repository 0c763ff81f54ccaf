#pragma once

#include <cstdint>

#include "compute/volume/field.h"
#include "compute/volume/sequence.h"
#include "compute/volume/volume.h"

namespace palpate {

/// Synthetic data whose motion is known exactly. Every value follows from the arguments through
/// integer hashes and polynomials, so a seed gives the same data on every machine.

/// The cube of the heart phantom (heart_phantom.h) and of the shell: 128 mm wide, centred on the
/// LPS origin, size^3 samples of 128 / size mm.
Grid heart_grid(int size = 128);

/// Frames of one beat of the shell, unless said otherwise.
inline constexpr int kShellFrames = 4;

/// The beating heart of Lundin Palmerius et al. 2008, a shell: a thick wall of high value (1000)
/// around blood (350) in lung (100), all with a texture that moves with the material. Over `frames`
/// frames the wall is small, intermediate, large, intermediate; the last frame leads back to the
/// first. Edges are about 1.5 voxels soft, as a scanner's.
///
/// The motion: material at distance r from the LPS origin in the smallest state is, in frame k, at
///   r_k(r) = r + s_k b(r),  s_k = (1 - cos(2 pi k / frames)) / 2,  b(r) = 42 mm t (1 - t^2)^3,  t
///   = r / 59 mm,
/// and b = 0 beyond 59 mm. It moves by 10 mm at most from frame 0 to the opposite one. b' > -0.47,
/// so the map is one to one and no determinant falls below 0.5. noise: standard deviation of
/// Gaussian-like noise, as a share of the step from lung to wall (900). The grid may be of any
/// spacing and direction. Times are k / frames seconds: one beat a second.
Sequence shell_phantom(const Grid& grid, int frames = kShellFrames, uint32_t seed = 1,
                       double noise = 0.01);

/// The same on heart_grid(size).
Sequence shell_phantom(int size = 128, int frames = kShellFrames, uint32_t seed = 1,
                       double noise = 0.01);

/// What shell_phantom samples in a frame, without noise, at any place: with edges as soft as voxels
/// of voxel_mm make them. Any thread; real-time safe.
double shell_value(glm::dvec3 lps_mm, int frame, int frames = kShellFrames, uint32_t seed = 1,
                   double voxel_mm = 1.0);

/// The gradient of shell_value per mm, along LPS; exact (forward differentiation of the formula).
glm::dvec3 shell_gradient(glm::dvec3 lps_mm, int frame, int frames = kShellFrames,
                          uint32_t seed = 1, double voxel_mm = 1.0);

/// Where the material that is at lps_mm in from_frame is in to_frame, LPS mm, to 1e-9 mm. Frames
/// count cyclically.
glm::dvec3 shell_point(glm::dvec3 lps_mm, int from_frame, int to_frame, int frames = kShellFrames);

/// shell_point as a field u (mm, LPS) on any grid: exact at its samples, up to rounding to float.
Field shell_truth(const Grid& grid, int from_frame, int to_frame, int frames = kShellFrames);

/// The voxels whose centre lies in the wall of the shell in a frame. The inner side of the wall is
/// bumpy (as by papillary muscles) in a way that depends on the seed.
Mask shell_mask(const Grid& grid, int frame, int frames = kShellFrames, uint32_t seed = 1);

/// A pair with a sliding border, its truth, and where to score.
struct SlidingPhantom {
  Volume fixed;
  Volume moving;
  Field truth;  ///< u of the fixed grid, mm, LPS; it jumps at the organ's side
  Mask organ;   ///< voxels of the organ in fixed
  Mask wall;    ///< still voxels within 5 voxels of the tube's side, along all the organ passes
};

/// A textured organ (mean 600), an elliptic cylinder along k, is moved as a rigid body by
/// shift_voxels along k through a tube of flat fluid (100) in a still textured body (mean 400);
/// size^3 voxels of 1 mm, origin 0. The truth is the shift in the organ, zero in the body, and in
/// the fluid before and behind the organ a linear ramp between the two. (The fluid is flat: its
/// motion can not be seen and is in no mask.) Needs |shift_voxels| < size / 3. noise: standard
/// deviation as a share of the intensity range (800), different in both frames.
SlidingPhantom sliding_phantom(int size = 96, double shift_voxels = 20.0, uint32_t seed = 1,
                               double noise = 0.02);

}  // namespace palpate
