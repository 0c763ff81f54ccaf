// A session from begin to end, on the tests' OpenXR runtime: the shown picture is the drawn one,
// and calls are in the order that OpenXR requires.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "compute/vulkan/recorder.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;
class SessionLife : public XrTest {};

TEST_F(SessionLife, GoesFromNothingToFocusAndEndsCleanly) {
  xr::Headset& h = headset();
  EXPECT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
  EXPECT_EQ(h.report().runtime, "palpate's test runtime 0.1.0");
  EXPECT_EQ(h.report().system, "made headset");
  EXPECT_EQ(h.report().sessions, 1u);
  for (int i = 0; i < 20; ++i) step();
  h.end(now_ns_);
  EXPECT_EQ(step_until(HeadsetState::kEnded), HeadsetState::kEnded);
  EXPECT_EQ(runtime().state(), XR_SESSION_STATE_UNKNOWN) << "the session was not destroyed";
  EXPECT_EQ(runtime().calls("xrEndSession"), 1);
  EXPECT_GT(h.report().drawn, 20u);
  EXPECT_EQ(h.report().frames, runtime().frames());
}

TEST_F(SessionLife, ShowsTheBytesThatWereDrawnToEachEye) {
  runtime().setup().keep_pictures = true;
  headset();
  step_until(HeadsetState::kFocused);
  step();
  ASSERT_EQ(runtime().pictures().size(), 2u);
  EXPECT_EQ(source.last->color.format, VK_FORMAT_R8G8B8A8_SRGB);
  for (uint32_t eye = 0; eye < 2; ++eye) {
    const fake::Picture picture = runtime().pictures()[eye];
    ASSERT_EQ(picture.width, 64u);
    ASSERT_EQ(picture.height, 48u);
    ASSERT_EQ(picture.depth.size(), picture.rgba.size());
    for (uint32_t y = 0; y < picture.height; ++y)
      for (uint32_t x = 0; x < picture.width; ++x) {
        ASSERT_EQ(picture.rgba[x + y * picture.width], GradientSource::color_at(eye, x, y));
        ASSERT_EQ(picture.depth[x + y * picture.width], GradientSource::depth_at(eye, y));
      }
    EXPECT_EQ(picture.near_m, std::numeric_limits<float>::infinity());
    EXPECT_EQ(picture.far_m, 0.05F);
  }
}

TEST_F(SessionLife, AsksTheClockForTheTimeOfDisplay) {
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(source.last->display_time_ns,
            runtime().monotonic_of(runtime().last_frame().display_time));
  EXPECT_TRUE(source.last->display_time_exact);
  EXPECT_EQ(source.last->period_ns, 11'111'111);
}

TEST_F(SessionLife, GuessesTheTimeOfDisplayWhereTheRuntimeCanNotConvertIt) {
  auto& extensions = runtime().setup().extensions;
  std::erase(extensions, "XR_KHR_convert_timespec_time");
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_FALSE(source.last->display_time_exact);
  EXPECT_GT(source.last->display_time_ns, 0);
}

TEST_F(SessionLife, ComesFromIdleThroughHiddenAndVisible) {
  headset();
  std::vector<HeadsetState> seen;
  for (int i = 0; i < 10; ++i) {
    const HeadsetState state = step().state;
    if (seen.empty() || seen.back() != state) seen.push_back(state);
  }
  // Ready comes with the session, so the first step already runs a frame.
  EXPECT_THAT(seen, ::testing::ElementsAre(HeadsetState::kHidden, HeadsetState::kVisible,
                                           HeadsetState::kFocused));
}

TEST_F(SessionLife, EndsEveryFrameWithoutAPictureWhileNothingIsToBeRendered) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().setup().should_render = false;
  const int drawn = source.frames;
  const uint64_t frames = runtime().frames();
  for (int i = 0; i < 10; ++i) {
    step();
    EXPECT_EQ(runtime().last_frame().layers, 0u);
  }
  EXPECT_EQ(source.frames, drawn);
  EXPECT_EQ(runtime().frames(), frames + 10);
}

