// Pixels that are interpolated instead of drawn: what they look like, and which may not be.
#include "module/view/ray_lattice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "module/scene/look.h"
#include "module/view/visible_pixels.h"
#include "tests/view/host_image.h"
#include "tests/view/slow_rays.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

class RayLatticeTest : public ViewTest {
 protected:
  /// The scene with rays of all pixels, then as by default.
  std::array<Picture, 2> both(const ViewScene& scene, const std::vector<Eye>& eyes,
                              PictureSize size) {
    std::array<Picture, 2> pictures;
    for (const bool all : {true, false}) {
      RendererOptions options{size, int(eyes.size())};
      options.count_samples = true;
      if (all) options.smooth = 0.0;
      const auto view = renderer(options);
      std::vector<std::shared_ptr<const MovingVolume>> volumes;
      for (const ViewVolume& volume : scene.volumes) volumes.push_back(volume.data);
      set(*view, volumes);
      pictures[all ? 0 : 1] = draw(*view, scene, eyes, size)[0];
      taken_[all ? 0 : 1] = double(view->statistics().samples_taken);
    }
    return pictures;
  }

  double share_taken() const { return taken_[1] / taken_[0]; }
  std::array<double, 2> taken_{};
};

ViewScene heart() {
  ViewScene scene;
  scene.volumes = {{beating_heart(), {}, {}, *preset_look("phantom")}};
  return scene;
}

/// Smooth everywhere.
ViewScene soft_ball(int size, double spacing_mm, double per_mm) {
  const double sigma_mm = 0.16 * size * spacing_mm;
  const auto value = [=](glm::dvec3 x) {
    return std::exp(-glm::dot(x, x) / (2.0 * sigma_mm * sigma_mm));
  };
  ViewScene scene;
  scene.volumes = {{still_volume(size, spacing_mm, value), {}, {}, proportional_look(per_mm)}};
  return scene;
}

Eye before(PictureSize size) {
  return eye_at({0.02, 0.05, 0.3}, {0.0, 0.0, 0.0}, 0.45, size);
}

TEST_F(RayLatticeTest, SmoothPicturesTakeAThirdOfTheSamplesAndLookTheSame) {
  const PictureSize size{256, 256};
  const auto [all, fewer] = both(soft_ball(64, 2.0, 0.05), {before(size)}, size);
  EXPECT_GT(psnr_db(all, fewer), 50.0);
  EXPECT_LT(share_taken(), 1.0 / 3.0);
  // Where hardly half of the light is taken, the depth at which it is jumps.
  int surfaces = 0, other = 0;
  for (size_t p = 0; p < all.depths.size(); ++p)
    if (all.depths[p] > 0.0F && fewer.depths[p] > 0.0F) {
      ++surfaces;
      other += std::abs(fewer.depths[p] - all.depths[p]) > 0.02 * all.depths[p];
    }
  EXPECT_GT(surfaces, 1000);
  EXPECT_LT(other, surfaces * 3 / 100);
}

TEST_F(RayLatticeTest, EdgesStayWhereTheyAre) {
  const PictureSize size{256, 256};
  const auto [all, fewer] = both(heart(), {before(size)}, size);
  EXPECT_GT(psnr_db(all, fewer), 45.0);
  EXPECT_LT(share_taken(), 0.9);
  int off = 0;
  for (size_t p = 0; p < all.colours.size(); ++p)
    off += worst_channel(all.colours[p], fewer.colours[p]) > 16;
  EXPECT_LT(off, 20);
}

