// Ambient occlusion and soft shadows, of bodies that take a known part of the light.
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kGridSize{48, 48};
constexpr int kEdge = 64;  // of 1 mm along each edge
// An opaque floor below y = kFloor, a slab of haze from kSlab up to kTop, mm.
constexpr double kFloor = -16.0, kSlab = -8.0, kTop = 4.0;
constexpr double kHazeValue = 0.25, kFloorValue = 1.0;  // values

/// What the floor and the slab consist of.
double floor_and_slab(glm::dvec3 mm) {
  return mm.y < kFloor ? kFloorValue : mm.y > kSlab && mm.y < kTop ? kHazeValue : 0.0;
}

/// A white floor, lit by ambient or direct light alone, below black haze that takes per_mm of the
/// light: what is seen of the floor through it falls by the same share with and without shadows.
Look white(double haze_per_mm, double ambient, double diffuse) {
  Look look{"white", {}, {1.0, 0.0, 0.0}, 0.0};
  const double haze = 1.0 - std::exp(-haze_per_mm);
  look.points = {{0.05, glm::dvec3(0.0), 0.0},
                 {0.1, glm::dvec3(0.0), haze},
                 {0.4, glm::dvec3(0.0), haze},
                 // White from its outermost skin on: a dark one would count as the slab's.
                 {0.401, glm::dvec3(1.0), haze},
                 {0.6, glm::dvec3(1.0), 0.999}};
  look.shine = {ambient, diffuse, 0.0};
  return look;
}

/// Mean linear light of the pixels in the middle of the picture.
double middle_of(const Picture& picture) {
  constexpr int kAbout = 4;
  double sum = 0.0;
  for (int y = -kAbout; y < kAbout; ++y)
    for (int x = -kAbout; x < kAbout; ++x)
      sum += linear_from_srgb(
          channel(picture, kGridSize.width / 2 + x, kGridSize.height / 2 + y, 0) / 255.0);
  return sum / (4 * kAbout * kAbout);
}

class LightGridTest : public ViewTest {
 protected:
  /// From obliquely above to the middle of the floor; the light comes from above.
  static Eye beside() {
    return eye_at({0.0, 0.12, 0.12}, {0.0, 1e-3 * kFloor, 0.0}, 0.02, kGridSize);
  }
  static glm::dvec3 from_above(const Eye& eye) {
    return glm::conjugate(eye.orientation) * glm::dvec3(0.0, 1.0, 0.0);
  }
  /// What is seen of the middle of the floor, with shadows as a share of that without.
  double share(VolumeRenderer& view, ViewScene scene, const Eye& eye) {
    scene.light = from_above(eye);
    scene.shadows = 0.0;
    without_ = middle_of(draw(view, scene, {eye}, kGridSize)[0]);
    scene.shadows = 1.0;
    const double with = middle_of(draw(view, scene, {eye}, kGridSize)[0]);
    EXPECT_GT(without_, 0.02);
    return with / without_;
  }
  /// Optical depth of the slab straight up, from how it dims the floor along the view, 45 degrees
  /// off: the slab's soft borders add to its thickness.
  double depth_upwards() const { return -std::log(without_) / std::sqrt(2.0); }

  double without_ = 0.0;
};

/// What is seen where the share v of the light reaches a white floor: it sends four tenths on, and
/// what keeps the rest away sends that back, twice.
double with_echo(double v) {
  const double again = 0.4 * (1.0 - v);
  return v * (1.0 + again * (1.0 + again));
}

// Of cells of two voxels, and of cones that are read at a few places.
constexpr double kOfShare = 0.06;
// Oblique cones are read at fewer places, and reach beyond the slab.
constexpr double kOfAmbientShare = 0.25;

TEST_F(LightGridTest, AFreeFloorLiesInNoShadow) {
  const auto volume = still_volume(kEdge, 1.0, floor_and_slab);
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  for (const double ambient : {0.0, 1.0}) {
    scene.volumes = {{volume, {}, {}, white(0.0, ambient, 1.0 - ambient)}};
    EXPECT_NEAR(share(*view, scene, beside()), 1.0, kOfShare) << "ambient " << ambient;
  }
}

