#pragma once

#include "module/view/volume_renderer.h"

namespace palpate::test {

/// The oracle of the picture: the emission and absorption integral of one volume along every
/// pixel's ray in double precision, with the values that the haptic loop reads
/// (tests/view/shown_value.h). Nothing skipped, no tables, many small steps, lit by its own central
/// differences. Without shapes. `steps_per_voxel` along the ray. Uses all cores.
Picture slow_picture(const ViewScene& scene, const Eye& eye, PictureSize size,
                     double steps_per_voxel, double near_m);

/// The similarity of two pictures, dB of the colours' 8 bits: infinite if they are equal.
double psnr_db(const Picture& a, const Picture& b);

}  // namespace palpate::test