TEST_F(SessionLife, ShowsNothingForAHeadOfUnknownPlace) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().setup().tracked = false;
  step();
  EXPECT_EQ(runtime().last_frame().layers, 0u);
  runtime().setup().tracked = true;
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
}

TEST_F(SessionLife, ShowsNothingWhenTheSourceHasNothing) {
  headset();
  source.with_color = false;
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 0u);
}

TEST_F(SessionLife, HandsNoDepthOverWhereItIsNotTakenOrNotDrawn) {
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_TRUE(runtime().last_frame().depth);
  source.with_depth = false;
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
  EXPECT_FALSE(runtime().last_frame().depth);
  close();
  source.with_depth = true;
  std::erase(runtime().setup().extensions, "XR_KHR_composition_layer_depth");
  headset();
  step_until(HeadsetState::kFocused);
  EXPECT_FALSE(step().depth);
  EXPECT_EQ(source.last->depth.image, VkImage(VK_NULL_HANDLE));
  EXPECT_EQ(runtime().last_frame().layers, 1u);
}

TEST_F(SessionLife, TakesTheColourFormatThatFitsBest) {
  // The best format first; they are offered in the opposite order, and each time one less.
  std::vector<int64_t> offered = {VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM,
                                  VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_B8G8R8A8_SRGB,
                                  VK_FORMAT_R8G8B8A8_SRGB};
  source.with_color = false;
  for (; !offered.empty(); offered.pop_back()) {
    runtime().setup().formats = offered;
    headset();
    step_until(HeadsetState::kFocused);
    step();
    EXPECT_EQ(source.last->color.format, VkFormat(offered.back()));
    EXPECT_EQ(source.last->depth.image, VkImage(VK_NULL_HANDLE)) << "no depth format is offered";
    close();
  }
}

TEST_F(SessionLife, SaysWhatIsOfferedWhenNoFormatFits) {
  runtime().setup().formats = {VK_FORMAT_R5G6B5_UNORM_PACK16, VK_FORMAT_D32_SFLOAT};
  headset();
  const xr::Report report = [&] {
    for (int i = 0; i < 10 && headset_report().problem.call[0] == 0; ++i) step();
    return headset_report();
  }();
  EXPECT_EQ(report.problem.trouble, xr::Trouble::kUnsupported);
  EXPECT_EQ(report.state, HeadsetState::kWaiting);
  EXPECT_THAT(report.problem.message, ::testing::HasSubstr("8-bit colour"));
  EXPECT_THAT(report.problem.message, ::testing::HasSubstr("VkFormat numbers: 4, 126)"));
}

TEST_F(SessionLife, BlendsAsWantedWhereOfferedAndSaysHow) {
  xr::HeadsetOptions options;
  options.blend = xr::BlendMode::kAlpha;
  headset(options);
  step_until(HeadsetState::kFocused);
  EXPECT_EQ(step().blend, xr::BlendMode::kAlpha);
  EXPECT_EQ(runtime().last_frame().blend, XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND);
  EXPECT_EQ(runtime().last_frame().flags, XR_COMPOSITION_LAYER_BLEND_TEXTURE_SOURCE_ALPHA_BIT);
  options.blend = xr::BlendMode::kAdditive;
  headset(options);
  step_until(HeadsetState::kFocused);
  EXPECT_EQ(step().blend, xr::BlendMode::kOpaque)
      << "additive is not offered, so the runtime's first one is used";
  EXPECT_EQ(runtime().last_frame().flags, 0u);
}

