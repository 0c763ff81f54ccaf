// Pictures in a host's images. Oracle: the same picture by the renderer alone, cut by a plane at
// the host's surface and on a background of the host's colour.
#include "module/view/host_images.h"

#include <cmath>
#include <cstring>
#include <optional>

#include "tests/view/host_image.h"
#include "tests/view/view_scenes.h"

namespace palpate::test {
namespace {

constexpr PictureSize kHostSize{96, 64};
constexpr double kNear_m = 0.05, kFar_m = 2.0;  // of the host's camera
constexpr uint32_t kHost = 0xff4080c0u;         // its colour: A, B, G, R
constexpr int kRounding = 1;                    // of 255

/// A host camera's depth convention, and its formats.
struct Convention {
  const char* name;
  VkFormat colour, depth;
  bool reversed = false;

  double inverse_0() const { return reversed ? 0.0 : 1.0 / kNear_m; }
  double inverse_1() const { return reversed ? 1.0 / kNear_m : 1.0 / kFar_m; }
  double of(double z_m) const {
    return std::clamp((1.0 / z_m - inverse_0()) / (inverse_1() - inverse_0()), 0.0, 1.0);
  }
  uint32_t word(double z_m) const {
    if (depth == VK_FORMAT_X8_D24_UNORM_PACK32) return uint32_t(std::lround(of(z_m) * 0xffffff));
    const float d = float(of(z_m));
    uint32_t bits;
    std::memcpy(&bits, &d, 4);
    return bits;
  }
  double z_m(uint32_t bits) const {
    double d = double(bits & 0xffffff) / 0xffffff;
    if (depth != VK_FORMAT_X8_D24_UNORM_PACK32) {
      float value;
      std::memcpy(&value, &bits, 4);
      d = double(value);
    }
    return 1.0 / (inverse_0() + (inverse_1() - inverse_0()) * d);
  }
  bool swapped() const { return colour == VK_FORMAT_B8G8R8A8_UNORM; }
};

uint32_t swap(uint32_t c) {
  return (c & 0xff00ff00u) | (c & 0xffu) << 16 | (c >> 16 & 0xffu);
}

class HostImagesTest : public ViewTest, public ::testing::WithParamInterface<Convention> {
 protected:
  void SetUp() override {
    ViewTest::SetUp();
    if (IsSkipped()) return;
    const Convention& of = GetParam();
    VkFormatProperties can;
    vkGetPhysicalDeviceFormatProperties(context()->physical_device(), of.depth, &can);
    if (!(can.optimalTilingFeatures & VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT))
      GTEST_SKIP() << "This device has no depth images of this format.";
    colour_.emplace(context(), kHostSize, of.colour, VK_IMAGE_ASPECT_COLOR_BIT,
                    VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    depth_.emplace(context(), kHostSize, of.depth, VK_IMAGE_ASPECT_DEPTH_BIT,
                   VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
    // What is interpolated differs between the two: over the background, or the light of volumes
    // alone.
    RendererOptions options{kHostSize, 2};
    options.smooth = 0.0;
    view_ = renderer(options);
    ball_ = still_volume(
        64, 1.0, [](glm::dvec3 x) { return std::clamp(12.0 - glm::length(x) + 0.5, 0.0, 1.0); });
    set(*view_, {ball_});
    Look look{"ball", {}, {0.6, 0.5, 0.0}, 0.0};
    look.points = {{0.45, {0.9, 0.1, 0.1}, 0.0}, {0.55, {0.9, 0.1, 0.1}, 0.08}};
    scene_.volumes = {{ball_, {}, {}, look}};
    // A rod through the ball.
    scene_.things.push_back({{-0.02, 0.0, 0.0}, {0.02, 0.004, 0.0}, 0.002, 0.002, {0.1, 0.1, 0.9}});
    split_eyes(eye_at({0.0, 0.0, kAway_m}, {0.0, 0.0, 0.0}, 0.3, kHostSize), 0.02, eyes_[0],
               eyes_[1]);
  }

  uint32_t host_colour() const { return GetParam().swapped() ? swap(kHost) : kHost; }

  /// Fills the host's images with its colour at a depth, draws, and returns its pixels (R lowest).
  std::vector<uint32_t> drawn(double z_m, bool with_depth, int eye) {
    const std::vector<uint32_t> colours(colour_->pixels(), host_colour());
    const std::vector<uint32_t> depths(colour_->pixels(), GetParam().word(z_m));
    for (uint32_t layer = 0; layer < 2; ++layer) {
      colour_->fill(layer, colours);
      depth_->fill(layer, depths);
    }
    HostImages images;
    images.colour_format = GetParam().colour;
    images.depth_format = GetParam().depth;
    for (uint32_t e = 0; e < 2; ++e)
      images.eyes[e] = {colour_->handle(), e, with_depth ? depth_->handle() : VK_NULL_HANDLE, e};
    images.inverse_depth_0 = GetParam().inverse_0();
    images.inverse_depth_1 = GetParam().inverse_1();
    images.writes_depth = true;
    const Status started = view_->start(scene_, eyes_, kHostSize, images);
    EXPECT_TRUE(started) << (started ? "" : started.error().message);
    EXPECT_TRUE(view_->wait());
    std::vector<uint32_t> pixels = colour_->read(uint32_t(eye));
    if (GetParam().swapped())
      for (uint32_t& pixel : pixels) pixel = swap(pixel);
    return pixels;
  }

  /// The renderer's own picture on a background of the host's colour, cut beyond z.
  Picture expected(double z_m, int eye) {
    ViewScene scene = scene_;
    scene.background_top = scene.background_bottom =
        glm::dvec3(kHost & 0xff, kHost >> 8 & 0xff, kHost >> 16 & 0xff) / 255.0;
    const glm::dvec3 ahead = eyes_[0].orientation * glm::dvec3(0.0, 0.0, -1.0);
    if (z_m > 0.0) scene.clips.push_back({-ahead, -glm::dot(ahead, eyes_[0].position_m) - z_m});
    return draw(*view_, scene, {eyes_[0], eyes_[1]}, kHostSize)[size_t(eye)];
  }

  static constexpr double kAway_m = 0.15;
  std::optional<HostImage> colour_, depth_;
  std::unique_ptr<VolumeRenderer> view_;
  std::shared_ptr<const MovingVolume> ball_;
  ViewScene scene_;
  std::array<Eye, 2> eyes_;
};

TEST_P(HostImagesTest, AreTheBackgroundWhereTheyHaveNoDepth) {
  for (int eye = 0; eye < 2; ++eye) {
    const auto pixels = drawn(1.0, false, eye);
    const Picture alone = expected(0.0, eye);
    int changed = 0;
    for (size_t p = 0; p < pixels.size(); ++p) {
      ASSERT_LE(worst_channel(pixels[p], alone.colours[p]), kRounding) << "pixel " << p;
      changed += pixels[p] != kHost;
    }
    EXPECT_GT(changed, 500);
    EXPECT_LT(changed, int(pixels.size()) / 2);
  }
}

TEST_P(HostImagesTest, HideWhatLiesBehindThem) {
  // In the middle of the ball, without the rod, whose edges blend with the background.
  scene_.things.clear();
  const double middle_m = kAway_m + 0.002;
  for (int eye = 0; eye < 2; ++eye) {
    const auto pixels = drawn(middle_m, true, eye);
    const Picture alone = expected(middle_m, eye), all = expected(0.0, eye);
    int cut = 0;
    for (size_t p = 0; p < pixels.size(); ++p) {
      ASSERT_LE(worst_channel(pixels[p], alone.colours[p]), kRounding) << "pixel " << p;
      cut += worst_channel(pixels[p], all.colours[p]) > 3;
    }
    EXPECT_GT(cut, 300) << "the plane cuts nothing away";
  }
}

TEST_P(HostImagesTest, KeepTheirBytesInFrontOfEverything) {
  const auto pixels = drawn(0.06, true, 0);
  for (const uint32_t pixel : pixels) ASSERT_EQ(pixel, kHost);
  for (const uint32_t word : depth_->read(0)) ASSERT_EQ(word, GetParam().word(0.06));
}

TEST_P(HostImagesTest, GetTheDepthWhereAVolumeTakesHalfOfTheLight) {
  drawn(1.0, true, 1);
  const std::vector<uint32_t> words = depth_->read(1);
  const Picture alone = expected(0.0, 1);
  constexpr double kRendererNear_m = 0.02;
  int taken = 0;
  for (size_t p = 0; p < words.size(); ++p) {
    if (alone.depths[p] == 0.0F) {
      ASSERT_EQ(words[p], GetParam().word(1.0)) << "pixel " << p;
      continue;
    }
    ++taken;
    ASSERT_NEAR(GetParam().z_m(words[p]), kRendererNear_m / double(alone.depths[p]), 1e-4);
  }
  EXPECT_GT(taken, 300);
}

TEST_P(HostImagesTest, ThatCanNotBeDrawnIntoAreRefused) {
  HostImages images;
  EXPECT_FALSE(view_->start(scene_, eyes_, kHostSize, images));
  images.colour_format = GetParam().colour;
  EXPECT_FALSE(view_->start(scene_, eyes_, kHostSize, images)) << "an eye without an image";
  for (uint32_t e = 0; e < 2; ++e) images.eyes[e] = {colour_->handle(), e, VK_NULL_HANDLE, 0};
  images.eyes[1].depth = depth_->handle();
  EXPECT_FALSE(view_->start(scene_, eyes_, kHostSize, images)) << "one depth image of two";
  images.eyes[0].depth = depth_->handle();
  images.depth_format = VK_FORMAT_D16_UNORM;
  EXPECT_FALSE(view_->start(scene_, eyes_, kHostSize, images)) << "16 bits";
  images.depth_format = GetParam().depth;
  const Status meaningless = view_->start(scene_, eyes_, kHostSize, images);
  ASSERT_FALSE(meaningless);
  EXPECT_EQ(meaningless.error().kind, ErrorKind::kBadInput);
}

INSTANTIATE_TEST_SUITE_P(, HostImagesTest,
                         ::testing::Values(Convention{"Rgba", VK_FORMAT_R8G8B8A8_SRGB,
                                                      VK_FORMAT_D32_SFLOAT},
                                           Convention{"BgraReversed", VK_FORMAT_B8G8R8A8_UNORM,
                                                      VK_FORMAT_D32_SFLOAT, true},
                                           Convention{"Depth24", VK_FORMAT_R8G8B8A8_UNORM,
                                                      VK_FORMAT_X8_D24_UNORM_PACK32}),
                         [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace palpate::test
