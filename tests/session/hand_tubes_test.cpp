// The stream tubes of a hand: which field they follow, how many there are, and how they are drawn.
#include "module/session/hand_tubes.h"

#include <gtest/gtest.h>

#include "integration/loading/load_scene.h"
#include "module/session/scene_picture.h"
#include "module/session/session.h"
#include "tests/session/made_session.h"

namespace palpate {
namespace {

using Kind = HandCommand::Kind;

Grid cube() {
  Grid grid;
  grid.size = glm::ivec3(20);
  grid.spacing_mm = glm::dvec3(2.0);
  grid.origin_mm = glm::dvec3(-19.0);
  return grid;
}

std::shared_ptr<const FrameData> ramp() {
  Volume volume{cube(), {}};
  for (size_t v = 0; v < cube().count(); ++v)
    // Rises along S.
    volume.values.push_back(float(v / 400));
  return sampled_scalar(std::move(volume));
}

std::shared_ptr<const FrameData> streams() {
  return sampled_vector(cube(),
                        std::vector<glm::vec3>(cube().count(), glm::vec3(3.0F, 0.0F, 0.0F)));
}

/// Two frames of it; the material rises by 4 mm.
std::shared_ptr<const MovingVolume> rising(std::shared_ptr<const FrameData> frame) {
  MovingVolume volume;
  volume.times = {{0.0, 1.0}, 0.0};
  volume.frames = {frame, frame};
  const Field up{cube(), std::vector<glm::vec3>(cube().count(), glm::vec3(0.0F, 0.0F, 4.0F))};
  volume.motions = {{"data", {MotionMap::of(up)}}};
  return std::make_shared<const MovingVolume>(std::move(volume));
}

/// A scene of one volume and one mode.
std::shared_ptr<const Scene> scene_of(std::shared_ptr<const MovingVolume> data,
                                      const std::string& kind = "surface",
                                      VectorProperty vector = VectorProperty::kVector,
                                      std::optional<bool> tubes = std::nullopt) {
  SceneSpec spec;
  VolumeSpec volume;
  volume.name = "data";
  volume.appearance.tubes = tubes;
  spec.volumes = {volume};
  ModeSpec mode;
  mode.name = kind;
  mode.kind = kind;
  mode.volume = "data";
  mode.vector = vector;
  mode.strength = TransferFunction::constant(1.0);
  spec.modes = {mode};
  const auto scene = plan(spec, {std::move(data)});
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return scene ? *scene : nullptr;
}

/// A hand at a place, in a volume that is 1 m to the right.
SceneSnapshot snapshot_at(glm::dvec3 place_m, double time_s = 0.0) {
  SceneSnapshot snapshot;
  snapshot.volume_count = 1;
  snapshot.volumes[0].world_from_volume.translation_m = {1.0, 0.0, 0.0};
  snapshot.volumes[0].time_s = time_s;
  snapshot.proxy_m = place_m + glm::dvec3(1.0, 0.0, 0.0);
  return snapshot;
}

TEST(TubeField, IsWhatIsFeltElseTheVectorsElseTheVelocity) {
  EXPECT_EQ(tube_field(*scene_of(test::still(streams()), "follow"), 0), TubeField::kVectors);
  EXPECT_EQ(tube_field(*scene_of(test::still(streams()), "follow", VectorProperty::kCurl), 0),
            TubeField::kCurl);
  EXPECT_EQ(tube_field(*scene_of(test::still(streams()), "vortex"), 0), TubeField::kVectors)
      << "the axis of a vortex is not a direction of flow";
  EXPECT_EQ(tube_field(*scene_of(test::still(ramp()), "follow"), 0), TubeField::kGradient)
      << "as in the paper's molecule";
  EXPECT_EQ(tube_field(*scene_of(rising(ramp()), "follow"), 0), TubeField::kGradient);
  EXPECT_EQ(tube_field(*scene_of(rising(ramp())), 0), TubeField::kVelocity);
  EXPECT_EQ(tube_field(*scene_of(rising(ramp()), "surface", VectorProperty::kVector, true), 0),
            TubeField::kGradient);
  EXPECT_EQ(tube_field(*scene_of(test::still(ramp())), 0), std::nullopt);
}

TEST(HandTubes, ReleasesAtTheProxyKeepsAndClears) {
  const auto scene = scene_of(test::still(streams()), "follow");
  HandTubes hand;
  const auto command = [&](Kind kind, glm::dvec3 place_m = glm::dvec3(0.0)) {
    return hand.take({kind, snapshot_at(place_m)}, *scene);
  };
  EXPECT_EQ(command(Kind::kReleaseTube, {0.0, 0.005, 0.002}), "");
  ASSERT_EQ(hand.tubes()->size(), 1U);
  const StreamTube& tube = *hand.tubes()->front().tube;
  EXPECT_LT(glm::distance(tube.released_m()[tube.seed()], glm::dvec3(0.0, 0.005, 0.002)), 1e-12)
      << "in volume space, wherever the volume is";
  const auto before = hand.tubes();
  EXPECT_EQ(command(Kind::kKeepTubes), "");
  EXPECT_TRUE(hand.tubes()->front().kept);
  EXPECT_FALSE(before->front().kept) << "a list that was returned before does not change";
  EXPECT_EQ(command(Kind::kReleaseTube, {0.0, -0.005, 0.0}), "");
  EXPECT_EQ(hand.tubes()->size(), 2U);
  EXPECT_EQ(command(Kind::kClearTubes), "");
  ASSERT_EQ(hand.tubes()->size(), 1U);
  EXPECT_TRUE(hand.tubes()->front().kept);
  EXPECT_EQ(command(Kind::kClearTubes), "");
  EXPECT_TRUE(hand.tubes()->empty()) << "only kept ones were left";
}

TEST(HandTubes, SaysWhyThereIsNone) {
  HandTubes hand;
  EXPECT_EQ(hand.take({Kind::kReleaseTube, snapshot_at({0.0, 0.5, 0.0})},
                      *scene_of(test::still(streams()), "follow")),
            "No stream tube: the hand is outside of the data.");
  EXPECT_EQ(
      hand.take({Kind::kReleaseTube, snapshot_at(glm::dvec3(0.0))}, *scene_of(test::still(ramp()))),
      "No stream tube: nothing here has a direction: neither vectors nor motion.");
  EXPECT_TRUE(hand.tubes()->empty());
}

TEST(HandTubes, TheOldestThatIsNotKeptMakesRoom) {
  const auto scene = scene_of(test::still(streams()), "follow");
  HandTubes hand;
  const auto release = [&](double y_m) {
    return hand.take({Kind::kReleaseTube, snapshot_at({0.0, y_m, 0.0})}, *scene);
  };
  const auto y_of = [&](size_t n) { return (*hand.tubes())[n].tube->released_m()[0].y; };
  release(-0.010);
  hand.take({Kind::kKeepTubes, {}}, *scene);
  for (size_t n = 1; n <= HandTubes::kMost; ++n) EXPECT_EQ(release(1e-4 * double(n)), "");
  ASSERT_EQ(hand.tubes()->size(), HandTubes::kMost);
  EXPECT_NEAR(y_of(0), -0.010, 1e-12) << "the kept one is the oldest, and stays";
  EXPECT_NEAR(y_of(1), 2e-4, 1e-12);
  hand.take({Kind::kKeepTubes, {}}, *scene);
  EXPECT_EQ(release(0.0), "No stream tube: 64 are kept already. Clear them first.");
}

TEST(HandTubes, GoOverToDataThatCameLater) {
  MovingVolume unknown = *rising(streams());
  unknown.motions = {{"data", {nullptr}}};
  const auto before = scene_of(std::make_shared<const MovingVolume>(unknown), "follow");
  const auto after = scene_of(rising(streams()), "follow");
  HandTubes hand;
  ASSERT_EQ(hand.take({Kind::kReleaseTube, snapshot_at({0.0, 0.002, 0.0})}, *before), "");
  EXPECT_EQ(hand.follow(*before, snapshot_at({})), "");
  const auto same = hand.tubes();
  EXPECT_EQ(hand.follow(*after, snapshot_at({})), "");
  ASSERT_EQ(hand.tubes()->size(), 1U);
  const StreamTube& tube = *hand.tubes()->front().tube;
  EXPECT_EQ(tube.data(), after->volumes[0].data);
  EXPECT_NEAR(tube.places({0, 0.5})[tube.seed()].y, 0.004, 1e-8);
  EXPECT_NE(hand.tubes(), same);
  HandTubes none = hand;
  Scene empty;
  EXPECT_EQ(none.follow(empty, {}), "1 stream tube could not be taken along to the new motion.");
  EXPECT_TRUE(none.tubes()->empty());
}

TEST(ScenePicture, DrawsTubesWhereTheMotionHasBroughtThemAndKeptOnesThicker) {
  const auto scene = scene_of(rising(streams()), "follow", VectorProperty::kVector, false);
  HandTubes hand;
  ASSERT_EQ(hand.take({Kind::kReleaseTube, snapshot_at({0.0, 0.002, 0.0})}, *scene), "");
  ViewChoices choices;
  choices.box = choices.hand = false;
  ScenePicture picture(choices);
  picture.update(scene);
  const Eye eye = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const SceneSnapshot later = snapshot_at({}, 0.75);
  EXPECT_TRUE(picture.at(later, 0, {&eye, 1}).things.empty());
  picture.show(hand.tubes());
  const Things loose = picture.at(later, 0, {&eye, 1}).things;
  const StreamTube& tube = *hand.tubes()->front().tube;
  ASSERT_EQ(loose.size(), tube.released_m().size() - 1);
  for (size_t k = 0; k < loose.size(); ++k) {
    // 0.75 of 4 mm up, and the volume is 1 m to the right.
    const glm::dvec3 wanted = tube.released_m()[k] + glm::dvec3(1.0, 0.003, 0.0);
    EXPECT_LT(glm::distance(loose[k].from, wanted), 1e-8);
    EXPECT_EQ(loose[k].to, k + 1 < loose.size() ? loose[k + 1].from : loose[k].to);
  }
  hand.take({Kind::kKeepTubes, {}}, *scene);
  picture.show(hand.tubes());
  const Things kept = picture.at(later, 0, {&eye, 1}).things;
  ASSERT_EQ(kept.size(), loose.size());
  EXPECT_GT(kept[0].from_radius_m, 1.2 * loose[0].from_radius_m);
}

TEST(ScenePicture, NamesWhatTheColoursOfTubesMean) {
  ViewChoices choices;
  choices.box = choices.hand = false;
  const Eye eye = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const auto named = [&](const std::shared_ptr<const Scene>& scene, bool release) {
    HandTubes hand;
    if (release) {
      EXPECT_EQ(hand.take({Kind::kReleaseTube, snapshot_at({0.0, 0.002, 0.0})}, *scene), "");
    }
    ScenePicture picture(choices);
    picture.update(scene);
    picture.show(hand.tubes());
    const std::vector<TubeColours> all = picture.at(snapshot_at({}), 0, {&eye, 1}).tube_colours;
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? TubeColours{} : all.front();
  };
  // Material that rises by 4 mm in a second.
  const TubeColours speed = named(scene_of(rising(ramp())), true);
  EXPECT_EQ(speed.name + ", " + speed.unit, "speed, mm/s");
  EXPECT_NEAR(speed.least, 4.0, 0.01);
  EXPECT_NEAR(speed.most, 4.0, 0.01);
  ASSERT_GT(speed.colours.size(), 2U);
  EXPECT_EQ(speed.colours.front(), released_tube_colour(1.0, 1.0, 2.0));
  // A value that rises by 1 in 2 mm: tubes all over the data, in their own colours.
  const auto scalar = scene_of(test::still(ramp()), "surface", VectorProperty::kVector, true);
  const TubeColours slope = named(scalar, false);
  EXPECT_EQ(slope.name + ", " + slope.unit, "slope, per mm");
  EXPECT_NEAR(slope.most, 0.5, 0.02);
  EXPECT_EQ(slope.colours.back(), tube_colour(slope.most, slope.least, slope.most));
  // The unit of a file's numbers is not known.
  const TubeColours vectors = named(scene_of(test::still(streams()), "follow"), false);
  EXPECT_EQ(vectors.name + ", " + vectors.unit, "vectors, unit of the file");
  EXPECT_NEAR(vectors.most, 3.0, 1e-6);
}

TEST(Things, AReleasedTubeHasNoColourOfFleshOrBone) {
  // All colours of the scale: more blue or green than red, or equally red and green without blue;
  // never grey.
  for (double length = 1.0; length <= 10.0; length *= 1.1) {
    const glm::dvec3 colour = released_tube_colour(length, 1.0, 10.0);
    EXPECT_GT(std::max(colour.g, colour.b), colour.r - 0.1) << length;
    EXPECT_GT(glm::length(colour - glm::dvec3((colour.r + colour.g + colour.b) / 3.0)), 0.3)
        << "grey at " << length;
  }
  EXPECT_EQ(released_tube_colour(0.0, 1.0, 10.0), released_tube_colour(1.0, 1.0, 10.0));
  EXPECT_EQ(released_tube_colour(2.0, 2.0, 2.0), released_tube_colour(1.0, 1.0, 10.0));
  EXPECT_GT(released_tube_colour(10.0, 1.0, 10.0).r, 0.9);
}

/// A frame that one motion carries: its material rises by so many mm in half a second, and sinks.
MovingVolume carried_up(const std::shared_ptr<const FrameData>& frame, float up_mm) {
  SequenceMotion motion;
  motion.basis = {{0.0, 0.5}, 1.0, 0};
  motion.terms = {still_field(cube()), still_field(cube())};
  for (glm::vec3& u_mm : motion.terms[1].u_mm) u_mm.z = up_mm;
  MovingVolume volume;
  volume.times = {motion.basis.times_s, 1.0};
  volume.frames = {frame};
  volume.whole = SequenceMap::of(motion);
  return volume;
}

TEST(ScenePicture, GoesOverToABetterMotionFromItsLastPictureOn) {
  const auto frame = ramp();
  const auto coarse = std::make_shared<const MovingVolume>(carried_up(frame, 2.0F));
  MovingVolume next = carried_up(frame, 3.0F);
  next.whole_before = coarse->whole;
  const auto better = std::make_shared<const MovingVolume>(std::move(next));
  ViewChoices choices;
  choices.hand = false;
  const Eye eye = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const auto share_at = [&](ScenePicture& picture, double s) {
    SceneSnapshot snapshot = snapshot_at({});
    snapshot.now_ns = int64_t(1e9 * s);
    return picture.at(snapshot, snapshot.now_ns, {&eye, 1}).volumes.at(0).whole_share;
  };
  ScenePicture picture(choices);
  picture.update(scene_of(coarse));
  EXPECT_EQ(share_at(picture, 10.0), 1.0);
  EXPECT_EQ(share_at(picture, 20.0), 1.0);
  EXPECT_TRUE(picture.update(scene_of(better)));
  EXPECT_EQ(share_at(picture, 20.0), 0.0);
  EXPECT_NEAR(share_at(picture, 20.25), 0.5, 1e-9);
  // Another scene of the same volume changes nothing.
  EXPECT_FALSE(picture.update(scene_of(better)));
  EXPECT_GT(share_at(picture, 20.4), 0.5);
  EXPECT_LT(share_at(picture, 20.4), 1.0);
  EXPECT_EQ(share_at(picture, 20.6), 1.0);
  // Without a picture before, and where pictures are rare, the better motion is shown at once.
  ScenePicture first(choices);
  first.update(scene_of(better));
  EXPECT_EQ(share_at(first, 20.0), 1.0);
  ScenePicture rare(choices);
  rare.update(scene_of(coarse));
  share_at(rare, 20.0);
  rare.update(scene_of(better));
  EXPECT_EQ(share_at(rare, 21.5), 1.0);
}

TEST(ScenePicture, ABareFingertipShowsContactByItsColour) {
  const auto scene = scene_of(test::still(streams()), "follow", VectorProperty::kVector, false);
  ViewChoices choices;
  choices.box = false;
  choices.fingertip = true;
  choices.full_force_n = 2.0;
  ScenePicture picture(choices);
  picture.update(scene);
  const Eye eye = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const auto ball = [&](bool contact, double force_n) {
    SceneSnapshot snapshot = snapshot_at(glm::dvec3(0.0));
    // Deeper than the proxy, which the wall holds.
    snapshot.probe_m = {1.01, 0.0, 0.0};
    snapshot.in_contact = contact;
    snapshot.force_n = {force_n, 0.0, 0.0};
    const Things things = picture.at(snapshot, 0, {&eye, 1}).things;
    EXPECT_EQ(things.size(), 1U) << "no pen, no arrow";
    EXPECT_EQ(things.at(0).from, contact ? snapshot.proxy_m : snapshot.probe_m);
    return things.at(0).colour;
  };
  const glm::dvec3 free = ball(false, 0.0), light = ball(true, 0.1), hard = ball(true, 2.0);
  EXPECT_GT(glm::distance(free, light), 0.3) << "a touch is visible before there is a force";
  EXPECT_GT(glm::distance(light, hard), 0.3);
  EXPECT_EQ(ball(true, 9.0), hard);
}

TEST(ScenePicture, ALineFromTheTipShowsItsHeightAboveTheWallUntilItTouches) {
  // The value is 9.5 in the middle, where the wall is.
  SceneSpec spec;
  spec.volumes.resize(1);
  spec.volumes[0].name = "data";
  spec.modes.resize(1);
  spec.modes[0].name = spec.modes[0].kind = "surface";
  spec.modes[0].volume = "data";
  spec.modes[0].strength = *TransferFunction::linear({9.0, 10.0}, {0.0, 1.0});
  const auto scene = *plan(spec, {test::still(ramp())});
  ViewChoices choices;
  choices.box = false;
  ScenePicture picture(choices);
  picture.update(scene);
  const Eye eye = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  SceneSnapshot snapshot = snapshot_at({});
  const auto lowest_m = [&] {
    double lowest = 1e300;
    for (const RoundCone& one : picture.at(snapshot, 0, {&eye, 1}).things)
      lowest = std::min({lowest, one.from.y, one.to.y});
    return lowest;
  };
  for (const double height_m : {0.004, 0.012}) {
    snapshot.probe_m = snapshot.proxy_m = {1.002, height_m, 0.003};
    EXPECT_NEAR(lowest_m(), 0.0, 2e-4) << height_m;
  }
  snapshot.in_contact = true;
  EXPECT_GT(lowest_m(), 0.01);
  // Nothing is below.
  snapshot.in_contact = false;
  snapshot.probe_m = snapshot.proxy_m = {1.002, -0.004, 0.003};
  EXPECT_GT(lowest_m(), -0.006);
}

TEST(ScenePicture, ThePenTurnsWithTheHandWhereThatIsSensed) {
  const auto scene = scene_of(test::still(streams()), "follow", VectorProperty::kVector, false);
  ViewChoices choices;
  choices.box = false;
  ScenePicture picture(choices);
  picture.update(scene);
  const auto shaft = [&](glm::dvec3 sensed, const Eye& eye) {
    SceneSnapshot snapshot = snapshot_at(glm::dvec3(0.0));
    snapshot.shaft = sensed;
    const Things things = picture.at(snapshot, 0, {&eye, 1}).things;
    EXPECT_EQ(things.at(0).from, snapshot.probe_m) << "its tip";
    return glm::normalize(things.at(0).to - things.at(0).from);
  };
  const Eye front = eye_at({1.0, 0.0, 0.3}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const Eye side = eye_at({1.3, 0.0, 0.0}, {1.0, 0.0, 0.0}, 0.5, {64, 64});
  const glm::dvec3 up(0.0, 1.0, 0.0);
  EXPECT_LT(glm::distance(shaft(up, front), up), 1e-12);
  EXPECT_LT(glm::distance(shaft(up, side), up), 1e-12) << "whoever looks";
  EXPECT_GT(glm::distance(shaft(glm::dvec3(0.0), front), shaft(glm::dvec3(0.0), side)), 0.5)
      << "of a device that does not sense it the tip is visible for every eye";
}

/// A host's device with a button, in the molecule.
TEST(Session, ReleasesTubesByTheDevicesButtonAndByCommand) {
  auto loaded = loading::load_scene({"molecule"}, {});
  ASSERT_TRUE(loaded) << loaded.error().message;
  DeviceInfo info;
  info.kind = "test";
  info.max_force_n = 10.0;
  info.workspace_radius_m = 1.0;
  for (const bool buttons : {true, false}) {
    SessionOptions options;
    options.tube_buttons = buttons ? 1 : 0;
    auto session = Session::start_in_host(*loaded, info, options);
    ASSERT_TRUE(session) << session.error().message;
    int64_t now_ns = 1'000'000'000;
    const auto ticks = [&](int count, uint32_t down) {
      for (int k = 0; k < count; ++k)
        (*session)->tick({{0.005, 0.01, 0.02}, now_ns += 1'000'000, down});
    };
    ticks(50, 0);
    ticks(50, 1);
    ticks(50, 0);
    EXPECT_TRUE((*session)->release_tube());
    ticks(50, 0);
    (*session)->stop();
    const auto tubes = (*session)->tubes();
    ASSERT_EQ(tubes->size(), buttons ? 2U : 1U);
    EXPECT_EQ(tubes->front().tube->field(), TubeField::kGradient);
  }
}

}  // namespace
}  // namespace palpate