/// Nothing of a plate that is seen as a line of two pixels is left out, wherever it lies.
TEST_F(RayLatticeTest, LinesOfTwoVoxelsHaveNoGaps) {
  const PictureSize size{256, 256};
  for (const double tilt : {0.0, 0.03, 0.4}) {
    ViewScene scene;
    scene.volumes = {{still_volume(64, 2.0,
                                   [&](glm::dvec3 x) {
                                     const double off =
                                         std::abs(x.y * std::cos(tilt) + x.x * std::sin(tilt));
                                     return std::clamp(2.5 - off, 0.0, 1.0);
                                   }),
                      {},
                      {},
                      step_look(0.5)}};
    const auto [all, fewer] =
        both(scene, {eye_at({0.0, 0.001, 0.5}, {0.0, 0.001, 0.0}, 0.45, size)}, size);
    int covered = 0;
    for (size_t p = 0; p < all.colours.size(); ++p) {
      const bool is_covered = all.colours[p] >> 24 > 128U;
      covered += is_covered;
      ASSERT_EQ(fewer.colours[p] >> 24 > 128U, is_covered) << "tilt " << tilt << ", pixel " << p;
    }
    EXPECT_GT(covered, 200);
  }
}

/// After the last pixels of an even size no point of the lattice follows.
TEST_F(RayLatticeTest, PixelsOnABorderAreDrawn) {
  for (const PictureSize size : {PictureSize{65, 63}, PictureSize{64, 66}, PictureSize{16, 17}}) {
    const auto [all, fewer] = both(soft_ball(64, 4.0, 0.05),
                                   {eye_at({0.0, 0.0, 0.2}, {0.0, 0.0, 0.0}, 0.45, size)}, size);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x)
        if ((x % 2 == 1 && x == size.width - 1) || (y % 2 == 1 && y == size.height - 1)) {
          const size_t p = size_t(x) + size_t(y) * size_t(size.width);
          ASSERT_EQ(fewer.colours[p], all.colours[p]) << x << ", " << y;
        }
    EXPECT_GT(psnr_db(all, fewer), 40.0) << size.width;
  }
}

TEST_F(RayLatticeTest, PixelsOfThingsAndBesideThemAreDrawn) {
  const PictureSize size{128, 128};
  ViewScene scene = heart();
  // A rod, and dots smaller than a pixel, of which many lie between points of the lattice.
  scene.things.push_back({{-0.03, 0.01, 0.05}, {0.04, -0.02, 0.05}, 0.0015, 0.0015, {1, 1, 1}});
  for (int k = 0; k < 40; ++k) {
    const glm::dvec3 at_m(-0.06 + 0.003 * k, -0.04 + 0.0008 * k, 0.05);
    scene.things.push_back({at_m, at_m, 3e-4, 3e-4, {1, 1, 1}});
  }
  const auto [all, fewer] = both(scene, {before(size)}, size);
  ViewScene without = heart();
  const Picture none = both(without, {before(size)}, size)[0];
  int on_things = 0;
  for (size_t p = 0; p < all.colours.size(); ++p)
    if (all.colours[p] != none.colours[p]) {
      ++on_things;
      ASSERT_EQ(fewer.colours[p], all.colours[p]) << "pixel " << p;
      ASSERT_EQ(fewer.depths[p], all.depths[p]) << "pixel " << p;
    }
  EXPECT_GT(on_things, 100);
}

TEST_F(RayLatticeTest, HiddenPixelsAreNotMixedIntoThoseBesideThem) {
  const PictureSize size{128, 128};
  const std::vector<Eye> eyes{before(size)};
  std::array<Picture, 2> pictures;
  VisiblePixels disc{size, 1, std::vector<uint64_t>(256)};
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x)
      if (std::hypot(x - 63.5, y - 63.5) < 41.0)
        disc.tiles[size_t(x / 8 + 16 * (y / 8))] |= uint64_t(1) << (x % 8 + 8 * (y % 8));
  const auto seen = std::make_shared<const VisiblePixels>(disc);
  for (const bool all : {true, false}) {
    RendererOptions options{size, 1};
    if (all) options.smooth = 0.0;
    const auto view = renderer(options);
    set(*view, {beating_heart()});
    ASSERT_TRUE(view->start(heart(), eyes, size, seen));
    auto picture = view->read_back(0);
    ASSERT_TRUE(picture);
    pictures[all ? 0 : 1] = *picture;
  }
  int at_the_edge = 0;
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      const size_t p = size_t(x + 128 * y);
      const double from_middle = std::hypot(x - 63.5, y - 63.5);
      if (!disc.visible(0, x, y)) {
        ASSERT_EQ(pictures[1].colours[p], 0U);
      } else if (from_middle > 38.0) {
        ++at_the_edge;
        ASSERT_LE(worst_channel(pictures[1].colours[p], pictures[0].colours[p]), 3)
            << x << ", " << y;
      }
    }
  EXPECT_GT(at_the_edge, 500);
}