TEST_F(SessionLife, StandsAboveAnotherProgramWhereTheRuntimeCan) {
  xr::HeadsetOptions options;
  options.overlay = 7;
  headset(options);
  step_until(HeadsetState::kFocused);
  EXPECT_TRUE(step().see_through);
  EXPECT_EQ(runtime().overlay(), 7);
  EXPECT_EQ(runtime().last_frame().blend, XR_ENVIRONMENT_BLEND_MODE_OPAQUE);
  EXPECT_EQ(runtime().last_frame().flags, XR_COMPOSITION_LAYER_BLEND_TEXTURE_SOURCE_ALPHA_BIT);
  // The application below the overlay appears and disappears.
  for (const bool visible : {false, true}) {
    XrEventDataMainSessionVisibilityChangedEXTX changed{
        XR_TYPE_EVENT_DATA_MAIN_SESSION_VISIBILITY_CHANGED_EXTX};
    changed.visible = visible;
    XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
    std::memcpy(&buffer, &changed, sizeof changed);
    runtime().push_event(buffer);
    EXPECT_EQ(step().main_visible, visible);
  }
  headset();
  step_until(HeadsetState::kFocused);
  EXPECT_FALSE(step().see_through);
  EXPECT_EQ(runtime().overlay(), -1);
}

TEST_F(SessionLife, SaysThatARuntimeHasNoOverlays) {
  auto& extensions = runtime().setup().extensions;
  extensions.erase(std::find(extensions.begin(), extensions.end(), XR_EXTX_OVERLAY_EXTENSION_NAME));
  xr::HeadsetOptions options;
  options.overlay = 0;
  headset(options);
  const xr::Report& report = step();
  EXPECT_EQ(report.sessions, 0u);
  EXPECT_EQ(report.problem.trouble, xr::Trouble::kUnsupported);
  EXPECT_THAT(report.sentence, ::testing::HasSubstr("it lacks XR_EXTX_overlay"));
}

TEST_F(SessionLife, UsesTheOriginThatIsWantedOrTheNextBest) {
  xr::HeadsetOptions options;
  const auto height_of_eye = [&] {
    headset(options);
    step_until(HeadsetState::kFocused);
    step();
    return source.last->eyes[0].world_from_eye.position_m.y;
  };
  EXPECT_NEAR(height_of_eye(), 1.6, 1e-6) << "above the stage";
  options.origin = xr::Origin::kLocal;
  EXPECT_NEAR(height_of_eye(), 0.0, 1e-6) << "at the seated user's head";
  options.origin = xr::Origin::kView;
  EXPECT_NEAR(height_of_eye(), 0.0, 1e-6);
  EXPECT_NEAR(source.last->eyes[1].world_from_eye.position_m.x, 0.0315, 1e-6)
      << "relative to the head";
  options.origin = xr::Origin::kStage;
  std::erase(runtime().setup().spaces, XR_REFERENCE_SPACE_TYPE_STAGE);
  EXPECT_NEAR(height_of_eye(), 0.0, 1e-6);
  EXPECT_EQ(headset_report().origin, xr::Origin::kLocal);
  options.origin = xr::Origin::kLocalFloor;
  EXPECT_NEAR(height_of_eye(), 1.6, 1e-6) << "above the floor, without a stage";
  EXPECT_EQ(headset_report().origin, xr::Origin::kLocalFloor);
}

TEST_F(SessionLife, StaysWithAPersonWhoRecentresAndKeepsTheHeightOfTheFloor) {
  const XrPosef aside{{0.0F, 0.6F, 0.0F, 0.8F}, {0.4F, -0.5F, 0.3F}};
  for (const bool offered : {true, false}) {
    SCOPED_TRACE(offered ? "with a local floor" : "without");
    close();
    runtime().reset();
    if (!offered) std::erase(runtime().setup().extensions, "XR_EXT_local_floor");
    headset({.origin = xr::Origin::kLocalFloor});
    step_until(HeadsetState::kFocused);
    step();
    const auto eye = [&] { return source.last->eyes[0].world_from_eye; };
    EXPECT_EQ(headset_report().origin, offered ? xr::Origin::kLocalFloor : xr::Origin::kStage);
    const xr::Pose before = eye();
    runtime().recentre(XR_REFERENCE_SPACE_TYPE_LOCAL, runtime().now(), aside, true);
    step();
    const glm::dvec3 moved_m = eye().position_m - before.position_m;
    EXPECT_NEAR(moved_m.y, 0.0, 1e-6) << "the floor stays where it is";
    // The head sways by millimetres; the person has recentred by half a metre.
    EXPECT_EQ(glm::length(moved_m) > 0.4, offered);
    EXPECT_TRUE(runtime().violations().empty());
  }
}

