// The drawn surface is the felt one: the beating heart's surface compared with the values of the
// haptic loop.
#include <algorithm>

#include "tests/view/shown_value.h"
#include "tests/view/slow_rays.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kSurfaceSize{40, 40};
// Where the hand's wall has half of its largest strength.
constexpr double kLevel = 625.0;
constexpr double kVoxelM = 1e-3;

/// The first place along a ray where the felt value crosses the iso-value, m; 0 if there is none.
double felt_depth(const MovingVolume& heart, FramePointer at, glm::dvec3 from, glm::dvec3 way,
                  double near, double far) {
  const auto above = [&](double t) { return felt_value(heart, at, from + t * way) >= kLevel; };
  constexpr double kStep = 0.5 * kVoxelM;
  for (double t = near; t < far; t += kStep) {
    if (!above(t)) continue;
    double low = t - kStep, high = t;
    for (int k = 0; k < 20; ++k) (above(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
    return high;
  }
  return 0.0;
}

class SurfaceTest : public ViewTest {};

TEST_F(SurfaceTest, OfTheBeatingHeartIsSeenWhereItIsFeltAtEveryPhase) {
  for (const auto& heart : {beating_heart(), carried_heart(false), carried_heart(true)}) {
    RendererOptions options{kSurfaceSize, 1};
    // The picture's lattice of samples is a voxel wide; a fine one shows the place of the surface
    // itself.
    options.samples_per_voxel = 32.0;
    auto view = renderer(options);
    set(*view, {heart});
    const Eye eye = eye_at({0.08, 0.06, 0.16}, {0, 0, 0}, 0.35, kSurfaceSize);
    for (const FramePointer at :
         {FramePointer{0, 0.0}, FramePointer{0, 0.25}, FramePointer{0, 0.6}, FramePointer{1, 0.5},
          FramePointer{2, 0.37}, FramePointer{3, 0.8}}) {
      ViewScene scene;
      scene.volumes = {{heart, {}, at, step_look(kLevel)}};
      const Picture picture = draw(*view, scene, {eye}, kSurfaceSize)[0];
      std::vector<double> off;
      for (int y = 3; y < kSurfaceSize.height; y += 7)
        for (int x = 3; x < kSurfaceSize.width; x += 7) {
          const float seen = picture.depths[size_t(y * kSurfaceSize.width + x)];
          const glm::dvec3 way = ray_of(eye, kSurfaceSize, x, y);
          const double felt = felt_depth(*heart, at, eye.position_m, way, 0.12, 0.2);
          // At the rim a ray is tangential, and the depth does not give the place of the surface.
          if (felt == 0.0 || seen == 0.0F) continue;
          const glm::dvec3 place = eye.position_m + felt * way;
          const double facing = std::abs(glm::dot(glm::normalize(place), glm::normalize(way)));
          if (facing < 0.4) continue;
          // Half of the light is absorbed at this distance behind the surface, with the extinction
          // of step_look.
          const double half_light_m = 1e-3 * std::log(2.0) / -std::log(1.0 - 0.999);
          const double seen_m = options.near_m / double(seen) * glm::length(way) - half_light_m;
          off.push_back((seen_m - felt * glm::length(way)) * facing / kVoxelM);
        }
      ASSERT_GE(off.size(), 8U);
      double worst = 0.0;
      for (const double d : off) worst = std::max(worst, std::abs(d));
      RecordProperty("worst_voxels", std::to_string(worst));
      // Required: at most 0.1 voxel. The lattice of samples adds up to 1/32.
      EXPECT_LT(worst, 0.1) << "frame " << at.frame << " phase " << at.phase
                            << (heart->whole ? ", carried" : "");
    }
  }
}

/// A vessel whose wall and contents lie within two voxels: the order of tissues inside a segment,
/// and the normal at each sample, must be seen, not the pattern of the samples.
TEST_F(SurfaceTest, OfThinLayersShowsNoPatternOfSamples) {
  constexpr int kEdge = 48;
  const auto vessel = still_volume(kEdge, 1.0, [](glm::dvec3 x) {
    return std::clamp(0.5 + (10.0 - std::hypot(x.x, x.y)) / 3.0, 0.0, 1.0);
  });
  Look look{"layers", {}, {1.0, 0.0, 0.0}, 0.0};
  look.points = {{0.2, glm::dvec3(0.9, 0.5, 0.1), 0.0},
                 {0.3, glm::dvec3(0.9, 0.5, 0.1), 0.6},
                 {0.5, glm::dvec3(0.7, 0.1, 0.1), 0.6},
                 {0.7, glm::dvec3(0.3, 0.1, 0.7), 0.9},
                 {1.0, glm::dvec3(0.3, 0.1, 0.7), 0.9}};
  look.shine = {0.3, 0.7, 0.2};
  ViewScene scene;
  scene.volumes = {{vessel, {}, {}, look}};
  const Eye eye = eye_at({0.06, 0.05, 0.09}, {0.0, 0.0, 0.0}, 0.4, kSurfaceSize);
  const auto picture = [&](const RendererOptions& options) {
    auto view = renderer(options);
    set(*view, {vessel});
    return draw(*view, scene, {eye}, kSurfaceSize)[0];
  };
  RendererOptions fine{kSurfaceSize, 1}, plain{kSurfaceSize, 1};
  fine.samples_per_voxel = 16.0;
  plain.samples_per_voxel = 1.0;
  fine.refines = plain.refines = false;
  const Picture best = picture(fine);
  const double db = psnr_db(picture({kSurfaceSize, 1}), best);
  EXPECT_GT(db, 42.0);
  // Twice as many samples without telling halves apart are not enough.
  EXPECT_GT(db, psnr_db(picture(plain), best) + 3.0);
}

}  // namespace
}  // namespace palpate::test
