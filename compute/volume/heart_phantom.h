#pragma once

#include <cstdint>

#include "compute/volume/field.h"
#include "compute/volume/phantom.h"
#include "compute/volume/sequence.h"
#include "compute/volume/volume.h"

namespace palpate {

/// A synthetic beating heart whose motion is known in closed form. Every value follows from integer
/// hashes, polynomials and square roots, so a seed gives the same data on every machine.
///
/// Anatomy, in the LPS frame of a patient and within the cube of heart_grid: a left ventricle with
/// a thick wall (11 mm, thinner at the apex, two papillary muscles). A right ventricle that is a
/// thin (4.5 mm) crescent around it, the septum between them. Two atria with their appendages.
/// Aorta with arch, its three branches and the descending part, pulmonary trunk with both arteries,
/// venae cavae, four pulmonary veins, cut off flat. Fat in the grooves, coronary arteries in the
/// fat; lung around. Valves are openings without leaflets.
///
/// Values: lung 60, blood 200, myocardium 540, atrial wall 720, fat 900, arteries and pulmonary
/// veins 1100, pulmonary arteries and venae cavae 1300, each with a texture that moves with the
/// material. All tissue is above 480, all blood and lung below 250. Edges are soft over 1.5 voxels.
///
/// Motion: frame 0 is the end of filling. Then, in polynomials of place and phase, the ventricles
/// contract (the left wall thickens by a third), the base comes 11 mm towards the apex, the
/// ventricles twist about their long axis, the atria fill. The heart relaxes, and the atria
/// contract last. The map from frame 0 to any phase is smooth and one to one, moves the faces of
/// the cube by less than 0.05 mm, and has a determinant between 0.25 and 3. Values move with the
/// material: heart_value of a point and of where heart_point carries it are the same.

/// Frames of one beat, unless said otherwise.
inline constexpr int kHeartFrames = 8;

/// noise: standard deviation of Gaussian-like noise, as a share of the step from lung to myocardium
/// (480). The grid may be of any spacing and direction. Times are k / frames seconds: one beat a
/// second. On all cores.
Sequence heart_phantom(const Grid& grid, int frames = kHeartFrames, uint32_t seed = 1,
                       double noise = 0.01);

/// The same on heart_grid(size).
Sequence heart_phantom(int size = 128, int frames = kHeartFrames, uint32_t seed = 1,
                       double noise = 0.01);

/// What heart_phantom samples in a frame, without noise, at any place: with edges as soft as voxels
/// of voxel_mm make them. Any thread; real-time safe.
double heart_value(glm::dvec3 lps_mm, int frame, int frames = kHeartFrames, uint32_t seed = 1,
                   double voxel_mm = 1.0);

/// The gradient of heart_value per mm, along LPS; exact (forward differentiation of the formula).
glm::dvec3 heart_gradient(glm::dvec3 lps_mm, int frame, int frames = kHeartFrames,
                          uint32_t seed = 1, double voxel_mm = 1.0);

/// Where the material that is at lps_mm in from_frame is in to_frame, LPS mm, to 1e-9 mm. Frames
/// count cyclically.
glm::dvec3 heart_point(glm::dvec3 lps_mm, int from_frame, int to_frame, int frames = kHeartFrames);

/// heart_point as a field u (mm, LPS) on any grid: exact at its samples, up to rounding to float.
Field heart_truth(const Grid& grid, int from_frame, int to_frame, int frames = kHeartFrames);

/// The voxels whose centre lies in the wall of a ventricle in a frame.
Mask heart_muscle(const Grid& grid, int frame, int frames = kHeartFrames, uint32_t seed = 1);

}  // namespace palpate
