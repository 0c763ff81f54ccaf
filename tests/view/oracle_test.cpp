// Whole pictures compared with the integral that they represent.
#include "tests/view/picture_file.h"
#include "tests/view/slow_rays.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kOracleSize{36, 36};
constexpr double kStepsPerVoxel = 8.0;
// The requirement for pictures whose speed is compared; from about 40 dB differences are not
// visible.
constexpr double kOracleAlike_db = 40.0;

class OracleTest : public ViewTest {
 protected:
  /// Draws a scene both ways; with PALPATE_LOOK=DIR both pictures are stored there for inspection.
  double alike_db(const ViewScene& scene, const Eye& eye, const std::string& name) {
    RendererOptions options{kOracleSize, 1};
    auto view = renderer(options);
    set(*view, {scene.volumes[0].data});
    const Picture fast = draw(*view, scene, {eye}, kOracleSize)[0];
    const Picture slow = slow_picture(scene, eye, kOracleSize, kStepsPerVoxel, options.near_m);
    if (const char* folder = std::getenv("PALPATE_LOOK")) {
      EXPECT_TRUE(write_png(fast, std::string(folder) + "/" + name + "_fast.png"));
      EXPECT_TRUE(write_png(slow, std::string(folder) + "/" + name + "_slow.png"));
    }
    const double db = psnr_db(fast, slow);
    std::printf("%s: %.1f dB\n", name.c_str(), db);
    return db;
  }
  const Eye eye_ = eye_at({0.08, 0.06, 0.16}, {0, 0, 0}, 0.5, kOracleSize);
};

TEST_F(OracleTest, OfTheBeatingHeartBetweenItsFrames) {
  ViewScene scene;
  scene.volumes = {{beating_heart(), {}, {0, 0.6}, *preset_look("phantom")}};
  EXPECT_GT(alike_db(scene, eye_, "heart"), kOracleAlike_db);
}

TEST_F(OracleTest, OfTheHeartCutOpenTurnedAndEnlarged) {
  ViewScene scene;
  Transform place;
  place.rotation = glm::angleAxis(0.5, glm::normalize(glm::dvec3(1, 2, 0)));
  place.scale = glm::dvec3(1.5);
  place.translation_m = {0.01, 0.0, -0.02};
  scene.volumes = {{beating_heart(), place, {2, 0.3}, *preset_look("phantom")}};
  scene.clips = {{glm::normalize(glm::dvec3(-1.0, 0.2, -0.6)), -0.005}};
  EXPECT_GT(alike_db(scene, eye_, "cut"), kOracleAlike_db);
}

TEST_F(OracleTest, OfTheHeartCarriedByOneMotion) {
  ViewScene scene;
  const auto heart = carried_heart(true);
  for (const FramePointer at : {FramePointer{1, 0.0}, FramePointer{3, 0.6}}) {
    scene.volumes = {{heart, {}, at, *preset_look("phantom")}};
    EXPECT_GT(alike_db(scene, eye_, "carried_" + std::to_string(at.frame)), kOracleAlike_db);
  }
}

TEST_F(OracleTest, FromInsideTheHeartWhereOnlyBordersAreOpaque) {
  ViewScene scene;
  Look look = *preset_look("phantom");
  // The wall's inside is clear, its surfaces are seen through each other.
  look.flat_opacity = 0.05;
  scene.volumes = {{beating_heart(), {}, {1, 0.5}, look}};
  const Eye within = eye_at({0.004, 0.002, 0.006}, {0.03, 0.01, -0.02}, 1.2, kOracleSize);
  EXPECT_GT(alike_db(scene, within, "inside"), kOracleAlike_db);
}

TEST_F(OracleTest, OfAMistWithColoursOfItsOwn) {
  const auto mist = still_volume(48, 2.0, [](glm::dvec3 x) {
    return 500.0 + 400.0 * std::sin(0.07 * x.x + 0.05 * x.y) * std::cos(0.06 * x.z);
  });
  ViewScene scene;
  scene.volumes = {{mist, {}, {}, windowed(*preset_look("flow"), 500.0, 900.0)}};
  for (LookPoint& point : scene.volumes[0].look.points) point.opacity *= 2.0;
  EXPECT_GT(alike_db(scene, eye_, "mist"), kOracleAlike_db);
}

// The way past empty space is smaller than the distance of two floats there: a ray must still
// advance.
TEST_F(OracleTest, OfASmallBallFromThirtyThousandVoxelsAway) {
  const auto ball = still_volume(64, 0.02, [](glm::dvec3 x) {
    return 1000.0 / (1.0 + std::exp(50.0 * (glm::length(x) - 0.3)));
  });
  ViewScene scene;
  scene.volumes = {{ball, {}, {}, windowed(*preset_look("phantom"), 500.0, 900.0)}};
  for (LookPoint& point : scene.volumes[0].look.points)
    point.opacity = std::min(0.99, 20.0 * point.opacity);
  const Eye far_away = eye_at({0.3, 0.2, 0.5}, {0, 0, 0}, 0.002, kOracleSize);
  EXPECT_GT(alike_db(scene, far_away, "far"), kOracleAlike_db);
}

// Steps along a ray are counted in voxels, so that the quality does not depend on the spacing.
TEST_F(OracleTest, OfTheSameMistInSamplesOfAnyDistance) {
  for (const double spacing_mm : {0.4, 10.0}) {
    const double per_mm = 2.0 / spacing_mm;
    const auto mist = still_volume(48, spacing_mm, [=](glm::dvec3 x) {
      x *= per_mm;
      return 500.0 + 400.0 * std::sin(0.28 * x.x + 0.2 * x.y) * std::cos(0.24 * x.z);
    });
    ViewScene scene;
    Transform place;
    place.scale = glm::dvec3(per_mm);
    scene.volumes = {{mist, place, {}, windowed(*preset_look("flow"), 500.0, 900.0)}};
    for (LookPoint& point : scene.volumes[0].look.points)
      point.opacity = std::min(0.9, 2.0 * per_mm * point.opacity);
    EXPECT_GT(alike_db(scene, eye_, "mist_" + std::to_string(spacing_mm)), kOracleAlike_db)
        << spacing_mm;
  }
}

}  // namespace
}  // namespace palpate::test