TEST_F(RayLatticeTest, EachEyeHasItsOwnRule) {
  // The second one sees the voxels smaller than pixels.
  const PictureSize size{256, 256};
  const std::vector<Eye> eyes{eye_at({0.0, 0.0, 0.12}, {0.0, 0.0, 0.0}, 0.4, size),
                              eye_at({0.0, 0.0, 0.3}, {0.0, 0.0, 0.0}, 0.6, size)};
  const ViewScene scene = soft_ball(128, 0.5, 0.1);
  std::array<std::vector<Picture>, 2> pictures;
  for (const bool all : {true, false}) {
    RendererOptions options{size, 2};
    if (all) options.smooth = 0.0;
    const auto view = renderer(options);
    set(*view, {scene.volumes[0].data});
    pictures[all ? 0 : 1] = draw(*view, scene, eyes, size);
  }
  EXPECT_NE(pictures[0][0].colours, pictures[1][0].colours);
  EXPECT_EQ(pictures[0][1].colours, pictures[1][1].colours);
  EXPECT_EQ(pictures[0][1].depths, pictures[1][1].depths);
}

/// A plate before another one, both of one colour in any light: no pixel is between them.
TEST_F(RayLatticeTest, DepthsAreThoseOfOneSurface) {
  const PictureSize size{256, 256};
  Look look = step_look(0.5);
  look.shine = {1.0, 0.0, 0.0};
  const auto value = [](glm::dvec3 x) {
    const bool front = x.x + 0.3 * x.y < 3.0;
    return std::clamp(5.0 - std::abs(x.z - (front ? 30.0 : -30.0)), 0.0, 1.0);
  };
  ViewScene scene;
  scene.volumes = {{still_volume(64, 2.0, value), {}, {}, look}};
  const auto [all, fewer] =
      both(scene, {eye_at({0.0, 0.0, 0.3}, {0.0, 0.0, 0.0}, 0.3, size)}, size);
  int wrong = 0, front = 0, back = 0;
  for (size_t p = 0; p < all.depths.size(); ++p) {
    front += all.depths[p] > 0.02F / 0.28F;
    back += all.depths[p] > 0.0F && all.depths[p] < 0.02F / 0.32F;
    wrong += std::abs(fewer.depths[p] - all.depths[p]) > 0.01F * all.depths[p];
  }
  EXPECT_GT(front, 10000);
  EXPECT_GT(back, 10000);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(share_taken(), 0.6);
}

/// More workgroups than a list has along x: nearly all pixels of two large pictures of noise.
TEST_F(RayLatticeTest, ListsMayBeLongerThanOneRowOfWorkgroups) {
  const PictureSize size{1280, 1280};
  uint32_t state = 1;
  ViewScene scene;
  scene.volumes = {{still_volume(32, 4.0,
                                 [&](glm::dvec3) {
                                   state = state * 1664525U + 1013904223U;
                                   return double(state >> 8) / double(1 << 24);
                                 }),
                    {},
                    {},
                    proportional_look(3.0)}};
  const std::vector<Eye> eyes(2, eye_at({0.0, 0.0, 0.2}, {0.0, 0.0, 0.0}, 0.5, size));
  std::array<std::vector<Picture>, 2> pictures;
  for (const bool all : {true, false}) {
    RendererOptions options{size, 2};
    options.samples_per_voxel = 0.25;
    options.refines = false;
    options.smooth = all ? 0.0 : 1e-9;
    const auto view = renderer(options);
    set(*view, {scene.volumes[0].data});
    pictures[all ? 0 : 1] = draw(*view, scene, eyes, size);
  }
  for (int eye : {0, 1}) {
    int other = 0;
    for (size_t p = 0; p < pictures[0][0].colours.size(); ++p)
      other += pictures[0][size_t(eye)].colours[p] != pictures[1][size_t(eye)].colours[p];
    EXPECT_EQ(other, 0) << eye;
  }
}