TEST_F(LightGridTest, ASlabTakesTheLightThatItAbsorbs) {
  const auto volume = still_volume(kEdge, 1.0, floor_and_slab);
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  for (const double depth : {0.3, 1.0, 2.0}) {
    const double per_mm = depth / (kTop - kSlab);
    scene.volumes = {{volume, {}, {}, white(per_mm, 0.0, 1.0)}};
    const double left = share(*view, scene, beside());
    EXPECT_NEAR(left, with_echo(std::exp(-depth_upwards())), kOfShare) << depth;
  }
}

TEST_F(LightGridTest, AmbientLightComesObliquelyThroughASlab) {
  const auto volume = still_volume(kEdge, 1.0, floor_and_slab);
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  for (const double depth : {0.2, 0.6, 2.0}) {
    const double per_mm = depth / (kTop - kSlab);
    scene.volumes = {{volume, {}, {}, white(per_mm, 1.0, 0.0)}};
    // The directions to the upper corners of a cube pass through sqrt(3) times as much.
    const double left = share(*view, scene, beside());
    EXPECT_NEAR(left, with_echo(std::exp(-std::sqrt(3.0) * depth_upwards())), kOfAmbientShare)
        << depth;
  }
}

TEST_F(LightGridTest, APitIsDarkerThanItsBrim) {
  // A pit of 12 x 12 x 20 mm in an opaque floor.
  const auto volume = still_volume(kEdge, 1.0, [](glm::dvec3 mm) {
    const bool pit = std::max(std::abs(mm.x), std::abs(mm.z)) < 6.0 && mm.y > -20.0;
    return mm.y < 0.0 && !pit ? kFloorValue : 0.0;
  });
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, white(0.0, 1.0, 0.0)}};
  const Eye in_pit = eye_at({0.0, 0.15, 0.0001}, {0.0, -0.02, 0.0}, 0.02, kGridSize);
  const Eye on_brim = eye_at({0.02, 0.15, 0.0001}, {0.02, 0.0, 0.0}, 0.02, kGridSize);
  EXPECT_LT(share(*view, scene, in_pit), 0.6);
  EXPECT_GT(share(*view, scene, on_brim), 0.9);
}

TEST_F(LightGridTest, WhatIsCutAwayTakesNoLight) {
  const auto volume = still_volume(kEdge, 1.0, floor_and_slab);
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, white(0.2, 0.0, 1.0)}};
  EXPECT_LT(share(*view, scene, beside()), 0.2);
  scene.clips = {{{0.0, -1.0, 0.0}, -1e-3 * (kSlab - 2.0)}};
  EXPECT_NEAR(share(*view, scene, beside()), 1.0, kOfShare);
}

TEST_F(LightGridTest, AnotherVolumeCastsItsShadowWhereItIs) {
  const auto floor =
      still_volume(kEdge, 1.0, [](glm::dvec3 mm) { return mm.y < kFloor ? kFloorValue : 0.0; });
  const auto slab = still_volume(
      kEdge, 1.0, [](glm::dvec3 mm) { return mm.y > kSlab && mm.y < kTop ? kHazeValue : 0.0; });
  auto view = renderer({kGridSize, 1});
  set(*view, {floor, slab});
  const Look look = white(1.0 / (kTop - kSlab), 0.0, 1.0);
  ViewScene scene;
  scene.volumes = {{floor, {}, {}, look}, {slab, {}, {}, look}};
  const double left = share(*view, scene, beside());
  EXPECT_NEAR(left, with_echo(std::exp(-depth_upwards())), kOfShare);
  // Moved aside, it leaves the floor in the light; enlarged twice, it is as opaque as before.
  scene.volumes[1].world_from_volume.translation_m = {0.2, 0.0, 0.0};
  EXPECT_NEAR(share(*view, scene, beside()), 1.0, kOfShare);
  scene.volumes[1].world_from_volume.translation_m = {0.0, 0.01, 0.0};
  scene.volumes[1].world_from_volume.scale = glm::dvec3(2.0);
  EXPECT_NEAR(share(*view, scene, beside()), left, kOfShare);
}

