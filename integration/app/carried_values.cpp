#include "integration/app/carried_values.h"

#include "compute/motion/quality_inverse.h"
#include "compute/volume/parallel.h"
#include "module/scene/motion_map.h"
#include "module/scene/transform.h"

namespace palpate::app {
namespace {

// Of the finest voxel edge: far below what the spline tells apart.
constexpr double kInverseTolerance = 0.01;

Volume carried_frame(const FrameData& reference, const Field& reference_u, const Field& u,
                     const Grid& grid) {
  const Field inverse = inverse_of(u, grid, kInverseTolerance * grid.finest_mm()).w;
  Volume frame{grid, std::vector<float>(grid.count())};
  parallel_ranges(grid.size.z, 300.0 * grid.size.x * grid.size.y, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i) {
          const size_t n = grid.offset(i, j, k);
          const glm::dvec3 material = grid.lps_from_index({i, j, k}) + glm::dvec3(inverse.u_mm[n]);
          const glm::dvec3 at = material + sample_at_lps(reference_u, material);
          frame.values[n] = float(reference.scalar(volume_from_lps(at)));
        }
  });
  return frame;
}

}  // namespace

MovingVolume with_carried_values(const MovingVolume& own, const SequenceMotion& motion,
                                 const Grid& grid) {
  MovingVolume carried = own;
  const FrameData& reference = *own.frames[motion.reference];
  const Field& reference_u = motion.at_frame[motion.reference];
  carried.motions = {{"data", {}}};
  for (size_t k = 0; k < own.frames.size(); ++k)
    if (k != motion.reference)
      carried.frames[k] =
          sampled_scalar(carried_frame(reference, reference_u, motion.at_frame[k], grid));
  for (size_t k = 0; k < size_t(own.times.steps()); ++k)
    carried.motions[0].steps.push_back(MotionMap::of(consecutive_field(motion, k)));
  return carried;
}

}  // namespace palpate::app
