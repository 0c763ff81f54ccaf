#pragma once

#include <span>

#include "module/view/eye.h"
#include "module/view/resident_volume.h"
#include "module/view/view_scene.h"
#include "shaders/interface/view.h"

namespace palpate::view {

/// The rays of an eye in the world, see ViewRays, or in units of unit_m from origin_m on.
view_shaders::ViewRays rays_of(const Eye& eye, PictureSize size,
                               glm::dvec3 origin_m = glm::dvec3(0.0), double unit_m = 1.0);

/// What the ray caster needs besides volumes: rays, clips, background.
view_shaders::ViewParameters parameters_of(const ViewScene& scene, std::span<const Eye> eyes,
                                           PictureSize size, double near_m);

/// One volume's part; bricks and the table's first entry are left to the caller.
view_shaders::ViewVolumeParameters volume_parameters_of(const ViewScene& scene,
                                                        const ViewVolume& volume,
                                                        std::span<const Eye> eyes, PictureSize size,
                                                        const ResidentFrames& frames,
                                                        double samples_per_voxel);

/// How a volume is seen by an eye where it is farthest.
struct SeenVoxels {
  double farthest_m = 0.0;     ///< depth t of the farthest corner of its box
  double least_pixels = 1e30;  ///< edge of its finest voxel there
};
SeenVoxels seen_voxels(const ViewVolume& volume, const Eye& eye, PictureSize size,
                       const ResidentFrames& frames);

/// Colour and extinction for each of the kTable values from lowest to highest, then the integrals
/// of extinction times colour and of extinction up to each of them, in entries. Then for each of
/// them the next one, itself included, that has extinction (kTable where none follows). most:
/// kMostLevels of kTable each, level l the most extinction of 2^l entries from here on.
void fill_table(const Look& look, double lowest, double highest, std::span<glm::vec4> table,
                std::span<uint32_t> next, std::span<float> most);

}  // namespace palpate::view