TEST_F(SessionLife, GivesTheEyesAsTheRuntimeSaysThem) {
  headset();
  step_until(HeadsetState::kFocused);
  step();
  const XrTime time = runtime().last_frame().display_time;
  const XrPosef head = runtime().room_from(XR_REFERENCE_SPACE_TYPE_VIEW, time);
  for (int eye = 0; eye < 2; ++eye) {
    const xr::EyeView& got = source.last->eyes[size_t(eye)];
    const double side = eye ? 0.0315 : -0.0315;
    // Floats, about a metre.
    EXPECT_NEAR(got.world_from_eye.position_m.x, double(head.position.x) + side, 1e-6);
    EXPECT_NEAR(got.fov.left, eye ? -0.7 : -0.9, 1e-6);
    EXPECT_NEAR(got.fov.right, eye ? 0.9 : 0.7, 1e-6);
    EXPECT_GT(got.fov.up, got.fov.down);
    EXPECT_EQ(got.size.width, 64u);
    EXPECT_EQ(got.size.height, 48u);
  }
}

TEST_F(SessionLife, ShowsTheSecondPairOfViewsOfAHeadsetThatHasOne) {
  runtime().setup().quad_views = true;
  runtime().setup().keep_pictures = true;
  // The runtime's formats begin with one that has blue first.
  runtime().setup().formats = {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_D32_SFLOAT};
  headset();
  step_until(HeadsetState::kFocused);
  step();
  ASSERT_EQ(source.last->eyes.size(), 4u);
  EXPECT_EQ(source.hidden_triangles, std::vector<size_t>(4, 6))
      << "two triangles of each view are hidden";
  EXPECT_TRUE(runtime().last_frame().depth);
  const std::vector<fake::Picture> pictures = runtime().pictures();
  ASSERT_EQ(pictures.size(), 4u);
  for (uint32_t view = 0; view < 4; ++view) {
    const xr::EyeView& got = source.last->eyes[view];
    const bool right = view % 2 == 1, is_focus = view >= 2;
    EXPECT_NEAR(got.fov.left, is_focus ? (right ? -0.35 : -0.25) : (right ? -0.7 : -0.9), 1e-6);
    EXPECT_EQ(got.size.width, is_focus ? 80u : 64u);
    EXPECT_EQ(got.size.height, is_focus ? 72u : 48u);
    // Each view is a layer of images that are as large as the largest one.
    const fake::Picture& shown = pictures[view];
    ASSERT_EQ(shown.width, got.size.width);
    ASSERT_EQ(shown.height, got.size.height);
    for (const auto& [x, y] : {std::pair(0U, 0U), std::pair(shown.width - 1, shown.height - 1)}) {
      EXPECT_EQ(shown.rgba[y * shown.width + x], GradientSource::color_at(view, x, y)) << view;
      EXPECT_EQ(shown.depth[y * shown.width + x], GradientSource::depth_at(view, y)) << view;
    }
  }
  EXPECT_EQ(source.last->eyes[0].world_from_eye.position_m,
            source.last->eyes[2].world_from_eye.position_m);
}

TEST_F(SessionLife, LetsTheSecondPairOfViewsFollowTheGazeWhileItIsSeen) {
  runtime().setup().quad_views = true;
  runtime().setup().foveation = true;
  runtime().setup().keep_pictures = true;
  headset();
  step_until(HeadsetState::kFocused);
  for (const bool seen : {true, false, true}) {
    runtime().setup().gaze_seen = seen;
    step();
    ASSERT_EQ(source.last->eyes.size(), 4u);
    EXPECT_NEAR(source.last->eyes[0].fov.left, -0.9, 1e-6);
    EXPECT_NEAR(source.last->eyes[2].fov.left, seen ? -0.15 : -0.25, 1e-6);
    EXPECT_NEAR(source.last->eyes[3].fov.left, seen ? -0.25 : -0.35, 1e-6);
    // What the optics hide is known of views in a fixed place only.
    const size_t of_focus = seen ? 0 : 6;
    EXPECT_EQ(source.hidden_triangles, (std::vector<size_t>{6, 6, of_focus, of_focus}));
    const std::vector<fake::Picture> pictures = runtime().pictures();
    ASSERT_EQ(pictures.size(), 4u);
    EXPECT_EQ(pictures[0].width, 64u);
    EXPECT_EQ(pictures[2].width, seen ? 56u : 80u);
    EXPECT_EQ(pictures[2].height, seen ? 40u : 72u);
  }
}

