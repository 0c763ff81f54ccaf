// Pictures for a window while something moves in them, and while nothing does.
#include "module/session/live_picture.h"

#include <gtest/gtest.h>

#include "compute/volume/phantom.h"
#include "integration/loading/load_scene.h"
#include "tests/session/made_session.h"
#include "tests/support/device.h"
#include "tests/support/wait_for.h"

namespace palpate {
namespace {

class LivePictureTest : public test::DeviceTest {
 protected:
  void SetUp() override {
    DeviceTest::SetUp();
    if (IsSkipped()) return;
    auto given = std::make_shared<loading::GivenVolume>();
    given->frames = shell_phantom(40, 1, 1, 0.0);
    loading::SequenceChoices choices;
    choices.given["shell"] = given;
    choices.wall = loading::FeltWall::kValues;
    const auto scene = loading::load_scene({"shell"}, choices);
    ASSERT_TRUE(scene);
    auto session = Session::start_in_host(*scene, test::host_device(), {});
    ASSERT_TRUE(session);
    session_ = std::move(*session);
    wanted_.eye = eye_at({0.05, 0.1, 0.3}, {0.0, 0.0, 0.0}, 0.5, kSize);
    wanted_.size = kSize;
  }

  /// Ticks a hand at this place until the newest picture is so.
  bool comes(glm::dvec3 hand_m, const std::function<bool(const LiveFrame&)>& is_so) {
    return wait_for([&] {
      time_ns_ += 1'000'000;
      session_->tick({hand_m, time_ns_});
      live_->want(wanted_);
      newest_ = live_->newest();
      return newest_ && is_so(*newest_);
    });
  }

  static constexpr PictureSize kSize{64, 48};
  static constexpr int kAll = 16;
  std::unique_ptr<Session> session_;
  std::unique_ptr<LivePicture> live_;
  std::shared_ptr<const LiveFrame> newest_;
  WantedPicture wanted_;
  int64_t time_ns_ = 5'000'000'000;
};

TEST_F(LivePictureTest, OfWhatStandsStillAMeanIsTakenAndThenNothingIsDrawn) {
  live_ = std::make_unique<LivePicture>(*session_, vulkan::ContextOptions{});
  const glm::dvec3 hand_m(0.0, 0.0, 0.2);
  ASSERT_TRUE(comes(hand_m, [](const LiveFrame& f) { return f.averaged == kAll; }))
      << live_->trouble();
  EXPECT_EQ(newest_->picture->width, kSize.width);
  EXPECT_EQ(newest_->picture->height, kSize.height);
  // Time goes on, the picture stays.
  const auto picture = newest_->picture;
  const int64_t before_ns = newest_->snapshot.now_ns;
  ASSERT_TRUE(comes(hand_m, [&](const LiveFrame& f) {
    EXPECT_EQ(f.picture, picture);
    return f.snapshot.now_ns > before_ns + 200'000'000;
  }));
}

TEST_F(LivePictureTest, WhatMovesIsDrawnAnewAtOnce) {
  live_ = std::make_unique<LivePicture>(*session_, vulkan::ContextOptions{}, 2);
  const glm::dvec3 hand_m(0.0, 0.0, 0.2);
  const auto all = [](const LiveFrame& f) { return f.averaged == kAll; };
  const auto one = [](const LiveFrame& f) { return f.averaged == 1; };
  ASSERT_TRUE(comes(hand_m, all)) << live_->trouble();
  const auto first = newest_->picture;
  // The hand,
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), one));
  EXPECT_NE(newest_->picture, first);
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), all));
  // the eye,
  wanted_.eye = eye_at({-0.05, 0.1, 0.3}, {0.0, 0.0, 0.0}, 0.5, kSize);
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), one));
  EXPECT_EQ(newest_->eye, wanted_.eye);
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), all));
  // and what the user has chosen.
  wanted_.choices.cut_open = true;
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), one));
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), all));
  wanted_.choices.stereo = Stereo::kParallel;
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), one));
  ASSERT_TRUE(comes(hand_m + glm::dvec3(0.01, 0.0, 0.0), all));
  EXPECT_EQ(newest_->picture->width, 2 * kSize.width);
}

}  // namespace
}  // namespace palpate
