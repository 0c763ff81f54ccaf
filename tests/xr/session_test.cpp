// A session from its beginning to its end, against the runtime of our own: what is shown is what
// was drawn, in the order that OpenXR asks for.

#include <cmath>
#include <limits>

#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::State;
class XrSession : public XrTest {};

TEST_F(XrSession, GoesFromNothingToFocusAndEndsCleanly) {
  xr::Headset& h = headset();
  EXPECT_EQ(step_until(State::kFocused), State::kFocused);
  EXPECT_EQ(h.report().runtime, "palpate's test runtime 0.1.0");
  EXPECT_EQ(h.report().system, "made headset");
  EXPECT_EQ(h.report().sessions, 1u);
  for (int i = 0; i < 20; ++i) step();
  h.end(now_ns_);
  EXPECT_EQ(step_until(State::kEnded), State::kEnded);
  EXPECT_EQ(runtime().state(), XR_SESSION_STATE_UNKNOWN) << "the session was not destroyed";
  EXPECT_EQ(runtime().calls("xrEndSession"), 1);
  EXPECT_GT(h.report().drawn, 20u);
  EXPECT_EQ(h.report().frames, runtime().frames());
}

TEST_F(XrSession, ShowsTheBytesThatWereDrawnToEachEye) {
  runtime().setup().keep_pictures = true;
  headset();
  step_until(State::kFocused);
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

TEST_F(XrSession, AsksTheClockForTheTimeOfDisplay) {
  headset();
  step_until(State::kFocused);
  step();
  EXPECT_EQ(source.last->display_time_ns,
            runtime().monotonic_of(runtime().last_frame().display_time));
  EXPECT_TRUE(source.last->display_time_exact);
  EXPECT_EQ(source.last->period_ns, 11'111'111);
}

}  // namespace
}  // namespace palpate::test
