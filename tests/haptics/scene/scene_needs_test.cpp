// A tick calls no more than the scene needs. Calls between the parts are counted (the linker sends
// each of them through this file: see CMakeLists.txt).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "module/haptics/proxy/back_track.h"
#include "module/scene/drive.h"
#include "tests/haptics/shell_scene.h"

namespace palpate {
namespace {
struct Calls {
  int poses = 0, driven = 0, phases = 0, back_tracks = 0, fields = 0;
} calls;
}  // namespace
}  // namespace palpate

extern "C" {
using namespace palpate;
Transform __real__ZN7palpate10MovingPose2atEl(MovingPose*, int64_t) noexcept;
Transform __wrap__ZN7palpate10MovingPose2atEl(MovingPose* pose, int64_t now_ns) noexcept {
  ++calls.poses;
  return __real__ZN7palpate10MovingPose2atEl(pose, now_ns);
}
Transform __real__ZN7palpate6drivenERKNS_9DriveSpecERKNS_9TransformEd(const DriveSpec&,
                                                                      const Transform&,
                                                                      double) noexcept;
Transform __wrap__ZN7palpate6drivenERKNS_9DriveSpecERKNS_9TransformEd(const DriveSpec& drive,
                                                                      const Transform& start,
                                                                      double time_s) noexcept {
  ++calls.driven;
  return __real__ZN7palpate6drivenERKNS_9DriveSpecERKNS_9TransformEd(drive, start, time_s);
}
FramePointer __real__ZN7palpate8Playback4stepEd(Playback*, double) noexcept;
FramePointer __wrap__ZN7palpate8Playback4stepEd(Playback* playback, double dt_s) noexcept {
  ++calls.phases;
  return __real__ZN7palpate8Playback4stepEd(playback, dt_s);
}
BackTrack
__real__ZN7palpate10back_trackERKNS_9MotionMapEdN3glm3vecILi3EdLNS3_9qualifierE0EEES6_S6_NS_12BackTrackingE(
    const MotionMap&, double, glm::dvec3, glm::dvec3, glm::dvec3, BackTracking) noexcept;
BackTrack
__wrap__ZN7palpate10back_trackERKNS_9MotionMapEdN3glm3vecILi3EdLNS3_9qualifierE0EEES6_S6_NS_12BackTrackingE(
    const MotionMap& map, double phase, glm::dvec3 target, glm::dvec3 start, glm::dvec3 closing,
    BackTracking method) noexcept {
  ++calls.back_tracks;
  return __real__ZN7palpate10back_trackERKNS_9MotionMapEdN3glm3vecILi3EdLNS3_9qualifierE0EEES6_S6_NS_12BackTrackingE(
      map, phase, target, start, closing, method);
}
MotionSample __real__ZNK7palpate9MotionMap6sampleEN3glm3vecILi3EdLNS1_9qualifierE0EEE(
    const MotionMap*, glm::dvec3) noexcept;
MotionSample __wrap__ZNK7palpate9MotionMap6sampleEN3glm3vecILi3EdLNS1_9qualifierE0EEE(
    const MotionMap* map, glm::dvec3 x_m) noexcept {
  ++calls.fields;
  return __real__ZNK7palpate9MotionMap6sampleEN3glm3vecILi3EdLNS1_9qualifierE0EEE(map, x_m);
}
glm::dvec3 __real__ZNK7palpate9MotionMap12displacementEN3glm3vecILi3EdLNS1_9qualifierE0EEE(
    const MotionMap*, glm::dvec3) noexcept;
glm::dvec3 __wrap__ZNK7palpate9MotionMap12displacementEN3glm3vecILi3EdLNS1_9qualifierE0EEE(
    const MotionMap* map, glm::dvec3 x_m) noexcept {
  ++calls.fields;
  return __real__ZNK7palpate9MotionMap12displacementEN3glm3vecILi3EdLNS1_9qualifierE0EEE(map, x_m);
}
}