TEST_F(SessionLife, ShowsOnePairOfViewsWhereTheRuntimeKnowsNoSecondOne) {
  runtime().setup().quad_views = true;
  std::erase(runtime().setup().extensions, XR_VARJO_QUAD_VIEWS_EXTENSION_NAME);
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(source.last->eyes.size(), 2u);
  EXPECT_EQ(runtime().calls("xrEnumerateViewConfigurations"), 0);
}

TEST_F(SessionLife, MakesPicturesOfTheSizeThatIsAskedFor) {
  runtime().setup().view_width = 2160;
  runtime().setup().view_height = 2160;
  xr::HeadsetOptions options;
  options.view_scale = 0.25;
  headset(options);
  source.with_color = false;
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(source.last->color.size.width, 540u);
  options.view_scale = 100.0;
  runtime().setup().view_width = runtime().setup().view_height = 64;
  headset(options);
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(source.last->color.size.width, 4096u) << "the largest size of the runtime";
}

TEST_F(SessionLife, KnowsWhatTheOpticsHide) {
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(source.hidden.size(), 6u);
  const int asked = runtime().calls("xrGetVisibilityMaskKHR");
  XrEventDataVisibilityMaskChangedKHR changed{XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR};
  changed.session = runtime().session();
  changed.viewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
  changed.viewIndex = 1;
  XrEventDataBuffer event{XR_TYPE_EVENT_DATA_BUFFER};
  std::memcpy(&event, &changed, sizeof changed);
  runtime().push_event(event);
  step();
  EXPECT_EQ(runtime().calls("xrGetVisibilityMaskKHR"), asked + 2) << "for the changed view";
  close();
  std::erase(runtime().setup().extensions, "XR_KHR_visibility_mask");
  headset();
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_TRUE(source.hidden.empty());
}

TEST_F(SessionLife, SkipsThePictureWhenTheCompositorKeepsItsImage) {
  headset();
  step_until(HeadsetState::kFocused);
  runtime().inject("xrWaitSwapchainImage", 1, XR_TIMEOUT_EXPIRED);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 0u);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
  runtime().inject("xrWaitSwapchainImage", 2, XR_TIMEOUT_EXPIRED);
  step();
  EXPECT_EQ(runtime().last_frame().layers, 1u);
  EXPECT_FALSE(runtime().last_frame().depth) << "the second image is the depth's";
  step();
  EXPECT_TRUE(runtime().last_frame().depth);
  EXPECT_EQ(headset_report().sessions, 1u);
}

TEST_F(SessionLife, LetsTheQueueBeUsedByOthersBetweenFrames) {
  // One queue for all: another thread works while frames run. The validation layer reports two
  // threads in the queue at the same time.
  xr::Headset& h = headset();
  step_until(HeadsetState::kFocused);
  std::atomic<bool> stop{false};
  std::atomic<int> runs{0};
  std::thread other([&] {
    vulkan::Buffer from(h.context(), 1024), to(h.context(), 1024);
    vulkan::Recorder recorder(h.context());
    recorder.fill(from, 1);
    recorder.copy(from, to, 1024);
    while (!stop) {
      recorder.run();
      ++runs;
    }
  });
  for (int i = 0; i < 200 || runs < 50; ++i) step();
  stop = true;
  other.join();
  EXPECT_EQ(h.report().state, HeadsetState::kFocused);
}

}  // namespace
}  // namespace palpate::test
