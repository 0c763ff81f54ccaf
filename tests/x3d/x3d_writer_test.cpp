#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/x3d/x3d_file.h"
#include "module/scene/built_in.h"
#include "module/scene/drive.h"

namespace palpate::x3d {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A scene that uses everything that X3D can express.
SceneSpec sayable() {
  SceneSpec scene;
  scene.stiffness_n_per_m = 512.25;
  scene.damping_n_s_per_m = 0.3;
  scene.max_force_n = 3.1;
  scene.world_from_device.translation_m = {0.1, -0.2, 0.3};
  scene.world_from_device.scale = glm::dvec3(1.5);
  VolumeSpec chest;
  chest.name = "a chest & <heart>";
  chest.files = {"/data/ct 1.nrrd"};
  chest.box_m = glm::dvec3(0.31, 0.42, 0.53);
  chest.appearance.shown = false;
  chest.segments.files = {"/data/labels.nrrd"};
  chest.transform.rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3)));
  chest.transform.translation_m = {0.01, 0.02, 0.03};
  chest.transform.scale = {1.0, 2.0, 0.5};
  VolumeSpec heart;
  heart.name = "heart";
  heart.files = {"/data/0.mha", "/data/1.mha", "/data/2.mha"};
  heart.box_m = glm::dvec3(0.1);
  heart.cycle_s = 0.8;
  heart.cyclic = false;
  heart.drive.kind = DriveSpec::Kind::kTurn;
  heart.drive.axis = glm::normalize(glm::dvec3(1.0, 2.0, -0.5));
  heart.drive.centre_m = {0.1, 0.0, 0.2};
  heart.drive.rate_hz = -0.3;
  heart.transform.translation_m = {0.1, 0.1, 0.1};
  heart.path = PosePath::kExact;
  VolumeSpec flow;
  flow.name = "flow";
  flow.files = {"/data/flow.nrrd"};
  flow.appearance.tubes = true;
  flow.drive.kind = DriveSpec::Kind::kKeys;
  KeyedPose outer, inner;
  outer.pose.translation_m = {0.0, 0.5, 0.0};
  outer.rotation = {
      {0.0, 0.3, 1.0},
      {glm::angleAxis(0.1, glm::dvec3(0, 0, 1)), glm::angleAxis(1.0, glm::dvec3(0, 1, 0)),
       glm::angleAxis(0.1, glm::dvec3(0, 0, 1))},
      2.5,
      true};
  inner.translation_m = {{0.0, 1.0}, {{0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}}, 1.25, false};
  inner.scale = {{0.0, 1.0}, {glm::dvec3(1.0), glm::dvec3(1.1)}, 1.25, false};
  flow.drive.poses = {outer, inner};
  flow.path = PosePath::kExact;
  VolumeSpec bytes, bare;
  bytes.name = "bytes";
  bytes.files = {"/data/bytes.raw"};
  bytes.raw = {{64, 32, 16}, SampleType::kInt16, 1, glm::dvec3(0.001)};
  bytes.box_m = glm::dvec3(0.2);
  bare.name = "bare";
  bare.files = {"/data/bare.raw"};
  bare.raw = {{4, 3, 2}, SampleType::kFloat, 3, {0.0025, 0.015, 0.06}};
  VolumeSpec charges;
  charges.name = "charges";
  charges.source = "charges";
  charges.charges = {{{0.1, 0.2, 0.3}, -1.5, 0.01}, {{0.0, 0.0, 0.1}, 2.5, 0.02}};
  charges.box_m = glm::dvec3(0.5);
  scene.volumes = {chest, heart, flow, charges, bytes, bare};
  scene.tool_radius_m = 0.003;
  scene.tool_points = 5;
  const auto mode = [&](const char* name, const char* kind, const char* volume) -> ModeSpec& {
    ModeSpec m;
    m.name = name;
    m.kind = kind;
    m.volume = volume;
    m.strength = TransferFunction::constant(2.0);
    scene.modes.push_back(m);
    return scene.modes.back();
  };
  ModeSpec& wall = mode("the wall", "surface", "a chest & <heart>");
  wall.strength = *TransferFunction::linear({0.1, 0.1, 7.0}, {0.0, 1.0 / 3.0, 4.0});
  wall.friction = *TransferFunction::stepped({0.0, 5.0}, {0.1, 0.2});
  wall.two_sided = wall.leaving = true;
  wall.scalar = ScalarProperty::kGradientMagnitude;
  wall.segment = "left \"lobe\"";
  mode("soft", "tissue", "a chest & <heart>").gain = 2.0;
  mode("push", "gradient-force", "heart").gain = -0.5;
  mode("thick", "viscosity", "heart");
  ModeSpec& point = mode("point", "attractor", "heart");
  point.point_m = {0.01, 0.02, 0.03};
  point.range_m = 0.04;
  point.on = false;
  mode("along", "follow", "flow").vector = VectorProperty::kCurl;
  mode("core", "vortex", "flow");
  mode("stream", "vector-force", "flow");
  mode("front", "front", "charges").vector = VectorProperty::kGradient;
  return scene;
}