namespace palpate {
namespace {

using namespace test;

/// The calls in 1,000 ticks with the hand in contact.
Calls called(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data) {
  Hand hand(spec, std::move(data));
  for (int i = 0; i < 500; ++i) hand.to({0.045 - 0.022 * i / 500.0, 0.0, 0.0});
  calls = {};
  TickOutput out;
  for (int i = 0; i < 1000; ++i) out = hand.to({0.023, 1e-6 * i, 0.0});
  EXPECT_GT(glm::length(out.wanted_n), 0.5) << "the wall must be felt";
  return calls;
}

const auto kStill = [] { return shell(1, 1.0, Made::kAnalytic, 4.0); };
const auto kBeating = [] { return shell(4, 1.0, Made::kAnalytic, 4.0); };

TEST(SceneNeeds, OfAStaticSceneAreNoPoseNoPhaseNoFieldAndNoBackTracking) {
  const Calls of = called(shell_spec(50.0, 0.3, 600.0), {kStill()});
  EXPECT_EQ(of.poses, 0);
  EXPECT_EQ(of.driven, 0);
  EXPECT_EQ(of.phases, 0);
  EXPECT_EQ(of.back_tracks, 0);
  EXPECT_EQ(of.fields, 0);
}

TEST(SceneNeeds, OfAMovedVolumeAreItsPosesAndNothingOfTime) {
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  spec.volumes[0].drive.kind = DriveSpec::Kind::kTurn;
  spec.volumes[0].path = PosePath::kExact;
  const Calls exact = called(spec, {kStill()});
  EXPECT_EQ(exact.driven, 1000);
  EXPECT_EQ(exact.poses, 0);
  EXPECT_EQ(exact.phases + exact.back_tracks + exact.fields, 0);
  spec.volumes[0].drive.kind = DriveSpec::Kind::kSecondHand;
  spec.volumes[0].path = PosePath::kSmooth;
  const Calls smooth = called(spec, {kStill()});
  EXPECT_EQ(smooth.poses, 1000);
  EXPECT_EQ(smooth.driven, 0);
  EXPECT_EQ(smooth.phases + smooth.back_tracks + smooth.fields, 0);
}

TEST(SceneNeeds, OfABeatingVolumeAreItsPhaseAndItsFieldAndNoPose) {
  const Calls of = called(shell_spec(50.0, 0.3, 600.0), {kBeating()});
  EXPECT_EQ(of.phases, 1000);
  EXPECT_GT(of.back_tracks, 0);
  EXPECT_EQ(of.poses + of.driven, 0);
}

TEST(SceneNeeds, OfVolumesThatNoModeReadsAreNoFieldAndNoBackTracking) {
  // The beating volume is in the scene, but no mode reads it.
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "only to be seen";
  const Calls of = called(spec, {kStill(), kBeating()});
  EXPECT_EQ(of.back_tracks + of.fields, 0);
  EXPECT_EQ(of.poses + of.driven, 0);
}

TEST(SceneNeeds, OfModesOfOneMotionAreOneCarrier) {
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  const Calls one = called(spec, {kBeating()});
  for (const char* name : {"second", "third", "fourth"}) {
    spec.modes.push_back(spec.modes[0]);
    spec.modes.back().name = name;
  }
  const auto scene = plan(spec, {kBeating()});
  ASSERT_TRUE(scene);
  EXPECT_EQ((*scene)->carriers.size(), 1u);
  const Calls four = called(spec, {kBeating()});
  EXPECT_EQ(four.phases, one.phases);
  EXPECT_LE(four.back_tracks, 2 * one.back_tracks) << "the point is followed once for all of them";
}

// text() describes the scenes above; it must agree with the counted calls.

std::string said_of(const SceneSpec& spec, std::vector<std::shared_ptr<const MovingVolume>> data) {
  const auto scene = plan(spec, std::move(data));
  EXPECT_TRUE(scene);
  return scene ? text(**scene) : "";
}

TEST(SceneText, SaysTheStagesThatRun) {
  using ::testing::HasSubstr;
  using ::testing::Not;
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  const std::string still = said_of(spec, {kStill()});
  EXPECT_THAT(still, HasSubstr("each tick  1 mode\n"));
  EXPECT_THAT(still, HasSubstr("left out   pose: its transform does not change\n"));
  EXPECT_THAT(still, HasSubstr("left out   phase, back-tracking, blending: it has one frame\n"));
  const std::string beating = said_of(spec, {kBeating()});
  EXPECT_THAT(beating, HasSubstr("each tick  phase, back-tracking by Newton, blending the values "
                                 "of two frames, 1 mode\n"));
  spec.volumes[0].blend_values = false;
  EXPECT_THAT(said_of(spec, {kBeating()}),
              HasSubstr("left out   blending: each frame's own values are carried\n"));
  spec.volumes[0].drive.kind = DriveSpec::Kind::kTurn;
  spec.volumes[0].path = PosePath::kExact;
  EXPECT_THAT(said_of(spec, {kStill()}),
              HasSubstr("each tick  pose, turning, at the tick's own time, 1 mode\n"));
  spec.modes[0].on = false;
  EXPECT_THAT(said_of(spec, {kStill()}), HasSubstr("Off at the start"));
}

TEST(SceneText, OfAVolumeThatIsOnlySeenSaysThatItsPhaseGoesOn) {
  using ::testing::HasSubstr;
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "only to be seen";
  EXPECT_EQ(called(spec, {kStill(), kBeating()}).phases, 1000);
  const std::string said = said_of(spec, {kStill(), kBeating()});
  EXPECT_THAT(said, HasSubstr("only to be seen\n  felt by    nothing\n"));
  EXPECT_THAT(said, HasSubstr("not needed: no mode is carried by it\n  each tick  phase\n  left "
                              "out   all that is felt: no mode reads it\n"));
  EXPECT_THAT(said_of(spec, {kBeating(), kStill()}),
              HasSubstr("left out   everything: no mode reads it\n"));
}

TEST(WithData, KeepsTheModesAndDecidesTheStagesOfThatVolumeAnew) {
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  spec.volumes.push_back(spec.volumes[0]);
  spec.volumes[1].name = "second";
  spec.modes.push_back(spec.modes[0]);
  spec.modes[1].name = "second";
  spec.modes[1].volume = "second";
  const auto before = plan(spec, {kStill(), kBeating()});
  ASSERT_TRUE(before);
  const auto beating = kBeating();
  const auto after = with_data(**before, 0, beating);
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ((*after)->modes[0].mode, (*before)->modes[0].mode);
  EXPECT_EQ((*after)->volumes[1].data, (*before)->volumes[1].data);
  EXPECT_EQ((*after)->volumes[0].data, beating);
  const auto from_the_beginning = plan(spec, {beating, (*before)->volumes[1].data});
  ASSERT_TRUE(from_the_beginning);
  EXPECT_EQ(text(**after), text(**from_the_beginning));
  ASSERT_EQ((*after)->carriers.size(), 2U);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_EQ((*after)->carriers[c].volume, (*from_the_beginning)->carriers[c].volume);
    EXPECT_EQ((*after)->carriers[c].motion, (*from_the_beginning)->carriers[c].motion);
  }
  EXPECT_EQ((*before)->volumes[0].phase, DataStage::kStill) << "the scene before is as it was";
}

TEST(WithData, RefusesDataThatLackTheMotionThatAModeNames) {
  SceneSpec spec = shell_spec(50.0, 0.3, 600.0);
  const auto beating = kBeating();
  spec.modes[0].motion = beating->motions[0].name;
  const auto scene = plan(spec, {beating});
  ASSERT_TRUE(scene);
  MovingVolume other = *beating;
  other.motions[0].name = "another";
  const auto refused = with_data(**scene, 0, std::make_shared<const MovingVolume>(other));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kBadInput);
}

}  // namespace
}  // namespace palpate
