// The display's rate: chosen by what the pictures need, or by an option, once; and what the runtime
// does to it.

#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using ::testing::ElementsAre;
using xr::HeadsetState;

TEST(DisplayRate, IsTheHighestThatThePicturesHold) {
  // As a runtime may offer them: in no order.
  const std::vector<float> offered{90.0F, 60.0F, 120.0F, 72.0F};
  EXPECT_EQ(xr::highest_rate(offered, 0.005), 120.0);
  EXPECT_EQ(xr::highest_rate(offered, 1.0 / 120.0), 120.0);
  EXPECT_EQ(xr::highest_rate(offered, 0.0084), 90.0);
  EXPECT_EQ(xr::highest_rate(offered, 0.0112), 72.0);
  EXPECT_EQ(xr::highest_rate(offered, 0.5), 60.0) << "none holds them: the lowest";
  EXPECT_EQ(xr::nearest_rate(offered, 75.0), 72.0);
  EXPECT_EQ(xr::nearest_rate(offered, 500.0), 120.0);
}

class XrRefreshRate : public XrTest {
 protected:
  const xr::DisplayRate& start(double wanted_hz = 0.0) {
    headset({.refresh_hz = wanted_hz});
    EXPECT_EQ(step_until(HeadsetState::kFocused), HeadsetState::kFocused);
    step();
    return headset_report().display;
  }
  int asked() { return runtime().calls("xrRequestDisplayRefreshRateFB"); }
};

TEST_F(XrRefreshRate, IsChosenOnceAsSoonAsItIsKnownWhatPicturesNeed) {
  const xr::DisplayRate& rate = start();
  EXPECT_THAT(rate.offered_hz, ElementsAre(72.0F, 90.0F, 120.0F));
  EXPECT_EQ(rate.hz, 90.0);
  EXPECT_EQ(rate.chosen_hz, 0.0);
  EXPECT_EQ(asked(), 0) << "nothing is known yet";
  source.needed_s = 0.007;
  step();
  EXPECT_EQ(rate.chosen_hz, 120.0);
  EXPECT_EQ(rate.needed_s, 0.007);
  step();
  EXPECT_EQ(rate.hz, 120.0);
  EXPECT_EQ(source.last->period_ns, 8'333'333);
  source.needed_s = 0.012;
  step();
  EXPECT_EQ(asked(), 1);
}

TEST_F(XrRefreshRate, IsTheOneNextToTheOptionWhateverPicturesNeed) {
  source.needed_s = 0.012;
  const xr::DisplayRate& rate = start(118.0);
  EXPECT_EQ(rate.chosen_hz, 120.0);
  EXPECT_EQ(rate.hz, 120.0);
  EXPECT_EQ(rate.needed_s, 0.0);
  EXPECT_EQ(asked(), 1);
}

TEST_F(XrRefreshRate, OfAnOverlayIsTheOtherProgramsChoice) {
  source.needed_s = 0.007;
  headset({.overlay = 1});
  step_until(HeadsetState::kFocused);
  step();
  EXPECT_EQ(asked(), 0);
  headset({.overlay = 1, .refresh_hz = 72.0});
  step_until(HeadsetState::kFocused);
  EXPECT_EQ(headset_report().display.chosen_hz, 72.0);
}

TEST_F(XrRefreshRate, IsHeardWhenTheRuntimeChangesIt) {
  source.needed_s = 0.01;
  const xr::DisplayRate& rate = start();
  EXPECT_EQ(rate.hz, 90.0);
  runtime().change_rate(72.0);
  step();
  EXPECT_EQ(rate.hz, 72.0);
  EXPECT_EQ(rate.chosen_hz, 90.0);
  EXPECT_EQ(asked(), 1) << "the runtime has its reason";
}

TEST_F(XrRefreshRate, StaysWhereTheRuntimeHasNoneToChooseOrRefuses) {
  source.needed_s = 0.007;
  std::erase(runtime().setup().extensions, XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME);
  EXPECT_TRUE(start(120.0).offered_hz.empty());
  EXPECT_EQ(runtime().calls("xrEnumerateDisplayRefreshRatesFB"), 0);
  EXPECT_EQ(headset_report().display.refused, "");
  close();
  runtime().reset();
  runtime().setup().rates_hz = {90.0F};
  EXPECT_TRUE(start(120.0).offered_hz.empty());
  EXPECT_EQ(headset_report().display.hz, 90.0);
  EXPECT_EQ(asked(), 0);
  for (const char* call : {"xrEnumerateDisplayRefreshRatesFB", "xrGetDisplayRefreshRateFB",
                           "xrRequestDisplayRefreshRateFB"}) {
    close();
    runtime().reset();
    runtime().inject_always(call, XR_ERROR_RUNTIME_FAILURE);
    const xr::DisplayRate& rate = start();
    for (int k = 0; k < 5; ++k) step();
    EXPECT_EQ(rate.refused, std::string(call) + " returned -2");
    EXPECT_EQ(rate.chosen_hz, 0.0);
    EXPECT_EQ(runtime().calls(call), 1) << "not asked again";
    EXPECT_EQ(headset_report().state, HeadsetState::kFocused);
    EXPECT_EQ(headset_report().sessions, 1u);
  }
}

}  // namespace
}  // namespace palpate::test
