// What hangs beside the picture: the runtime gets its pixels, where it hangs, and gets them once.
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;
class HangingPanelTest : public XrTest {
 protected:
  static std::shared_ptr<const Picture> pixels(uint32_t seed, int width = 8, int height = 4) {
    auto made = std::make_shared<Picture>();
    made->width = width;
    made->height = height;
    for (int i = 0; i < width * height; ++i)
      made->colours.push_back(0xff000000U |
                              (uint32_t(i) * 0x070b03U + seed * 0x132a41U) % 0xffffffU);
    return made;
  }
  void show(uint32_t seed) {
    source.hanging = xr::HangingPanel{pixels(seed), {}, 0.4};
    step();
    ASSERT_EQ(runtime().quads().size(), 1u);
  }
};

TEST_F(HangingPanelTest, ShowsItsPixelsWhereItHangs) {
  runtime().setup().keep_pictures = true;
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(runtime().quads().size(), 0u);
  // The world is turned and shifted against the room.
  const Pose world_from_room{{0.1, 0.2, 0.3}, glm::angleAxis(0.5, glm::dvec3(0, 1, 0))};
  headset_pointer()->colocation().follow(world_from_room);
  const Pose room_from_panel{{-0.6, 1.5, -0.7}, glm::angleAxis(0.7, glm::dvec3(0, 1, 0))};
  source.hanging = xr::HangingPanel{pixels(1), world_from_room * room_from_panel, 0.4};
  step();
  ASSERT_EQ(runtime().quads().size(), 1u);
  const fake::Quad quad = runtime().quads()[0];
  EXPECT_EQ(quad.picture.rgba, source.hanging->pixels->colours);
  EXPECT_FLOAT_EQ(quad.size.width, 0.4F);
  EXPECT_FLOAT_EQ(quad.size.height, 0.2F);
  EXPECT_EQ(quad.space, XR_REFERENCE_SPACE_TYPE_STAGE);
  EXPECT_NEAR(quad.pose.position.x, -0.6, 1e-6);
  EXPECT_NEAR(quad.pose.position.y, 1.5, 1e-6);
  EXPECT_NEAR(quad.pose.position.z, -0.7, 1e-6);
  EXPECT_NEAR(quad.pose.orientation.y, std::sin(0.35), 1e-6);
  EXPECT_NEAR(quad.pose.orientation.w, std::cos(0.35), 1e-6);
  EXPECT_EQ(runtime().last_frame().layers, 2u);
}

TEST_F(HangingPanelTest, GoesToTheRuntimeOnlyWhenItsPixelsChange) {
  runtime().setup().keep_pictures = true;
  headset();
  step_until(HeadsetState::kFocused);
  show(1);
  const auto waits = [&] { return runtime().calls("xrWaitSwapchainImage"); };
  const int before = waits();
  for (int i = 0; i < 5; ++i) step();
  EXPECT_EQ(waits() - before, 5 * 2) << "colour and depth of the picture alone";
  for (uint32_t seed = 2; seed < 7; ++seed) {
    show(seed);
    EXPECT_EQ(runtime().quads()[0].picture.rgba, source.hanging->pixels->colours) << seed;
  }
  // Another size needs other images.
  source.hanging->pixels = pixels(9, 5, 7);
  step();
  ASSERT_EQ(runtime().quads().size(), 1u);
  EXPECT_EQ(runtime().quads()[0].picture.rgba, source.hanging->pixels->colours);
  source.hanging.reset();
  step();
  EXPECT_EQ(runtime().quads().size(), 0u);
  EXPECT_EQ(runtime().last_frame().layers, 1u);
}

TEST_F(HangingPanelTest, HasTheSameColoursInEveryFormat) {
  runtime().setup().keep_pictures = true;
  for (const VkFormat format :
       {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_R16G16B16A16_SFLOAT,
        VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_B8G8R8A8_UNORM}) {
    runtime().setup().formats = {format};
    headset();
    step_until(HeadsetState::kFocused);
    show(3);
    const auto& colours = source.hanging->pixels->colours;
    const auto light = runtime().quads()[0].picture.light;
    ASSERT_EQ(light.size(), colours.size());
    for (size_t i = 0; i < light.size(); ++i)
      for (size_t c = 0; c < 3; ++c) {
        const double e = double(colours[i] >> 8 * c & 255U) / 255.0;
        const double linear = e <= 0.04045 ? e / 12.92 : std::pow((e + 0.055) / 1.055, 2.4);
        // Half a step of what the format can hold.
        ASSERT_NEAR(light[i][c], linear, 0.51 / 255.0) << format << ", pixel " << i;
      }
    close();
  }
}

TEST_F(HangingPanelTest, IsLeftOutWhereTheRuntimeRefusesIt) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().inject("xrCreateSwapchain", 1, XR_ERROR_OUT_OF_MEMORY);
  source.hanging = xr::HangingPanel{pixels(1), {}, 0.4};
  for (int i = 0; i < 5; ++i) {
    step();
    EXPECT_EQ(runtime().last_frame().layers, 1u) << "the picture stays";
  }
  EXPECT_EQ(headset_report().state, HeadsetState::kFocused);
  EXPECT_THAT(headset_report().no_panel, ::testing::HasSubstr("xrCreateSwapchain"));
  EXPECT_TRUE(runtime().injected_all());
  // In the next session it is tried again.
  runtime().lose_session();
  step();
  pass(2.0);
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(runtime().quads().size(), 1u);
  EXPECT_EQ(headset_report().no_panel, "");
}

TEST_F(HangingPanelTest, IsGoneWithItsSessionAndComesBackWithTheNext) {
  headset();
  step_until(HeadsetState::kFocused);
  show(1);
  runtime().inject("xrWaitSwapchainImage", 3, XR_ERROR_SESSION_LOST);
  source.hanging->pixels = pixels(2);
  step();
  EXPECT_EQ(headset_report().state, HeadsetState::kWaiting);
  pass(2.0);
  EXPECT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
  step();
  EXPECT_EQ(runtime().quads().size(), 1u);
}

}  // namespace
}  // namespace palpate::test
