#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "module/scene/frame_data.h"
#include "module/scene/scene_spec.h"

namespace palpate {

/// One frame of the beating heart or shell of compute/volume, by its formula: no samples, no noise,
/// exact gradients. Its Jacobian is a central difference of the gradient over half of voxel_mm.
/// voxel_mm: the width of edges. Outside its box, 128 mm wide, the formula goes on.
std::shared_ptr<const FrameData> analytic_heart(int frame, int frames = kHeartFrames,
                                                uint32_t seed = 1, double voxel_mm = 1.0);
std::shared_ptr<const FrameData> analytic_shell(int frame, int frames = kShellFrames,
                                                uint32_t seed = 1, double voxel_mm = 1.0);

/// The potential sum strength / sqrt(|x - position|^2 + softness^2), V, as scalar; its gradient,
/// V/m, as vector; both and the Hessian in closed form. Needs at least one charge; there are data
/// in the box from low_m to high_m, volume space.
std::shared_ptr<const FrameData> point_charges(std::vector<PointCharge> charges, glm::dvec3 low_m,
                                               glm::dvec3 high_m);

/// The molecule of Lundin Palmerius et al. 2008: the electropotential of 1,2-dichloroethane in its
/// stretched (anti) form, magnified so that 1 angstrom is 20 mm and the molecule about 0.1 m wide.
///
/// Geometry, general chemistry values: C-C 1.53, C-Cl 1.79, C-H 1.09 angstrom, all angles 109.5
/// degrees. Partial charges, plausible and neutral in sum, not from a calculation: Cl -0.20,
/// C -0.04, H +0.12 e. Softness 0.5 angstrom. Value: V, as at the real place; gradient: V per m of
/// the magnified space.
std::shared_ptr<const FrameData> dichloroethane();
std::vector<PointCharge> dichloroethane_charges();

/// Where the atoms of dichloroethane() are, volume space, m: Cl, C, H, H, then their images through
/// the origin. For pictures and tests.
std::vector<glm::dvec3> dichloroethane_atoms_m();

}  // namespace palpate
