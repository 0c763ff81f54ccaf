// The mean of pictures of one scene.
#include "module/view/picture_mean.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/view/slow_rays.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

TEST(RayPlaces, SpreadEvenlyOverAPixelFromItsMiddleOn) {
  EXPECT_EQ(ray_place(0).pixels, glm::dvec2(0.0));
  EXPECT_EQ(ray_place(0).steps, 0.0);
  std::array<int, 4> in_quarter{}, in_step{};
  glm::dvec2 sum(0.0);
  for (int n = 0; n < 16; ++n) {
    const RayPlace place = ray_place(n);
    EXPECT_LE(std::max(std::abs(place.pixels.x), std::abs(place.pixels.y)), 0.5);
    EXPECT_GE(place.steps, 0.0);
    EXPECT_LT(place.steps, 1.0);
    sum += place.pixels;
    ++in_quarter[size_t(place.pixels.x > 0.0) + 2 * size_t(place.pixels.y > 0.0)];
    ++in_step[size_t(4.0 * place.steps)];
  }
  EXPECT_LT(glm::length(sum / 16.0), 0.06);
  for (const int count : in_quarter) EXPECT_NEAR(count, 4, 2);
  for (const int count : in_step) EXPECT_NEAR(count, 4, 2);
}

TEST(RayPlaces, MoveTheRaysOfAnEyeBySoManyPixels) {
  const PictureSize size{40, 20};
  const Eye eye = eye_at({0.1, 0.2, 0.3}, {0.0, 0.0, 0.0}, 0.6, size);
  const Eye moved = with_rays_at(eye, size, {3.0, 2.0});
  EXPECT_LT(glm::length(ray_of(moved, size, 10, 5) - ray_of(eye, size, 13, 7)), 1e-12);
  EXPECT_EQ(with_rays_at(eye, size, {0.0, 0.0}), eye);
}

TEST(PictureMeans, AreOfLightAndCoverage) {
  PictureMean mean;
  mean.add({2, 1, {0xff000000U, 0xff0000ffU}, {0.5F, 0.0F}});
  mean.add({2, 1, {0x00ffffffU, 0xff0000ffU}, {0.25F, 0.1F}});
  EXPECT_EQ(mean.count(), 2);
  const Picture both = mean.mean();
  // Half of the light of white is 188, not 128.
  EXPECT_EQ(both.colours[0], 0x80bcbcbcU);
  EXPECT_EQ(both.colours[1], 0xff0000ffU);
  EXPECT_EQ(both.depths, (std::vector<float>{0.5F, 0.0F}));
  mean.clear();
  mean.add({1, 1, {0xff112233U}, {0.0F}});
  EXPECT_EQ(mean.mean().colours, std::vector<uint32_t>{0xff112233U});
}

class PictureMeanTest : public ViewTest {};

/// Beside the mean of 16 x 16 rays in each pixel, with eight samples per voxel.
TEST_F(PictureMeanTest, IsNearerToThePerfectPictureThanEachOfThem) {
  const PictureSize size{96, 96}, fine_size{16 * 96, 16 * 96};
  const Eye eye = eye_at({0.02, 0.05, 0.3}, {0.0, 0.0, 0.0}, 0.45, size);
  ViewScene scene;
  scene.volumes = {{beating_heart(), {}, {}, *preset_look("phantom")}};
  RendererOptions fine_options{fine_size, 1};
  fine_options.samples_per_voxel = 8.0;
  fine_options.smooth = 0.0;
  const auto fine = renderer(fine_options);
  set(*fine, {beating_heart()});
  const Picture rays = draw(*fine, scene, {eye}, fine_size)[0];
  Picture perfect{size.width, size.height, {}, {}};
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      glm::vec3 light(0.0F);
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i)
          light += light_of(rays.colours[size_t(16 * x + i + fine_size.width * (16 * y + j))]);
      perfect.colours.push_back(colour_of(light / 256.0F));
    }
  const auto view = renderer({size, 1});
  set(*view, {beating_heart()});
  PictureMean mean;
  double one_db = 0.0;
  for (int n = 0; n < 16; ++n) {
    const RayPlace place = ray_place(n);
    scene.samples_moved = place.steps;
    mean.add(draw(*view, scene, {with_rays_at(eye, size, place.pixels)}, size)[0]);
    if (n == 0) one_db = psnr_db(mean.mean(), perfect);
  }
  const double db = psnr_db(mean.mean(), perfect);
  EXPECT_GT(db, one_db + 10.0) << one_db;
  EXPECT_GT(db, 42.0);
}

/// Of a mist without edges the rays' places make no difference, but those of samples do.
TEST_F(PictureMeanTest, SamplesOfItsPicturesLieInDifferentDepths) {
  const PictureSize size{64, 64};
  const Eye eye = eye_at({0.0, 0.0, 0.2}, {0.0, 0.0, 0.0}, 0.45, size);
  ViewScene scene;
  scene.volumes = {
      {still_volume(64, 1.0, [](glm::dvec3 x) { return 0.5 + 0.5 * std::sin(2.0 * x.z); }),
       {},
       {},
       proportional_look(0.05)}};
  RendererOptions options{size, 1};
  options.refines = false;
  options.samples_per_voxel = 0.5;
  const auto view = renderer(options);
  set(*view, {scene.volumes[0].data});
  const Picture before = draw(*view, scene, {eye}, size)[0];
  scene.samples_moved = 0.5;
  const Picture after = draw(*view, scene, {eye}, size)[0];
  EXPECT_NE(before.colours, after.colours);
  EXPECT_GT(psnr_db(before, after), 25.0);
  scene.samples_moved = 1.0;
  EXPECT_GT(psnr_db(before, draw(*view, scene, {eye}, size)[0]), 60.0);
}

}  // namespace
}  // namespace palpate::test
