// Transmitted light of bodies whose line integral is known in closed form.
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kLightSize{64, 48};
// The picture is rounded to 1/255; the sum must be as accurate.
constexpr double kOfLight = 1.0 / 255.0;

/// Compares the coverage of each pixel with 1 - exp(-integral).
void expect_covered(const Picture& picture, const Eye& eye,
                    const std::function<double(glm::dvec3, glm::dvec3)>& integral) {
  for (int y = 0; y < kLightSize.height; ++y)
    for (int x = 0; x < kLightSize.width; ++x) {
      const glm::dvec3 way = glm::normalize(ray_of(eye, kLightSize, x, y));
      const double expected = 1.0 - std::exp(-integral(eye.position_m, way));
      ASSERT_NEAR(channel(picture, x, y, 3) / 255.0, expected, kOfLight)
          << "pixel " << x << ", " << y;
    }
}

/// Length of the part of a ray inside a box around the origin, m.
double inside_box(glm::dvec3 from, glm::dvec3 way, double half) {
  double enters = 0.0, leaves = 1e9;
  for (int a = 0; a < 3; ++a) {
    const double low = (-half - from[a]) / way[a], high = (half - from[a]) / way[a];
    enters = std::max(enters, std::min(low, high));
    leaves = std::min(leaves, std::max(low, high));
  }
  return std::max(leaves - enters, 0.0);
}

using LightTest = ViewTest;

TEST_F(LightTest, ThroughASlabFallsExponentially) {
  const auto volume = still_volume(32, 1.5, [](glm::dvec3) { return 1.0; });
  auto view = renderer({kLightSize, 1});
  set(*view, {volume});
  ViewScene scene;
  for (const double per_mm : {0.004, 0.02, 0.05, 0.3}) {
    scene.volumes = {{volume, {}, {}, proportional_look(per_mm)}};
    const Eye eye = eye_at({0.05, 0.04, 0.11}, {0.003, -0.002, 0}, 0.6, kLightSize);
    const Picture picture = draw(*view, scene, {eye}, kLightSize)[0];
    expect_covered(picture, eye, [&](glm::dvec3 from, glm::dvec3 way) {
      return per_mm * 1e3 * inside_box(from, way, 0.5 * 32 * 1.5e-3);
    });
  }
}

TEST_F(LightTest, ThroughASphereFollowsItsLineIntegral) {
  // value = 1 - r^2/R^2: the integral along a line at distance b is 4/3 (R^2 - b^2)^(3/2) / R^2.
  constexpr double kRadiusMm = 30.0;
  const auto volume = still_volume(
      64, 1.0, [](glm::dvec3 x) { return 1.0 - glm::dot(x, x) / (kRadiusMm * kRadiusMm); });
  auto view = renderer({kLightSize, 1});
  set(*view, {volume});
  for (const double per_mm : {0.01, 0.04}) {
    ViewScene scene;
    // A rotated and enlarged volume gives the same picture from a rotated and enlarged place.
    Transform turned;
    turned.rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -1)));
    turned.scale = glm::dvec3(2.0);
    turned.translation_m = {0.1, -0.2, 0.05};
    scene.volumes = {{volume, turned, {}, proportional_look(per_mm)}};
    const glm::dvec3 from = turned.world_from_volume({0.02, 0.03, 0.12});
    const Eye eye = eye_at(from, turned.translation_m, 0.6, kLightSize);
    const Picture picture = draw(*view, scene, {eye}, kLightSize)[0];
    expect_covered(picture, eye, [&](glm::dvec3 origin, glm::dvec3 way) {
      const glm::dvec3 o = 1e3 * turned.volume_from_world(origin);
      const glm::dvec3 d = glm::conjugate(turned.rotation) * way;
      const glm::dvec3 nearest = o - glm::dot(o, d) * d;
      const double rest = kRadiusMm * kRadiusMm - glm::dot(nearest, nearest);
      return rest > 0.0 ? per_mm * 4.0 / 3.0 * std::pow(rest, 1.5) / (kRadiusMm * kRadiusMm) : 0.0;
    });
  }
}

TEST_F(LightTest, IsSmoothedAlikeAlongAllAxes) {
  // Frames are smoothed in runs along one axis: the borders of runs must not be visible.
  constexpr PictureSize kSquare{64, 64};
  constexpr int kVoxels = 32;
  const auto level = [](double mm) {
    const int voxel = int(std::floor(mm + 0.5 * kVoxels));
    return voxel * voxel * 7 % 11 < 5 ? 1.0 : 0.0;
  };
  const auto across = still_volume(kVoxels, 1.0, [&](glm::dvec3 mm) { return level(mm.x); });
  const auto up = still_volume(kVoxels, 1.0, [&](glm::dvec3 mm) { return level(mm.y); });
  auto view = renderer({kSquare, 1});
  set(*view, {across, up});
  // From so far away that rays are parallel.
  const Eye eye = eye_at({0.0, 0.0, 10.0}, {0.0, 0.0, 0.0}, 0.001 * kVoxels / 10.0, kSquare);
  std::vector<Picture> pictures;
  for (const auto& volume : {across, up}) {
    ViewScene scene;
    scene.volumes = {{volume, {}, {}, proportional_look(0.05)}};
    pictures.push_back(draw(*view, scene, {eye}, kSquare)[0]);
  }
  int least = 255, most = 0;
  for (int y = 2; y < kSquare.height - 2; ++y)
    for (int x = 2; x < kSquare.width - 2; ++x) {
      least = std::min(least, channel(pictures[0], x, y, 3));
      most = std::max(most, channel(pictures[0], x, y, 3));
      // Half a step of rounding for each, and one for jitter, which differs from pixel to pixel.
      ASSERT_NEAR(channel(pictures[0], x, y, 3), channel(pictures[1], y, kSquare.height - 1 - x, 3),
                  2)
          << x << ", " << y;
    }
  // The picture must have differences to compare.
  EXPECT_GT(most - least, 80);
}

}  // namespace
}  // namespace palpate::test