void expect_near(const Transform& a, const Transform& b) {
  EXPECT_LT(glm::length(a.translation_m - b.translation_m), 1e-12);
  EXPECT_GT(std::abs(glm::dot(a.rotation, b.rotation)), 1.0 - 1e-14);
  EXPECT_LT(glm::length(a.scale - b.scale), 1e-12);
}

void expect_same(const SceneSpec& a, const SceneSpec& b) {
  EXPECT_EQ(a.stiffness_n_per_m, b.stiffness_n_per_m);
  EXPECT_EQ(a.damping_n_s_per_m, b.damping_n_s_per_m);
  EXPECT_EQ(a.max_force_n, b.max_force_n);
  EXPECT_EQ(a.tool_radius_m, b.tool_radius_m);
  EXPECT_EQ(a.tool_points, b.tool_points);
  expect_near(a.world_from_device, b.world_from_device);
  ASSERT_EQ(a.volumes.size(), b.volumes.size());
  for (size_t k = 0; k < a.volumes.size(); ++k) {
    const VolumeSpec &v = a.volumes[k], &w = b.volumes[k];
    SCOPED_TRACE(v.name);
    EXPECT_EQ(v.name, w.name);
    EXPECT_EQ(v.source, w.source);
    EXPECT_EQ(v.charges, w.charges);
    EXPECT_EQ(v.files, w.files);
    EXPECT_EQ(v.raw, w.raw);
    EXPECT_EQ(v.box_m, w.box_m);
    EXPECT_EQ(v.cycle_s, w.cycle_s);
    EXPECT_EQ(v.cyclic, w.cyclic);
    EXPECT_EQ(v.drive.kind, w.drive.kind);
    EXPECT_EQ(v.path, w.path);
    EXPECT_EQ(v.appearance, w.appearance);
    EXPECT_EQ(v.segments.files, w.segments.files);
    for (const double time_s : {0.0, 0.4, 1.7, 30.0})
      expect_near(driven(v.drive, v.transform, time_s), driven(w.drive, w.transform, time_s));
  }
  ASSERT_EQ(a.modes.size(), b.modes.size());
  for (size_t k = 0; k < a.modes.size(); ++k) {
    const ModeSpec &m = a.modes[k], &n = b.modes[k];
    SCOPED_TRACE(m.name);
    EXPECT_EQ(m.name, n.name);
    EXPECT_EQ(m.kind, n.kind);
    EXPECT_EQ(m.volume, n.volume);
    EXPECT_EQ(m.segment, n.segment);
    EXPECT_EQ(m.scalar, n.scalar);
    EXPECT_EQ(m.vector, n.vector);
    EXPECT_EQ(m.strength.in(), n.strength.in());
    EXPECT_EQ(m.strength.out(), n.strength.out());
    EXPECT_EQ(m.friction.in(), n.friction.in());
    EXPECT_EQ(m.friction.out(), n.friction.out());
    EXPECT_EQ(m.friction.is_stepped(), n.friction.is_stepped());
    EXPECT_EQ(m.gain, n.gain);
    EXPECT_EQ(m.two_sided, n.two_sided);
    EXPECT_EQ(m.leaving, n.leaving);
    EXPECT_EQ(m.point_m, n.point_m);
    EXPECT_EQ(m.range_m, n.range_m);
    EXPECT_EQ(m.on, n.on);
  }
}