TEST_F(LightGridTest, MakesNothingBrighter) {
  // Films of segments have steep borders, between which the mean colour is a quotient of small
  // differences.
  constexpr PictureSize kFilmSize{96, 96};
  const auto distance = [](double radius_mm) {
    return still_volume(kEdge, 1.0, [=](glm::dvec3 x) { return radius_mm - glm::length(x); })
        ->frames;
  };
  MovingVolume moving = *still_volume(kEdge, 1.0, [](glm::dvec3 mm) {
    return std::abs(glm::length(mm) - 20.0) < 4.0 ? kHazeValue : 0.0;
  });
  moving.segments = {{"outer", {0.95F, 0.80F, 0.30F}, distance(24.5)},
                     {"inner", {0.30F, 0.60F, 0.95F}, distance(15.5)}};
  const auto volume = std::make_shared<const MovingVolume>(std::move(moving));
  auto view = renderer({kFilmSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, white(0.02, 0.5, 0.5)}};
  scene.volumes[0].segment_opacity = 0.4;
  const Eye eye = eye_at({0.05, 0.06, 0.15}, {0.0, 0.0, 0.0}, 0.5, kFilmSize);
  const Picture without = draw(*view, scene, {eye}, kFilmSize)[0];
  scene.shadows = 1.0;
  const Picture with = draw(*view, scene, {eye}, kFilmSize)[0];
  int darker = 0;
  for (int y = 0; y < kFilmSize.height; ++y)
    for (int x = 0; x < kFilmSize.width; ++x)
      for (int c = 0; c < 3; ++c) {
        ASSERT_LE(channel(with, x, y, c), channel(without, x, y, c) + 2) << x << ", " << y;
        darker += channel(with, x, y, c) + 5 < channel(without, x, y, c);
      }
  EXPECT_GT(darker, 500);
}

TEST_F(LightGridTest, IsMadeAnewWheneverSomethingChanges) {
  // Each picture must be that of a renderer that draws it first.
  MovingVolume two = *still_volume(24, 2.0, floor_and_slab);
  two.frames.push_back(still_volume(24, 2.0, [](glm::dvec3 mm) {
                         return glm::length(mm) < 14.0 ? kFloorValue : 0.0;
                       })->frames[0]);
  two.times.times_s = {0.0, 1.0};
  const auto volume = std::make_shared<const MovingVolume>(std::move(two));
  auto view = renderer({kGridSize, 1});
  set(*view, {volume});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, white(0.02, 0.5, 0.5)}};
  scene.shadows = 0.8;
  const Eye eye = eye_at({0.1, 0.1, 0.25}, {0.0, 0.0, 0.0}, 0.5, kGridSize);
  const Eye aside = eye_at({-0.2, 0.1, 0.2}, {0.0, 0.0, 0.0}, 0.5, kGridSize);
  const auto expect_fresh = [&](const Eye& from, const char* what) {
    auto fresh = renderer({kGridSize, 1});
    set(*fresh, {volume});
    const Picture expected = draw(*fresh, scene, {from}, kGridSize)[0];
    EXPECT_EQ(draw(*view, scene, {from}, kGridSize)[0].colours, expected.colours) << what;
    const double shadows = scene.shadows;
    scene.shadows = 0.0;
    EXPECT_NE(draw(*fresh, scene, {from}, kGridSize)[0].colours, expected.colours) << what;
    scene.shadows = shadows;
  };
  expect_fresh(eye, "the first one");
  expect_fresh(aside, "the light turns with the eye");
  scene.volumes[0].pointer = {0, 0.5};
  expect_fresh(aside, "another phase");
  scene.shadows = 0.0;
  scene.volumes[0].pointer = {1, 0.0};
  draw(*view, scene, {aside}, kGridSize);
  scene.shadows = 0.8;
  expect_fresh(aside, "a phase that came while there were no shadows");
  scene.clips = {{{0.0, 0.0, -1.0}, -0.005}};
  expect_fresh(eye, "a cut");
  scene.volumes[0].world_from_volume.translation_m = {0.01, 0.0, 0.0};
  expect_fresh(eye, "another place");
  scene.volumes[0].look = white(0.05, 0.5, 0.5);
  expect_fresh(eye, "another look");
}