/// A host's picture with lines of a pixel behind a soft ball, and a grating inside of it.
TEST_F(RayLatticeTest, AHostsPictureIsNeverInterpolated) {
  const PictureSize size{128, 128};
  const ViewScene scene = soft_ball(64, 1.0, 0.02);
  const std::vector<Eye> eyes(2, eye_at({0.0, 0.0, 0.15}, {0.0, 0.0, 0.0}, 0.45, size));
  HostImage colour(context(), size, VK_FORMAT_R8G8B8A8_SRGB, VK_IMAGE_ASPECT_COLOR_BIT,
                   VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
  HostImage depth(context(), size, VK_FORMAT_D32_SFLOAT, VK_IMAGE_ASPECT_DEPTH_BIT,
                  VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
  std::vector<uint32_t> lines(colour.pixels()), words(depth.pixels());
  const auto depth_word = [](double z_m) {
    const float d = float((1.0 / 0.02 - 1.0 / z_m) / (1.0 / 0.02 - 1.0 / 5.0));
    uint32_t word;
    std::memcpy(&word, &d, 4);
    return word;
  };
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      lines[size_t(x + 128 * y)] = x % 2 == 0 ? 0xffffffffU : 0xff400000U;
      // In the upper half the lines stand in the ball's middle, in the lower one far behind it.
      words[size_t(x + 128 * y)] = depth_word(y < 64 && x % 2 == 1 ? 0.15 : 4.0);
    }
  HostImages images;
  images.colour_format = VK_FORMAT_R8G8B8A8_SRGB;
  images.depth_format = VK_FORMAT_D32_SFLOAT;
  for (uint32_t e = 0; e < 2; ++e) images.eyes[e] = {colour.handle(), e, depth.handle(), e};
  images.inverse_depth_0 = 1.0 / 0.02;
  images.inverse_depth_1 = 1.0 / 5.0;
  std::array<std::vector<uint32_t>, 2> pixels;
  for (const bool all : {true, false}) {
    for (uint32_t e = 0; e < 2; ++e) {
      colour.fill(e, lines);
      depth.fill(e, words);
    }
    RendererOptions options{size, 2};
    if (all) options.smooth = 0.0;
    const auto view = renderer(options);
    set(*view, {scene.volumes[0].data});
    ASSERT_TRUE(view->start(scene, eyes, size, images));
    ASSERT_TRUE(view->wait());
    pixels[all ? 0 : 1] = colour.read(0);
  }
  int changed = 0, other = 0;
  for (size_t p = 0; p < lines.size(); ++p) {
    changed += pixels[0][p] != lines[p];
    other += pixels[0][p] != pixels[1][p];
    ASSERT_LE(worst_channel(pixels[0][p], pixels[1][p]), 2) << "pixel " << p;
  }
  EXPECT_GT(changed, 4000);
  EXPECT_GT(other, 0) << "nothing was interpolated";
}

TEST_F(RayLatticeTest, WhatIsSmoothMustBeANumberFromZeroOn) {
  for (const double smooth : {-1.0, std::nan("")}) {
    RendererOptions options{{64, 64}, 1};
    options.smooth = smooth;
    const auto made = VolumeRenderer::make(context(), options);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().kind, ErrorKind::kBadInput);
  }
}

}  // namespace
}  // namespace palpate::test
