// The picture at the runtime compared with the one that the renderer itself reads back: the same
// device, the same bits. With Vulkan's validation layers.
#include "module/xr/volume_source.h"

#include <cmath>
#include <cstring>

#include "compute/volume/phantom.h"
#include "compute/vulkan/kernel.h"
#include "module/scene/built_in.h"
#include "module/scene/make_volume.h"
#include "tests/toolkit/lost_device.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

class VolumeSourceTest : public XrTest {
 protected:
  /// Steps until the condition holds, but not for ever: what draws is made beside the frames.
  template <class Condition>
  bool stepped_until(xr::Headset& headset, const Condition& holds) {
    for (int k = 0; k < 60'000 && !holds(); ++k) {
      now_ns_ += 11'111'111;
      headset.step(now_ns_);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return holds();
  }
};

std::shared_ptr<const MovingVolume> small_heart() {
  VolumeSpec spec;
  spec.name = "heart";
  VolumeData data;
  data.frames = shell_phantom(32, 2);
  auto built = build(spec, std::move(data));
  return built ? std::make_shared<const MovingVolume>(std::move(*built)) : nullptr;
}

/// The heart at rest in front of a standing user with eyes at 1.6 m.
xr::Show showing(std::shared_ptr<const MovingVolume> heart) {
  const auto volumes =
      std::make_shared<const std::vector<std::shared_ptr<const MovingVolume>>>(1, std::move(heart));
  return [volumes](const xr::HeadsetFrame&) {
    xr::Scenery scenery;
    scenery.volumes = *volumes;
    ViewVolume shown;
    shown.data = volumes->front();
    shown.world_from_volume.translation_m = {0.0, 1.6, -0.3};
    shown.look = *preset_look("CT heart");
    scenery.scene.volumes = {shown};
    return std::optional(scenery);
  };
}

TEST_F(VolumeSourceTest, HandsOverWhatTheRendererDrawsForEachEyeWithItsDepth) {
  const auto heart = small_heart();
  ASSERT_TRUE(heart);
  const std::vector<std::shared_ptr<const MovingVolume>> volumes{heart};
  xr::Scenery last;
  std::array<Eye, 2> eyes;
  xr::VolumeSource drawing([&](const xr::HeadsetFrame& frame) -> std::optional<xr::Scenery> {
    for (size_t eye = 0; eye < 2; ++eye) eyes[eye] = xr::eye_of(frame.eyes[eye]);
    last.volumes = volumes;
    last.scene = {};
    ViewVolume shown;
    shown.data = heart;
    shown.world_from_volume.translation_m = {0.0, 1.6, -0.3};
    shown.pointer.phase = 0.25;
    shown.look = *preset_look("CT heart");
    last.scene.volumes = {shown};
    return last;
  });
  runtime().setup().keep_pictures = true;
  runtime().setup().hidden.clear();
  runtime().setup().view_width = 160;
  runtime().setup().view_height = 120;
  xr::HeadsetOptions options;
  options.validation = true;
  xr::Headset headset(options, drawing);
  // The renderer is made while frames run; the first ones have no picture.
  uint64_t drawn = 0;
  for (int k = 0; k < 60'000 && drawn < 3; ++k) {
    now_ns_ += 11'111'111;
    drawn = headset.step(now_ns_).drawn;
    if (drawn == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(drawn, 3u) << drawing.trouble();
  const std::vector<fake::Picture> pictures = runtime().pictures();
  ASSERT_EQ(pictures.size(), 2u);
  auto renderer = VolumeRenderer::make(headset.context(), {.most = {160, 120}});
  ASSERT_TRUE(renderer);
  ASSERT_TRUE((*renderer)->set_volumes(volumes));
  const PictureSize size = drawing.size();
  ASSERT_EQ(int(pictures[0].width), size.width);
  ASSERT_EQ(int(pictures[0].height), size.height);
  ASSERT_TRUE((*renderer)->start(last.scene, eyes, size));
  for (int eye = 0; eye < 2; ++eye) {
    const auto expected = (*renderer)->read_back(eye);
    ASSERT_TRUE(expected);
    const fake::Picture& shown = pictures[size_t(eye)];
    EXPECT_EQ(shown.rgba, expected->colours) << "eye " << eye;
    EXPECT_EQ(shown.depth, expected->depths) << "eye " << eye;
    // Reversed depth with an infinite far plane: near / depth. The heart's middle is 0.3 m away.
    EXPECT_TRUE(std::isinf(shown.near_m));
    const float nearest = *std::max_element(shown.depth.begin(), shown.depth.end());
    EXPECT_GT(shown.far_m / nearest, 0.2F);
    EXPECT_LT(shown.far_m / nearest, 0.3F);
  }
  EXPECT_NE(pictures[0].rgba, pictures[1].rgba);
  EXPECT_TRUE(headset.context()->validation_active());
  EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
}

/// The renderer draws all views in one pass of one size; each must be as if it were drawn alone.
TEST_F(VolumeSourceTest, DrawsEachViewOfTwoPairsAsThatViewAlone) {
  struct Sizes {
    VkExtent2D wide, focus;
  };
  for (const Sizes& sizes : {Sizes{{64, 48}, {80, 72}}, Sizes{{96, 40}, {56, 64}}})
    for (const VkFormat format : {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB}) {
      SCOPED_TRACE(std::to_string(sizes.wide.width) + " pixels, format " + std::to_string(format));
      runtime().reset();
      fake::Setup& setup = runtime().setup();
      setup.quad_views = true;
      setup.view_width = sizes.wide.width, setup.view_height = sizes.wide.height;
      setup.focus_width = sizes.focus.width, setup.focus_height = sizes.focus.height;
      setup.formats = {format, VK_FORMAT_D32_SFLOAT};
      setup.keep_pictures = true;
      setup.hidden.clear();
      // So slow that every picture reaches its full size, and no other rate to choose.
      setup.rate_hz = 0.01;
      setup.rates_hz.clear();
      // The heart fills the second pair, and both of its edges are beyond the first one's middle.
      runtime().script_head([](XrTime) { return XrPosef{{0, 0, 0, 1}, {0.01F, 1.6F, 0}}; });
      const auto heart = small_heart();
      const xr::Show show = showing(heart);
      std::optional<xr::Scenery> last;
      std::vector<Eye> eyes;
      xr::VolumeSource drawing([&](const xr::HeadsetFrame& frame) {
        eyes.clear();
        for (const xr::EyeView& eye : frame.eyes) eyes.push_back(xr::eye_of(eye));
        last = show(frame);
        // Of several views the first one has the whole gradient.
        last->scene.background_bottom = last->scene.background_top;
        return last;
      });
      xr::HeadsetOptions options;
      options.validation = true;
      xr::Headset headset(options, drawing);
      const int full = int(std::max(sizes.wide.width, sizes.focus.width));
      ASSERT_TRUE(stepped_until(headset, [&] { return drawing.size().width == full; }))
          << drawing.trouble();
      const std::vector<fake::Picture> pictures = runtime().pictures();
      ASSERT_EQ(pictures.size(), 4u);
      auto renderer = VolumeRenderer::make(headset.context(), {.most = {96, 96}});
      ASSERT_TRUE(renderer);
      ASSERT_TRUE((*renderer)->set_volumes(last->volumes));
      for (size_t view = 0; view < 4; ++view) {
        const VkExtent2D size = view < 2 ? sizes.wide : sizes.focus;
        const fake::Picture& shown = pictures[view];
        ASSERT_EQ(shown.width, size.width);
        ASSERT_EQ(shown.height, size.height);
        ASSERT_TRUE(
            (*renderer)->start(last->scene, {&eyes[view], 1}, {int(size.width), int(size.height)}));
        const auto alone = (*renderer)->read_back(0);
        ASSERT_TRUE(alone);
        ASSERT_EQ(shown.rgba.size(), alone->colours.size());
        // Rays differ by a rounding of floats: by a step of 255, at few pixels.
        size_t other = 0, covered = 0;

        for (size_t i = 0; i < shown.rgba.size(); ++i) {
          const uint32_t colour = alone->colours[i];
          covered += colour >> 24 != 0;
          for (int c = 0; c < 4; ++c) {
            const int place = format == VK_FORMAT_B8G8R8A8_SRGB && c < 3 ? 2 - c : c;
            const int got = int(shown.rgba[i] >> (8 * place) & 0xffU);
            const int apart = std::abs(got - int(colour >> (8 * c) & 0xffU));
            other += apart > 0;
            ASSERT_LE(apart, 2) << "view " << view << ", pixel " << i;
          }
          ASSERT_NEAR(shown.depth[i], alone->depths[i], 1e-3) << "view " << view << ", pixel " << i;
        }
        EXPECT_LT(other, shown.rgba.size() / 50) << "view " << view;
        EXPECT_GT(covered, shown.rgba.size() / 20) << "view " << view;
      }
      EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
    }
}

/// In each place where it may happen: while the renderer is made beside the frames, and in a frame.
TEST_F(VolumeSourceTest, DrawsOnANewDeviceAfterItsOwnWasLost) {
  const auto heart = small_heart();
  ASSERT_TRUE(heart);
  xr::VolumeSource drawing(showing(heart));
  xr::Headset headset({}, drawing);
  const auto step_until = [&](const auto& condition) { return stepped_until(headset, condition); };
  for (const bool in_a_frame : {false, true}) {
    const uint64_t before = headset.report().drawn;
    if (in_a_frame) {
      ASSERT_TRUE(step_until([&] { return headset.report().drawn >= before + 2; }));
    }
    lose_vulkan_device();
    // Before its first frame the headset waits, too, without a problem.
    ASSERT_TRUE(step_until([&] {
      return headset.report().state == xr::HeadsetState::kWaiting &&
             !headset.report().problem.message.empty();
    }));
    // At the start the runtime submits first, to make its images, and refuses its call.
    EXPECT_EQ(headset.report().problem.trouble,
              in_a_frame ? xr::Trouble::kNoGraphics : xr::Trouble::kRefused);
    const uint64_t then = headset.report().drawn;
    now_ns_ += 10'000'000'000;
    EXPECT_TRUE(step_until([&] { return headset.report().drawn >= then + 2; }))
        << headset.report().problem.message;
  }
}

/// The left half of a view (side -1) or its right half, as triangles that extend beyond its edges.
std::vector<XrVector2f> half(float side) {
  return {{0, -3}, {3 * side, -3}, {3 * side, 3}, {0, -3}, {3 * side, 3}, {0, 3}};
}

TEST_F(VolumeSourceTest, DrawsNothingWhereTheOpticsHideItAlsoWhenTheRuntimeChangesThat) {
  const auto heart = small_heart();
  xr::VolumeSource drawing(showing(heart));
  runtime().setup().keep_pictures = true;
  // So slow that every picture reaches its full size.
  runtime().setup().rate_hz = 0.01;
  runtime().script_head([](XrTime) { return XrPosef{{0, 0, 0, 1}, {0, 1.6F, 0}}; });
  runtime().setup().hidden.clear();
  xr::HeadsetOptions options;
  options.validation = true;
  xr::Headset headset(options, drawing);
  const int full = int(runtime().setup().view_width);
  const auto drawn_now = [&] {
    const uint64_t before = headset.report().drawn;
    EXPECT_TRUE(stepped_until(headset, [&] {
      return drawing.size().width == full && headset.report().drawn >= before + 2;
    })) << drawing.trouble();
    return runtime().pictures();
  };
  const auto change = [&](std::vector<XrVector2f> hidden) {
    runtime().setup().hidden = std::move(hidden);
    for (const uint32_t view : {0U, 1U}) {
      XrEventDataVisibilityMaskChangedKHR changed{XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR};
      changed.session = runtime().session();
      changed.viewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
      changed.viewIndex = view;
      XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
      std::memcpy(&buffer, &changed, sizeof changed);
      runtime().push_event(buffer);
    }
  };
  const std::vector<fake::Picture> whole = drawn_now();
  ASSERT_EQ(whole.size(), 2u);
  for (const float side : {-1.0F, 1.0F}) {
    change(half(side));
    const std::vector<fake::Picture> pictures = drawn_now();
    ASSERT_EQ(pictures.size(), 2u);
    for (size_t eye = 0; eye < 2; ++eye) {
      const double low = std::tan(eye ? -0.7 : -0.9), high = std::tan(eye ? 0.9 : 0.7);
      int hidden = 0;
      for (size_t i = 0; i < pictures[eye].rgba.size(); ++i) {
        const double pixels = double(pictures[eye].width);
        const double tangent =
            low + (high - low) * (double(i % pictures[eye].width) + 0.5) / pixels;
        // A pixel with a visible neighbour is drawn: the border is one pixel further.
        const bool is_hidden = side * tangent > (high - low) / pixels;
        hidden += is_hidden;
        ASSERT_EQ(pictures[eye].rgba[i], is_hidden ? 0u : whole[eye].rgba[i])
            << "side " << side << ", eye " << eye << ", pixel " << i;
      }
      EXPECT_GT(hidden, 500);
    }
  }
  change({});
  EXPECT_EQ(drawn_now()[0].rgba, whole[0].rgba);
  EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
}

/// A format, and the distance of neighbouring values in linear light: it rounds to the nearest.
struct Stored {
  VkFormat format;
  double step_at(double value) const {
    // The same bytes in another order.
    if (format == VK_FORMAT_R8G8B8A8_SRGB || format == VK_FORMAT_B8G8R8A8_SRGB) return 0.0;
    if (format != VK_FORMAT_R16G16B16A16_SFLOAT) return 1.0 / 255.0;
    return std::ldexp(1.0, std::max(std::ilogb(std::max(value, 1e-30)), -14) - 10);
  }
};

TEST_F(VolumeSourceTest, ShowsTheSameColoursInEveryFormat) {
  const auto heart = small_heart();
  const xr::Show show = showing(heart);
  std::vector<fake::Picture> first;
  for (const Stored stored : {Stored{VK_FORMAT_R8G8B8A8_SRGB}, Stored{VK_FORMAT_B8G8R8A8_SRGB},
                              Stored{VK_FORMAT_R16G16B16A16_SFLOAT},
                              Stored{VK_FORMAT_R8G8B8A8_UNORM}, Stored{VK_FORMAT_B8G8R8A8_UNORM}}) {
    runtime().reset();
    runtime().setup().formats = {stored.format, VK_FORMAT_D32_SFLOAT};
    runtime().setup().keep_pictures = true;
    runtime().script_head([](XrTime) { return XrPosef{{0, 0, 0, 1}, {0, 1.6F, 0}}; });
    // So slow that every picture has the same size.
    runtime().setup().rate_hz = 0.01;
    xr::HeadsetOptions options;
    options.validation = true;
    xr::VolumeSource drawing(show);
    xr::Headset headset(options, drawing);
    const int full = int(runtime().setup().view_width);
    ASSERT_TRUE(stepped_until(headset, [&] { return drawing.size().width == full; }))
        << drawing.trouble();
    const std::vector<fake::Picture> pictures = runtime().pictures();
    ASSERT_EQ(pictures.size(), 2u);
    ASSERT_EQ(pictures[0].format, stored.format);
    EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
    if (first.empty()) first = pictures;
    std::array<double, 3> most{};
    for (size_t eye = 0; eye < 2; ++eye) {
      ASSERT_EQ(pictures[eye].light.size(), first[eye].light.size());
      for (size_t i = 0; i < pictures[eye].light.size(); ++i)
        for (size_t c = 0; c < 4; ++c) {
          const double expected = first[eye].light[i][c], found = pictures[eye].light[i][c];
          // Half a step, and a little for the last bits of the device's pow().
          ASSERT_NEAR(found, expected, 0.51 * stored.step_at(expected))
              << "format " << stored.format << ", eye " << eye << ", pixel " << i << ", part " << c;
          if (c < 3) most[c] = std::max(most[c], found);
        }
      EXPECT_EQ(pictures[eye].depth, first[eye].depth);
    }
    // If red and blue were equal, exchanged channels would not be detected.
    EXPECT_GT(most[0], most[2] + 0.2);
  }
}

// A compilation of a second would block the runtime's loop.
TEST_F(VolumeSourceTest, CompilesNothingInTheFrameLoop) {
  // In small views voxels are smaller than pixels, and rays of all pixels are drawn.
  for (const auto& [hides, width] : {std::pair{false, 64U}, {true, 64U}, {false, 768U}}) {
    runtime().reset();
    runtime().setup().view_width = runtime().setup().view_height = width;
    xr::VolumeSource drawing(showing(small_heart()));
    runtime().setup().hidden = hides ? half(1.0F) : std::vector<XrVector2f>{};
    xr::Headset headset({}, drawing);
    const uint64_t before = vulkan::Kernel::compiled_on_this_thread();
    bool has_prepared = false;
    for (int k = 0; k < 60'000 && headset.report().drawn < 3; ++k) {
      now_ns_ += 11'111'111;
      headset.step(now_ns_);
      has_prepared = has_prepared || drawing.preparing();
      if (drawing.preparing()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(has_prepared);
    EXPECT_EQ(headset.report().drawn, 3U) << drawing.trouble();
    EXPECT_EQ(vulkan::Kernel::compiled_on_this_thread(), before);
  }
}

TEST_F(VolumeSourceTest, KnowsFromItsFirstPicturesWhichPeriodTheyNeed) {
  xr::VolumeSource drawing(showing(small_heart()));
  xr::Headset headset({}, drawing);
  // Per picture: what takes part in its time is not told apart here, so bounds of what it needs.
  double least_s = 1e9, most_s = 0.0, took_s = 0.0, share = 0.0;
  uint64_t drawn = 0;
  for (int k = 0; k < 60'000 && drawn < 31; ++k) {
    now_ns_ += 11'111'111;
    if (headset.step(now_ns_).drawn == drawn) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    if (drawn > 0) {
      took_s = drawing.picture_s();
      least_s = std::min(least_s, std::min(1.0, 0.5 / share) * took_s / 0.7);
      most_s = std::max(most_s, std::max(1.0, 0.5 / share) * took_s / 0.7);
    }
    share = double(drawing.size().width) * drawing.size().height / (64.0 * 48.0);
    drawn = headset.report().drawn;
    EXPECT_EQ(drawing.needed_period_s() > 0.0, drawn > 30) << drawn;
  }
  ASSERT_EQ(drawn, 31u) << drawing.trouble();
  EXPECT_GE(drawing.needed_period_s(), least_s);
  EXPECT_LE(drawing.needed_period_s(), most_s);
  const xr::DisplayRate& rate = headset.report().display;
  EXPECT_EQ(rate.chosen_hz, xr::highest_rate(rate.offered_hz, drawing.needed_period_s()));
}

TEST_F(VolumeSourceTest, MakesEverythingAnewOnTheDeviceOfARuntimeThatInsistsOnItsOwn) {
  const auto heart = small_heart();
  xr::VolumeSource drawing(showing(heart));
  runtime().setup().own_devices_only = true;
  xr::HeadsetOptions options;
  options.validation = true;
  xr::Headset headset(options, drawing);
  const auto draw_some = [&](uint64_t more) {
    const uint64_t wanted = headset.report().drawn + more;
    return stepped_until(headset, [&] { return headset.report().drawn >= wanted; });
  };
  ASSERT_TRUE(draw_some(2));
  const auto first = headset.context();
  runtime().lose_instance();
  ASSERT_TRUE(draw_some(2)) << headset.report().problem.message;
  EXPECT_NE(headset.context(), first);
  EXPECT_EQ(headset.report().sessions, 2u);
  EXPECT_THAT(first->validation_messages(), ::testing::IsEmpty());
  EXPECT_THAT(headset.context()->validation_messages(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace palpate::test