TEST_F(LightGridTest, IsKeptWhereTheSceneMovesAsAWhole) {
  const auto volume = still_volume(24, 2.0, floor_and_slab);
  const auto other =
      still_volume(24, 1.5, [](glm::dvec3 mm) { return glm::length(mm) < 14.0 ? 0.25 : 0.0; });
  auto view = renderer({kGridSize, 1});
  set(*view, {volume, other});
  ViewScene scene;
  scene.volumes = {{volume, {}, {}, white(0.02, 0.5, 0.5)}, {other, {}, {}, white(0.1, 0.5, 0.5)}};
  scene.volumes[0].world_from_volume.scale = {1.0, 1.2, 0.9};
  scene.volumes[1].world_from_volume.translation_m = {0.004, 0.006, 0.0};
  scene.shadows = 0.8;
  const ViewScene before = scene;
  const Eye eye = eye_at({0.1, 0.1, 0.25}, {0.0, 0.0, 0.0}, 0.5, kGridSize);
  const Picture first = draw(*view, scene, {eye}, kGridSize)[0];
  EXPECT_EQ(view->statistics().light_made, 1);
  // Volumes and eye are moved, turned and enlarged together.
  const Transform moved{{0.3, -0.2, 1.0},
                        glm::angleAxis(0.9, glm::normalize(glm::dvec3(1.0, -2.0, 0.5))),
                        glm::dvec3(1.7)};
  Eye with = eye;
  with.position_m = moved.world_from_volume(eye.position_m);
  with.orientation = moved.rotation * eye.orientation;
  for (ViewVolume& one : scene.volumes) {
    Transform& place = one.world_from_volume;
    place = {moved.world_from_volume(place.translation_m), moved.rotation * place.rotation,
             1.7 * place.scale};
  }
  const Picture again = draw(*view, scene, {with}, kGridSize)[0];
  EXPECT_EQ(view->statistics().light_made, 1);
  for (int y = 0; y < kGridSize.height; ++y)
    for (int x = 0; x < kGridSize.width; ++x)
      ASSERT_NEAR(channel(again, x, y, 0), channel(first, x, y, 0), 3) << x << ", " << y;
  const auto expect_fresh = [&](const char* what) {
    auto fresh = renderer({kGridSize, 1});
    set(*fresh, {volume, other});
    const Picture expected = draw(*fresh, scene, {eye}, kGridSize)[0];
    const Picture found = draw(*view, scene, {eye}, kGridSize)[0];
    for (int y = 0; y < kGridSize.height; ++y)
      for (int x = 0; x < kGridSize.width; ++x)
        ASSERT_NEAR(channel(found, x, y, 0), channel(expected, x, y, 0), 1) << what;
  };
  // Only moved: the light falls as before.
  scene = before;
  for (ViewVolume& one : scene.volumes) one.world_from_volume.translation_m.x += 0.01;
  expect_fresh("moved");
  EXPECT_EQ(view->statistics().light_made, 1);
  // Turned below the light: what takes the light is the same.
  scene = before;
  const glm::dquat turn = glm::angleAxis(0.3, glm::dvec3(0.0, 1.0, 0.0));
  for (ViewVolume& one : scene.volumes) {
    Transform& place = one.world_from_volume;
    place.translation_m = turn * place.translation_m;
    place.rotation = turn * place.rotation;
  }
  expect_fresh("turned");
  EXPECT_EQ(view->statistics().light_made, 2);
  EXPECT_EQ(view->statistics().light_turned, 1);
  // One of them moved against the other.
  scene.volumes[1].world_from_volume.translation_m.y += 0.004;
  expect_fresh("apart");
  EXPECT_EQ(view->statistics().light_made, 3);
  EXPECT_EQ(view->statistics().light_turned, 1);
  // Both moved against a plane that cuts them.
  scene.clips = {{{0.0, 0.0, -1.0}, -0.005}};
  expect_fresh("cut");
  for (ViewVolume& one : scene.volumes) one.world_from_volume.translation_m.z += 0.004;
  expect_fresh("moved against the plane");
  EXPECT_EQ(view->statistics().light_made, 5);
  EXPECT_EQ(view->statistics().light_turned, 1);
}

}  // namespace
}  // namespace palpate::test