TEST(X3dWriter, ComesBackAsItWasWritten) {
  const SceneSpec scene = sayable();
  const auto text = x3d_text(scene, "/data/scene.x3d");
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_THAT(text->notes, IsEmpty());
  // Relative to the scene.
  EXPECT_THAT(text->text, HasSubstr("\"ct 1.nrrd\""));
  const auto back = parse_x3d("/data/scene.x3d", text->text);
  ASSERT_TRUE(back) << back.error().message << text->text;
  EXPECT_THAT(back->notes, IsEmpty());
  expect_same(back->spec, scene);
}

TEST(X3dWriter, NamesWhatX3dCanNotSay) {
  SceneSpec scene = sayable();
  VolumeSpec& v = scene.volumes[0];
  v.motions = {{"data", {"/data/f"}, {}}};
  v.rate = 2.0;
  v.appearance.preset = "CT lung";
  v.drive.kind = DriveSpec::Kind::kSecondHand;
  scene.modes[0].motion = "data";
  scene.modes[1].kind = "ripple";
  EXPECT_THAT(x3d_text(scene, "s.x3d")->notes,
              ElementsAre(AllOf(HasSubstr("a chest"), HasSubstr("motions"), HasSubstr("rate"),
                                HasSubstr("view"), HasSubstr("the second hand")),
                          HasSubstr("motion of the mode \"the wall\""), HasSubstr("\"soft\"")));
  scene = sayable();
  scene.volumes[0].segments.files.clear();
  scene.volumes[0].segments.from = SegmentsFrom::kRegion;
  EXPECT_THAT(x3d_text(scene, "s.x3d")->notes, ElementsAre(HasSubstr("left out: segments.")));
  scene = sayable();
  scene.session = R"({"watchdog_s": 0.01})";
  EXPECT_THAT(x3d_text(scene, "s.x3d")->notes, ElementsAre(HasSubstr("section session")));
  scene = heart_scene();
  EXPECT_THAT(x3d_text(scene, "s.x3d").error().message, HasSubstr("palpate phantom"));
  scene = sayable();
  scene.volumes[0].box_m.reset();
  scene.volumes[0].centred = false;
  EXPECT_THAT(x3d_text(scene, "s.x3d").error().message, HasSubstr("give it a box"));
}

TEST(X3dWriter, SwingsInSmallPieces) {
  SceneSpec scene = sayable();
  scene.volumes.resize(2);
  std::erase_if(scene.modes,
                [](const ModeSpec& m) { return m.volume == "flow" || m.volume == "charges"; });
  VolumeSpec& v = scene.volumes[1];
  v.drive.kind = DriveSpec::Kind::kSwing;
  v.drive.amplitude_m = 0.02;
  const auto text = x3d_text(scene, "/data/s.x3d");
  ASSERT_TRUE(text);
  EXPECT_THAT(text->notes, ElementsAre(HasSubstr("swing")));
  const auto back = parse_x3d("/data/s.x3d", text->text);
  ASSERT_TRUE(back) << back.error().message;
  for (double t = 0.0; t < 7.0; t += 0.013) {
    const Transform a = driven(v.drive, v.transform, t);
    const Transform b = driven(back->spec.volumes[1].drive, back->spec.volumes[1].transform, t);
    // A chord over 1/64 of a circle is at most 0.12 % of the radius away from its arc.
    EXPECT_LT(glm::length(a.translation_m - b.translation_m), 0.0013 * v.drive.amplitude_m);
  }
}

}  // namespace
}  // namespace palpate::x3d
