#include "integration/files/scene/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "module/scene/built_in.h"
#include "tests/files/fuzz/parse_bytes.h"
#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string scene_refusal(const std::string& text) {
  const auto scene = parse_scene("folder/scene.json", text);
  return scene ? "" : scene.error().message;
}

SceneSpec accepted(const std::string& text) {
  const auto scene = parse_scene("folder/scene.json", text);
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? *scene : SceneSpec{};
}

const std::string kVolume = R"("volumes": [{"name": "a", "source": "heart"}])";
const std::string kMode = R"("modes": [{"strength": 1}])";

/// A scene with one more key in its root.
std::string scene_with(const std::string& key) {
  return "{" + kVolume + "," + kMode + "," + key + "}";
}
std::string volume_with(const std::string& key) {
  return R"({"volumes": [{"name": "a", "source": "heart", )" + key + "}]," + kMode + "}";
}
std::string mode_with(const std::string& key) {
  return "{" + kVolume + R"(, "modes": [{)" + key + "}]}";
}

void expect_same(const Transform& a, const Transform& b) {
  EXPECT_EQ(a.translation_m, b.translation_m);
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.scale, b.scale);
}

void expect_same(const TransferFunction& a, const TransferFunction& b) {
  EXPECT_EQ(a.in(), b.in());
  EXPECT_EQ(a.out(), b.out());
  EXPECT_EQ(a.is_stepped(), b.is_stepped());
}

void expect_same(const SceneSpec& a, const SceneSpec& b) {
  EXPECT_EQ(a.stiffness_n_per_m, b.stiffness_n_per_m);
  EXPECT_EQ(a.damping_n_s_per_m, b.damping_n_s_per_m);
  EXPECT_EQ(a.max_force_n, b.max_force_n);
  EXPECT_EQ(a.tool_radius_m, b.tool_radius_m);
  EXPECT_EQ(a.tool_points, b.tool_points);
  expect_same(a.world_from_device, b.world_from_device);
  ASSERT_EQ(a.volumes.size(), b.volumes.size());
  for (size_t k = 0; k < a.volumes.size(); ++k) {
    const VolumeSpec &v = a.volumes[k], &w = b.volumes[k];
    EXPECT_EQ(v.name, w.name);
    EXPECT_EQ(v.source, w.source);
    EXPECT_EQ(v.files, w.files);
    EXPECT_EQ(v.raw, w.raw);
    ASSERT_EQ(v.motions.size(), w.motions.size());
    for (size_t m = 0; m < v.motions.size(); ++m) {
      EXPECT_EQ(v.motions[m].name, w.motions[m].name);
      EXPECT_EQ(v.motions[m].fields, w.motions[m].fields);
      EXPECT_EQ(v.motions[m].confidences, w.motions[m].confidences);
    }
    expect_same(v.transform, w.transform);
    EXPECT_EQ(v.centred, w.centred);
    EXPECT_EQ(v.drive.kind, w.drive.kind);
    EXPECT_EQ(v.drive.axis, w.drive.axis);
    EXPECT_EQ(v.drive.centre_m, w.drive.centre_m);
    EXPECT_EQ(v.drive.rate_hz, w.drive.rate_hz);
    EXPECT_EQ(v.drive.amplitude_m, w.drive.amplitude_m);
    EXPECT_EQ(v.drive.poses, w.drive.poses);
    EXPECT_EQ(v.charges, w.charges);
    EXPECT_EQ(v.box_m, w.box_m);
    EXPECT_EQ(v.cycle_s, w.cycle_s);
    EXPECT_EQ(v.path, w.path);
    EXPECT_EQ(v.back_tracking, w.back_tracking);
    EXPECT_EQ(v.frames_per_second, w.frames_per_second);
    EXPECT_EQ(v.rate, w.rate);
    EXPECT_EQ(v.cyclic, w.cyclic);
    EXPECT_EQ(v.values, w.values);
    EXPECT_EQ(v.blend_values, w.blend_values);
    EXPECT_EQ(v.appearance, w.appearance);
    EXPECT_EQ(v.segments.from, w.segments.from);
    EXPECT_EQ(v.segments.iso_value, w.segments.iso_value);
    EXPECT_EQ(v.segments.smooth_mm, w.segments.smooth_mm);
    EXPECT_EQ(v.segments.files, w.segments.files);
    EXPECT_EQ(v.segments.frame, w.segments.frame);
    EXPECT_EQ(v.segments.parts, w.segments.parts);
  }
  ASSERT_EQ(a.modes.size(), b.modes.size());
  for (size_t k = 0; k < a.modes.size(); ++k) {
    const ModeSpec &m = a.modes[k], &n = b.modes[k];
    EXPECT_EQ(m.name, n.name);
    EXPECT_EQ(m.kind, n.kind);
    EXPECT_EQ(m.volume, n.volume);
    EXPECT_EQ(m.motion, n.motion);
    EXPECT_EQ(m.segment, n.segment);
    EXPECT_EQ(m.scalar, n.scalar);
    EXPECT_EQ(m.vector, n.vector);
    expect_same(m.strength, n.strength);
    expect_same(m.friction, n.friction);
    EXPECT_EQ(m.gain, n.gain);
    EXPECT_EQ(m.two_sided, n.two_sided);
    EXPECT_EQ(m.leaving, n.leaving);
    EXPECT_EQ(m.point_m, n.point_m);
    EXPECT_EQ(m.range_m, n.range_m);
    EXPECT_EQ(m.on, n.on);
  }
}

/// A scene that contains every object of the format, with no value at its default.
const char* const kEverything = R"({
  "stiffness_n_per_m": 700.5, "damping_n_s_per_m": 0.1, "max_force_n": 3.5, "tool_radius_m": 0.0025, "tool_points": 3,
  "world_from_device": {"translation_m": [0.1, 0.2, 0.3], "rotation": {"axis": [1, 2, 3], "degrees": 33}, "scale": 2},
  "volumes": [
    {"name": "a", "files": ["x.nrrd", "sub/y.nrrd", "/absolute/z.nrrd"],
     "motions": [{"name": "flow", "fields": ["f0.mha", "f1.mha", "f2.mha"], "confidences": ["c0.mha", "c1.mha", "c2.mha"]},
                 {"name": "front", "fields": "fields"}],
     "transform": {"translation_m": [1, 0, -1], "quaternion_wxyz": [0.6, 0.8, 0, 0], "scale": [1, 2, 0.5]},
     "centred": false,
     "drive": {"kind": "swing", "axis": [0, 0, 2], "centre_m": [0, 0.1, 0], "rate_hz": -0.5, "amplitude_m": 0.02},
     "path": "paper", "back_tracking": "picard", "frames_per_second": 12.5, "rate": -0.5, "cyclic": false,
     "values": "mean", "blend_values": false,
     "segments": {"files": "lv.seg.nrrd", "frame": 2,
                  "parts": [{"name": "outside", "labels": [1, "pool"], "colour": [0.5, 0, 1], "felt": false,
                             "shown": false, "strength_n": 3, "friction": 0.5, "stiffness_n_per_m": 800},
                            {"name": "pool"}]},
     "view": {"look": "CT lung", "window": {"level": -600, "width": 1500}, "shown": false}},
    {"name": "b", "source": "molecule", "path": "exact", "drive": {"kind": "turn"},
     "view": {"points": [[-1, [0, 0.5, 1], 0.25], [2.5, [1, 0, 0], 0]], "points_of_range": true, "tubes": true, "tubes_per_axis": 3,
              "segments": false, "segment_opacity": 0.7},
     "transform": {"matrix": [[0, -2, 0, 0.1], [2, 0, 0, 0.2], [0, 0, 3, 0.3], [0, 0, 0, 1]]}},
    {"name": "c", "source": "heart-exact", "drive": {"kind": "second-hand"},
     "transform": {"rotation": {"axis": [0, 0, 1], "degrees": 180}}},
    {"name": "d", "source": "charges", "box_m": [0.1, 0.2, 0.3],
     "charges": [{"position_m": [0.01, 0, 0.02], "strength_v_m": -0.5, "softness_m": 0.003}, {"strength_v_m": 1}]},
    {"name": "e", "files": "e.nrrd", "box_m": [1, 2, 3], "cycle_s": 0.75, "path": "smooth",
     "segments": {"from": "ridges", "iso_value": -5.5, "smooth_mm": 2, "parts": [{"name": "edge", "strength_n": 2}]},
     "drive": {"kind": "keys", "poses": [
       {"pose": {"translation_m": [0, 1, 0], "quaternion_wxyz": [0.6, 0, 0.8, 0]},
        "quaternion_wxyz": {"cycle_s": 2.5, "keys": [[0, [1, 0, 0, 0]], [1, [0.8, 0.6, 0, 0]]]}},
       {"pose": {"rotation": {"axis": [1, 0, 0], "degrees": 20}},
        "translation_m": {"cycle_s": 3, "loop": false, "keys": [[0, [0, 0, 0]], [0.5, [1, 2, 3]]]},
        "scale": {"keys": [[0, [1, 1, 1]], [1, [2, 2, 2]]]}},
       {"pose": {"scale": 2}}, {"pose": {"matrix": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}}]}},
    {"name": "f", "files": "f.raw",
     "raw": {"size": [4, 3, 2], "type": "float32", "components": 3, "spacing_m": [0.001, 0.002, 0.003]}},
    {"name": "g", "files": "g.nii", "nan_as": -1000.5}
  ],
  "modes": [
    {"name": "m0", "kind": "surface", "volume": "a", "motion": "front", "scalar": "gradient-magnitude", "vector": "gradient",
     "strength": {"pairs": [[0, 0], [10, 2.5], [10, 3]]}, "friction": {"pairs": [[0, 0.1], [5, 0.3]], "stepped": true},
     "two_sided": true, "leaving": true, "on": false},
    {"name": "m1", "kind": "vector-force", "volume": "a", "vector": "curl", "gain": -2},
    {"name": "m2", "kind": "attractor", "volume": "b", "scalar": "curl-magnitude", "strength": 2,
     "point_m": [0.01, 0, 0], "range_m": 0.05},
    {"name": "m3", "kind": "front", "volume": "a", "strength": {"window": {"level": 5, "width": 2, "full": 4}}},
    {"name": "m4", "volume": "c", "motion": "data", "strength": 1,
     "friction": {"window": {"level": 5, "width": 2, "full": 0.4}}},
    {"name": "m5", "volume": "a", "segment": "outside", "strength": 1}
  ]
})";

TEST(SceneFile, KeepsTheOptionsOfASession) {
  const SceneSpec scene = accepted(scene_with(R"("session": {"watchdog_s": 0.01})"));
  EXPECT_EQ(scene.session, R"({"watchdog_s":0.01})");
  EXPECT_EQ(accepted(scene_text(scene)).session, scene.session);
  EXPECT_THAT(scene_refusal(scene_with(R"("session": 3)")),
              HasSubstr("session: the options of the session are expected"));
}

TEST(SceneFile, ReadsEveryKey) {
  const SceneSpec s = accepted(kEverything);
  EXPECT_EQ(s.stiffness_n_per_m, 700.5);
  EXPECT_EQ(s.damping_n_s_per_m, 0.1);
  EXPECT_EQ(s.max_force_n, 3.5);
  EXPECT_EQ(s.tool_radius_m, 0.0025);
  EXPECT_EQ(s.tool_points, 3);
  EXPECT_EQ(s.world_from_device.translation_m, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_EQ(s.world_from_device.scale, glm::dvec3(2.0));
  EXPECT_NEAR(glm::angle(s.world_from_device.rotation), glm::radians(33.0), 1e-14);
  EXPECT_LT(
      glm::length(glm::axis(s.world_from_device.rotation) - glm::normalize(glm::dvec3(1, 2, 3))),
      1e-14);
  ASSERT_EQ(s.volumes.size(), 7u);
  EXPECT_EQ(s.volumes[6].nan_as, -1000.5);
  const VolumeSpec& a = s.volumes[0];
  EXPECT_THAT(a.files,
              ::testing::ElementsAre("folder/x.nrrd", "folder/sub/y.nrrd", "/absolute/z.nrrd"));
  ASSERT_EQ(a.segments.parts.size(), 2u);
  EXPECT_THAT(a.segments.files, ::testing::ElementsAre("folder/lv.seg.nrrd"));
  EXPECT_EQ(a.segments.frame, 2u);
  EXPECT_THAT(a.segments.parts[0].labels, ::testing::ElementsAre("1", "pool"));
  EXPECT_EQ(a.segments.parts[0].colour, glm::dvec3(0.5, 0.0, 1.0));
  EXPECT_EQ(a.segments.parts[0].stiffness_n_per_m, 800.0);
  EXPECT_FALSE(a.segments.parts[0].felt);
  SegmentSpec usual;
  usual.name = "pool";
  EXPECT_EQ(a.segments.parts[1], usual);
  ASSERT_EQ(a.motions.size(), 2u);
  EXPECT_EQ(a.motions[0].name, "flow");
  EXPECT_EQ(a.motions[0].fields[1], "folder/f1.mha");
  EXPECT_EQ(a.motions[0].confidences[2], "folder/c2.mha");
  EXPECT_THAT(a.motions[1].fields, ::testing::ElementsAre("folder/fields"));
  EXPECT_EQ(a.transform.rotation, glm::dquat(0.6, 0.8, 0.0, 0.0));
  EXPECT_EQ(a.transform.scale, glm::dvec3(1.0, 2.0, 0.5));
  EXPECT_FALSE(a.centred);
  EXPECT_EQ(a.drive.kind, DriveSpec::Kind::kSwing);
  EXPECT_EQ(a.drive.axis, glm::dvec3(0, 0, 2));
  EXPECT_EQ(a.drive.centre_m, glm::dvec3(0, 0.1, 0));
  EXPECT_EQ(a.drive.rate_hz, -0.5);
  EXPECT_EQ(a.drive.amplitude_m, 0.02);
  EXPECT_EQ(a.path, PosePath::kPaper);
  EXPECT_EQ(a.back_tracking, BackTracking::kPicard);
  EXPECT_EQ(a.frames_per_second, 12.5);
  EXPECT_EQ(a.rate, -0.5);
  EXPECT_FALSE(a.cyclic);
  EXPECT_EQ(a.values, CarriedValues::kMean);
  EXPECT_FALSE(a.blend_values);
  EXPECT_EQ(s.volumes[1].source, "molecule");
  EXPECT_EQ(s.volumes[1].path, PosePath::kExact);
  EXPECT_EQ(s.volumes[1].drive.kind, DriveSpec::Kind::kTurn);
  EXPECT_LT(
      glm::length(s.volumes[1].transform.world_from_volume({1, 1, 1}) - glm::dvec3(-1.9, 2.2, 3.3)),
      1e-14);
  EXPECT_EQ(s.volumes[2].drive.kind, DriveSpec::Kind::kSecondHand);
  const VolumeSpec &d = s.volumes[3], &e = s.volumes[4];
  EXPECT_EQ(d.box_m, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_THAT(d.charges, ::testing::ElementsAre(PointCharge{{0.01, 0.0, 0.02}, -0.5, 0.003},
                                                PointCharge{{0.0, 0.0, 0.0}, 1.0, 0.01}));
  EXPECT_EQ(e.box_m, glm::dvec3(1, 2, 3));
  EXPECT_EQ(e.cycle_s, 0.75);
  EXPECT_EQ(e.drive.kind, DriveSpec::Kind::kKeys);
  EXPECT_EQ(e.path, PosePath::kSmooth);
  ASSERT_EQ(e.drive.poses.size(), 4u);
  EXPECT_EQ(e.drive.poses[0].pose.translation_m, glm::dvec3(0, 1, 0));
  EXPECT_EQ(e.drive.poses[0].rotation.cycle_s, 2.5);
  EXPECT_EQ(e.drive.poses[0].rotation.values[1], glm::dquat(0.8, 0.6, 0, 0));
  EXPECT_TRUE(e.drive.poses[0].rotation.loop);
  EXPECT_FALSE(e.drive.poses[1].translation_m.loop);
  EXPECT_THAT(e.drive.poses[1].translation_m.keys, ::testing::ElementsAre(0.0, 0.5));
  EXPECT_EQ(e.drive.poses[1].translation_m.values[1], glm::dvec3(1, 2, 3));
  EXPECT_EQ(e.drive.poses[1].scale.cycle_s, 1.0);
  EXPECT_EQ(e.drive.poses[1].scale.values[1], glm::dvec3(2.0));
  EXPECT_FALSE(e.raw);
  EXPECT_EQ(s.volumes[5].raw,
            (RawSamples{{4, 3, 2}, SampleType::kFloat, 3, {0.001, 0.002, 0.003}}));
  ASSERT_EQ(s.modes.size(), 6u);
  const ModeSpec& m = s.modes[0];
  EXPECT_EQ(m.motion, "front");
  EXPECT_EQ(m.scalar, ScalarProperty::kGradientMagnitude);
  EXPECT_EQ(m.vector, VectorProperty::kGradient);
  EXPECT_EQ(m.strength(5.0), 1.25);
  EXPECT_EQ(m.strength(10.0), 3.0);
  EXPECT_EQ(m.friction(4.999), 0.1);
  EXPECT_TRUE(m.two_sided && m.leaving && !m.on);
  EXPECT_EQ(s.modes[1].gain, -2.0);
  EXPECT_EQ(s.modes[1].vector, VectorProperty::kCurl);
  EXPECT_EQ(s.modes[2].strength(1e9), 2.0);
  EXPECT_EQ(s.modes[2].point_m, glm::dvec3(0.01, 0, 0));
  EXPECT_EQ(s.modes[2].range_m, 0.05);
  EXPECT_EQ(s.modes[3].strength(5.0), 2.0);
  EXPECT_EQ(s.modes[4].kind, "surface");
  EXPECT_EQ(s.modes[4].friction(6.0), 0.4);
}

TEST(SceneFile, RefusesBoxesChargesAndKeysThatCanNotBe) {
  const std::string files = R"("volumes": [{"name": "a", "files": "a.nrrd", )";
  const auto of_files = [&](const std::string& keys) {
    return scene_refusal("{" + files + keys + "}]," + kMode + "}");
  };
  EXPECT_THAT(volume_with(R"("box_m": [1, 1, 1])"),
              ::testing::ResultOf(scene_refusal, HasSubstr("box_m")));
  EXPECT_THAT(of_files(R"("box_m": [1, 0, 1])"), HasSubstr("volumes[0].box_m"));
  EXPECT_THAT(of_files(R"("box_m": [1, 1, 1], "centred": false)"), HasSubstr("centred"));
  EXPECT_THAT(of_files(R"("cycle_s": 1, "frames_per_second": 2)"), HasSubstr("cycle_s"));
  EXPECT_THAT(of_files(R"("charges": [{"strength_v_m": 1}])"), HasSubstr("charges"));
  const auto drive = [&](const std::string& keys) { return of_files("\"drive\": {" + keys + "}"); };
  EXPECT_THAT(drive(R"("kind": "keys")"), HasSubstr("drive.poses"));
  EXPECT_THAT(drive(R"("poses": [{}])"), HasSubstr("drive.kind"));
  EXPECT_THAT(drive(R"("kind": "keys", "poses": [{"scale": {"keys": [[0, [1, 1]]]}}])"),
              HasSubstr("volumes[0].drive.poses[0].scale.keys[0]"));
  EXPECT_THAT(drive(R"("kind": "keys", "poses": [{"scale": {"keys": [[2, [1, 1, 1]]]}}])"),
              AllOf(HasSubstr("volumes[0].drive"), HasSubstr("rise")));
  EXPECT_THAT(drive(R"("kind": "keys", "poses": [{"translation_m": {"cycle_s": 0, "keys": []}}])"),
              HasSubstr("cycle_s"));
}

TEST(SceneFile, RefusesWhatCanNotBeInAFileWithoutAHeader) {
  const auto of_raw = [&](const std::string& raw, const std::string& files = "\"a.raw\"") {
    return scene_refusal("{\"volumes\": [{\"name\": \"a\", \"files\": " + files + ", \"raw\": {" +
                         raw + "}}]," + kMode + "}");
  };
  const std::string type = R"("type": "uint8", )";
  EXPECT_THAT(of_raw(R"("type": "uint8")"), HasSubstr("volumes[0].raw.size: it is missing"));
  EXPECT_THAT(of_raw(R"("size": [4, 3, 2])"), HasSubstr("volumes[0].raw.type: it is missing"));
  EXPECT_THAT(of_raw(R"("size": [4, 3, 2], "type": "float")"), HasSubstr("\"float32\""));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 0])"), HasSubstr("raw.size"));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 2.5])"), HasSubstr("whole numbers"));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 1e9])"), HasSubstr("raw.size"));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 2], "components": 2)"), HasSubstr("raw.components"));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 2], "spacing_m": [1, 1, 0])"),
              HasSubstr("raw.spacing_m"));
  EXPECT_THAT(of_raw(type + R"("size": [4, 3, 2])", R"(["a.raw", "b.raw"])"),
              HasSubstr("just one file"));
  EXPECT_THAT(
      scene_refusal(R"({"volumes": [{"name": "a", "files": "a.raw", "motions": [{"fields": "f"}],
                          "raw": {"size": [4, 3, 2], "type": "uint8"}}], )" +
                    kMode + "}"),
      HasSubstr("volumes[0].motions: a file without a header"));
}

TEST(SceneFile, SaysHowVolumesAreSeen) {
  const SceneSpec s = accepted(kEverything);
  const AppearanceSpec &ct = s.volumes[0].appearance, &molecule = s.volumes[1].appearance;
  EXPECT_FALSE(ct.shown);
  EXPECT_EQ(ct.preset, "CT lung");
  EXPECT_EQ(ct.window_level, -600.0);
  EXPECT_EQ(ct.width, 1500.0);
  EXPECT_FALSE(ct.tubes);
  const std::vector<LookPoint> points = {{-1.0, {0.0, 0.5, 1.0}, 0.25},
                                         {2.5, {1.0, 0.0, 0.0}, 0.0}};
  EXPECT_EQ(molecule.points, points);
  EXPECT_TRUE(molecule.points_of_range);
  EXPECT_TRUE(molecule.shown);
  EXPECT_EQ(molecule.tubes, true);
  EXPECT_EQ(molecule.tubes_per_axis, 3);
  EXPECT_FALSE(molecule.segments);
  EXPECT_EQ(molecule.segment_opacity, 0.7);
  EXPECT_EQ(s.volumes[2].appearance, AppearanceSpec());
}

TEST(SceneFile, RefusesAViewThatCanNotBeDrawn) {
  const auto view = [](const std::string& keys) {
    return scene_refusal(volume_with(R"("view": {)" + keys + "}"));
  };
  EXPECT_THAT(view(R"("look": "CT bones")"),
              AllOf(HasSubstr("volumes[0].view.look"), HasSubstr("did you mean \"CT bone\"?")));
  EXPECT_THAT(view(R"("points": [[0, [1, 1, 1]]])"),
              AllOf(HasSubstr("volumes[0].view.points[0]"), HasSubstr("[value, [red")));
  EXPECT_THAT(view(R"("points": [[0, [1, 1], 0.1]])"), HasSubstr("view.points[0]"));
  EXPECT_THAT(view(R"("points": [[0, [1, "x", 1], 0.1]])"), HasSubstr("view.points[0]"));
  EXPECT_THAT(view(R"("points": [[1, [1, 1, 1], 0], [0, [1, 1, 1], 0.1]])"),
              HasSubstr("sort the points by value"));
  EXPECT_THAT(view(R"("points": [[0, [1, 2, 1], 0]])"), HasSubstr("colour outside 0 to 1"));
  EXPECT_THAT(view(R"("points": [[0, [1, 1, 1], 1]])"), HasSubstr("opacity outside 0 to 0.999"));
  EXPECT_THAT(view(R"("look": "MR", "points": [[0, [1, 1, 1], 0]])"),
              HasSubstr("give only one of the two"));
  EXPECT_THAT(view(R"("points_of_range": true)"), HasSubstr("there are no points"));
  EXPECT_THAT(view(R"("window": {"width": 2})"), HasSubstr("view.window.level: it is missing"));
  EXPECT_THAT(view(R"("window": {"level": 2})"), HasSubstr("view.window.width: it is missing"));
  EXPECT_THAT(view(R"("window": {"level": 2, "width": 0})"), HasSubstr("view.window.width"));
  EXPECT_THAT(view(R"("tubes": "many")"), HasSubstr("view.tubes: a text stands where"));
  EXPECT_THAT(view(R"("tubes_per_axis": 2.5)"), HasSubstr("a whole number"));
  EXPECT_THAT(view(R"("tubes_per_axis": 25)"), HasSubstr("view.tubes_per_axis"));
  EXPECT_THAT(view(R"("segment_opacity": 1)"), HasSubstr("view.segment_opacity"));
  EXPECT_THAT(view(R"("tube": true)"), HasSubstr("\"tubes\""));
}

TEST(SceneFile, LeavesDefaultsWhereNothingIsSaid) {
  SceneSpec usual;
  VolumeSpec volume;
  volume.name = "a";
  volume.source = "heart";
  ModeSpec mode;
  mode.name = "surface";
  mode.volume = "a";
  mode.strength = TransferFunction::constant(1.0);
  usual.volumes = {volume};
  usual.modes = {mode};
  expect_same(accepted("{" + kVolume + "," + kMode + "}"), usual);
}

TEST(SceneFile, ComesBackAsItWasWritten) {
  const TemporaryFolder folder;
  const auto read_back = [&](const SceneSpec& scene) {
    const auto file = folder / "scene.json";
    const Status written = write_scene(scene, file);
    EXPECT_TRUE(written) << written.error().message;
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    const auto back = parse_scene(file, text.str());
    EXPECT_TRUE(back) << back.error().message;
    return back ? *back : SceneSpec{};
  };
  expect_same(read_back(shell_scene()), shell_scene());
  expect_same(read_back(molecule_scene()), molecule_scene());
  const auto everything = parse_scene(folder / "scene.json", kEverything);
  ASSERT_TRUE(everything);
  expect_same(read_back(*everything), *everything);
}

TEST(SceneFile, WritesPathsRelativeToItself) {
  const TemporaryFolder folder;
  SceneSpec scene = shell_scene();
  scene.volumes[0].source.clear();
  scene.volumes[0].files = {folder / "data/ct.nrrd"};
  ASSERT_TRUE(write_scene(scene, folder / "scene.json"));
  std::ostringstream text;
  text << std::ifstream(folder / "scene.json").rdbuf();
  EXPECT_THAT(text.str(), HasSubstr("\"data/ct.nrrd\""));
}

TEST(SceneFile, IsWhatPeopleReadInTheDocumentation) {
  // The keys of the page's tables must be those that the reader looks up in a scene with every
  // object.
  std::ostringstream text;
  text << std::ifstream(PALPATE_SOURCE_DIR "/docs/scene-file.md").rdbuf();
  const std::string page = text.str();
  ASSERT_FALSE(page.empty());
  std::set<std::string> documented;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string first = line.substr(0, line.find('|', 1));
    const std::regex code("`([^`]+)`");
    for (std::sregex_iterator k(first.begin(), first.end(), code), end; k != end; ++k)
      documented.insert((*k)[1]);
  }
  std::set<std::string> asked;
  ASSERT_TRUE(parse_scene("scene.json", kEverything, {}, &asked));
  EXPECT_EQ(documented, asked);

  // The page's examples must be valid scenes.
  size_t at = 0;
  int examples = 0;
  while ((at = page.find("```json\n", at)) != std::string::npos) {
    const size_t end = page.find("```", at + 8);
    const auto scene = parse_scene("scene.json", page.substr(at + 8, end - at - 8));
    EXPECT_TRUE(scene) << scene.error().message;
    if (scene && examples++ == 0) expect_same(*scene, heart_scene());
    at = end;
  }
  EXPECT_EQ(examples, 3);
}

TEST(SceneFile, RefusesUnknownKeysAndNamesTheNearest) {
  EXPECT_EQ(
      scene_refusal(scene_with(R"("stifness_n_per_m": 1)")),
      "'folder/scene.json' can not be used: the key \"stifness_n_per_m\" is not known: did you "
      "mean \"stiffness_n_per_m\"?");
  EXPECT_THAT(scene_refusal(mode_with(R"("strenght": 1, "strength": 2)")),
              AllOf(HasSubstr("at modes[0]:"), HasSubstr("did you mean \"strength\"")));
  EXPECT_THAT(scene_refusal(volume_with(R"("fps": 2)")), HasSubstr("\"fps\" is not known"));
  EXPECT_THAT(scene_refusal(volume_with(R"("drive": {"rate": 2})")),
              AllOf(HasSubstr("volumes[0].drive:"), HasSubstr("\"rate_hz\"")));
  EXPECT_THAT(scene_refusal(volume_with(R"("transform": {"rotation": {"angle": 2}})")),
              HasSubstr("volumes[0].transform.rotation"));
  EXPECT_THAT(scene_refusal(mode_with(R"("strength": {"window": {"levl": 2}})")),
              HasSubstr("modes[0].strength.window"));
}

TEST(SceneFile, NamesEachKnownKeyOnce) {
  for (const std::string& scene :
       {scene_with(R"("unlike everything": 1)"), volume_with(R"("unlike everything": 1)"),
        volume_with(R"("transform": {"unlike everything": 1})"),
        volume_with(R"("view": {"unlike everything": 1})"),
        mode_with(R"("strength": 1, "friction": 0.1, "unlike everything": 1)"),
        mode_with(R"("strength": {"window": {"level": 1}, "unlike everything": 1})")}) {
    const std::string sentence = scene_refusal(scene);
    const size_t start = sentence.find("known are ");
    ASSERT_NE(start, std::string::npos) << sentence;
    const std::regex word("[a-z_]+");
    std::set<std::string> seen;
    for (std::sregex_iterator at(sentence.begin() + long(start) + 10, sentence.end(), word), end;
         at != end; ++at)
      EXPECT_TRUE(seen.insert(at->str()).second) << at->str() << " is twice in: " << sentence;
  }
}

TEST(SceneFile, RefusesKeysThatHaveNoEffect) {
  EXPECT_THAT(scene_refusal(mode_with(R"("kind": "follow", "strength": 1, "friction": 0.2)")),
              AllOf(HasSubstr("modes[0].friction"), HasSubstr("follow has no use for it")));
  EXPECT_THAT(scene_refusal(mode_with(R"("strength": 1, "range_m": 0.2)")),
              HasSubstr("modes[0].range_m"));
  EXPECT_THAT(scene_refusal(mode_with(R"("strength": 1, "gain": 2)")), HasSubstr("modes[0].gain"));
  EXPECT_EQ(scene_refusal(mode_with(R"("kind": "front", "strength": 1, "two_sided": true)")), "");
}

TEST(SceneFile, RefusesWrongTypesAndNumbersWithTheirPlace) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"[]", "a list stands where an object is expected"},
      {scene_with(R"("stiffness_n_per_m": "hard")"),
       "at stiffness_n_per_m: a text stands where a number"},
      {scene_with(R"("stiffness_n_per_m": 0)"), "0 stands where a number from 1 to 100000"},
      {scene_with(R"("max_force_n": -1)"), "at max_force_n: -1 stands where a number from 0.01 to"},
      {scene_with(R"("max_force_n": 1e9)"),
       "1000000000 stands where a number from 0.01 to 100 N is"},
      {scene_with(R"("damping_n_s_per_m": -1)"), "a number from 0 to 1000"},
      {volume_with(R"("frames_per_second": 1e9)"), "a number from 0 to 100000"},
      {volume_with(R"("rate": 1e9)"), "a number from -1000 to 1000"},
      {volume_with(R"("drive": {"rate_hz": 1e9})"), "a number from -100 to 100"},
      {volume_with(R"("drive": {"amplitude_m": 1e9})"), "a number from 0 to 10"},
      {mode_with(R"("strength": 1e9)"), "a number from 0 to 1000"},
      {mode_with(R"("strength": 1, "friction": 11)"), "a number from 0 to 10"},
      {mode_with(R"("strength": {"pairs": [[0, 1e9]]})"), "a number from 0 to 1000"},
      {mode_with(R"("strength": {"window": {"level": 1, "full": 1e9}})"), "from 0 to 1000"},
      {mode_with(R"("kind": "attractor", "strength": 1, "range_m": 11)"), "a number from 0 to 10"},
      {scene_with(R"("max_force_n": null)"), "null stands"},
      {scene_with(R"("world_from_device": {"scale": 0})"), "world_from_device.scale"},
      {scene_with(R"("world_from_device": {"scale": [1, 1, -1]})"), "world_from_device.scale"},
      {scene_with(R"("world_from_device": 3)"), "a number stands where an object"},
      {volume_with(R"("rate": "fast")"), "at volumes[0].rate: a text"},
      {volume_with(R"("frames_per_second": -2)"), "volumes[0].frames_per_second"},
      {volume_with(R"("cyclic": 1)"), "volumes[0].cyclic: a number stands where true or false"},
      {volume_with(R"("path": "smoth")"), "did you mean \"smooth\"?"},
      {volume_with(R"("path": 3)"), "volumes[0].path: a number stands where a text"},
      {volume_with(R"("drive": {"kind": "rotate"})"), "volumes[0].drive.kind"},
      {volume_with(R"("drive": {"axis": [0, 0, 0]})"), "not all 0"},
      {volume_with(R"("drive": {"axis": [0, 0]})"), "three numbers"},
      {volume_with(R"("drive": {"amplitude_m": -1})"), "amplitude_m"},
      {volume_with(R"("transform": {"quaternion_wxyz": [1, 1, 0, 0]})"), "sum of squares of 1"},
      {volume_with(R"("transform": {"quaternion_wxyz": [1, 0, 0]})"), "[w, x, y, z]"},
      {volume_with(R"("transform": {"quaternion_wxyz": [1, 0, 0, 0], "rotation": {}})"),
       "keep one"},
      {volume_with(
           R"("transform": {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]})"),
       "mirror"},
      {volume_with(
           R"("transform": {"matrix": [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})"),
       "sheared"},
      {volume_with(R"("transform": {"matrix": [[1, 2], [3]]})"), "four rows"},
      {volume_with(R"("transform": {"scale": 2, "matrix": 1})"), "leave out the other keys"},
      {mode_with(R"("strength": -1)"),
       "at modes[0].strength: -1 stands where a number from 0 to 1000"},
      {mode_with(R"("strength": 0)"), "nothing would be felt"},
      {mode_with(R"("name": "x")"), "modes[0].strength: nothing would be felt"},
      {mode_with(R"("strength": [1])"), "modes[0].strength: a list"},
      {mode_with(R"("strength": {})"), "\"pairs\" or a \"window\""},
      {mode_with(R"("strength": {"pairs": []})"), "modes[0].strength.pairs: an empty list"},
      {mode_with(R"("strength": {"pairs": [[0, 1], [1, -2]]})"), "modes[0].strength.pairs[1]"},
      {mode_with(R"("strength": {"pairs": [[0, 1], [1]]})"), "modes[0].strength.pairs[1]"},
      {mode_with(R"("strength": {"pairs": [[1, 1], [0, 2]]})"), "sort the pairs"},
      {mode_with(R"("strength": {"window": {"width": 2}})"),
       "modes[0].strength.window.level: it is missing"},
      {mode_with(R"("strength": {"window": {"level": 1, "width": -2}})"),
       "modes[0].strength.window.width"},
      {mode_with(R"("strength": {"window": {"level": 1, "full": -2}})"),
       "modes[0].strength.window.full"},
      {mode_with(R"("strength": {"window": {"level": 1}, "stepped": true})"), "stepped"},
      {mode_with(R"("strength": 1, "friction": -0.1)"), "modes[0].friction"},
      {mode_with(R"("strength": 1, "scalar": "density")"), "modes[0].scalar"},
      {mode_with(R"("kind": "surfaces", "strength": 1)"), "did you mean \"surface\"?"},
      {mode_with(R"("kind": "attractor", "strength": 1, "point_m": [1, 2, "3"])"),
       "modes[0].point_m"},
  };
  for (const auto& [text, part] : cases) {
    EXPECT_THAT(scene_refusal(text), HasSubstr(part)) << text;
    EXPECT_THAT(scene_refusal(text), HasSubstr("'folder/scene.json'")) << text;
  }
}

TEST(SceneFile, RefusesNamesThatDoNotFit) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"{" + kMode + "}", "at volumes: there is nothing to feel"},
      {R"({"volumes": [], )" + kMode + "}", "at volumes: an empty list"},
      {"{" + kVolume + R"(, "modes": []})", "at modes: an empty list"},
      {R"({"volumes": [{"source": "heart"}], )" + kMode + "}", "volumes[0].name: it is missing"},
      {R"({"volumes": [{"name": "", "source": "heart"}], )" + kMode + "}",
       "volumes[0].name: an empty text"},
      {R"({"volumes": [{"name": "a"}], )" + kMode + "}", "the volume has no data"},
      {R"({"volumes": [{"name": "a", "source": "hart"}], )" + kMode + "}",
       "did you mean \"heart\"?"},
      {R"({"volumes": [{"name": "a", "source": "heart", "files": "x"}], )" + kMode + "}",
       "only one of the two"},
      {R"({"volumes": [{"name": "a", "files": []}], )" + kMode + "}",
       "volumes[0].files: an empty list"},
      {R"({"volumes": [{"name": "a", "files": [3]}], )" + kMode + "}", "volumes[0].files[0]"},
      {R"({"volumes": [{"name": "a", "files": "x", "motions": [{}]}], )" + kMode + "}",
       "volumes[0].motions[0].fields: it is missing"},
      {R"({"volumes": [{"name": "a", "files": "x", "motions": [{"fields": []}]}], )" + kMode + "}",
       "volumes[0].motions[0].fields: an empty list"},
      {R"({"volumes": [{"name": "a", "files": "x", "motions": [{"fields": ["f", "g"], "confidences": "c"}]}], )" +
           kMode + "}",
       "there are 1 for 2 fields"},
      {R"({"volumes": [{"name": "a", "files": "x", "motions": [{"fields": "f"}, {"fields": "g"}]}], )" +
           kMode + "}",
       "volumes[0].motions[1].name: another motion"},
      {volume_with(R"("motions": [{"fields": "f"}])"), "synthetic data bring their own"},
      {R"({"volumes": [{"name": "a", "source": "heart"}, {"name": "a", "source": "heart"}], )" +
           kMode + "}",
       "volumes[1].name: another volume"},
      {R"({"volumes": [{"name": "a", "source": "heart"}, {"name": "b", "source": "heart"}], )" +
           kMode + "}",
       "modes[0].volume: it is missing: name one of a, b"},
      {mode_with(R"("volume": "b", "strength": 1)"), "modes[0].volume: \"b\" is not known"},
      {mode_with(R"("motion": "dada", "strength": 1)"),
       "modes[0].motion: \"dada\" is not known: did you mean \"data\"?"},
      {R"({"volumes": [{"name": "a", "source": "molecule"}], "modes": [{"motion": "data", "strength": 1}]})",
       "the volume \"a\" has none"},
      {"{" + kVolume + R"(, "modes": [{"strength": 1}, {"strength": 1}]})",
       "modes[1].name: another mode"},
  };
  for (const auto& [text, part] : cases) EXPECT_THAT(scene_refusal(text), HasSubstr(part)) << text;
}

TEST(SceneFile, NeedsNoModesWhereThereAreSegments) {
  const std::string files = R"({"volumes": [{"name": "a", "files": "x", "segments": )";
  EXPECT_TRUE(accepted(files + R"({"files": "y"}}]})").modes.empty());
  const std::vector<std::pair<std::string, std::string>> cases = {
      {files + R"({}}]})", "volumes[0].segments.files: it is missing"},
      {files + R"({"files": "y", "frame": 1.5}}]})", "a whole number is expected"},
      {files + R"({"files": "y", "parts": [{}]}}]})", "parts[0].name: it is missing"},
      {files + R"({"files": "y", "parts": [{"name": "p"}, {"name": "p"}]}}]})",
       "parts[1].name: another part"},
      {files + R"({"files": "y", "parts": [{"name": "p", "labels": [0.5]}]}}]})",
       "parts[0].labels[0]: a label is expected"},
      {files + R"({"files": "y", "parts": [{"name": "pool"}]}}],
               "modes": [{"segment": "pol", "strength": 1}]})",
       "modes[0].segment: \"pol\" is not known: did you mean \"pool\"?"},
      {mode_with(R"("segment": "pool", "strength": 1)"), "the volume \"a\" has no segments"},
      {volume_with(R"("segments": {"files": "y"})"), "synthetic data have none"},
      {files + R"({"from": "values"}}]})", "\"values\" is not known"},
      {files + R"({"from": "region", "files": "y"}}]})", "derived from the values: leave this out"},
      {files + R"({"from": "region", "frame": 1}}]})", "derived from one frame: leave this out"},
      {files + R"({"from": "region", "smooth_mm": -1}}]})", "segments.smooth_mm"},
      {files + R"({"from": "region", "parts": [{"name": "p"}, {"name": "q"}]}}]})",
       "values have one wall: name one part"},
      {files + R"({"from": "region", "parts": [{"name": "p", "labels": [1]}]}}]})",
       "values have no labels"},
      {files + R"({"files": "y", "iso_value": 1}}]})", "\"iso_value\" is not known"},
      {volume_with(R"("segments": {"from": "region"})"), "synthetic data have none"},
  };
  for (const auto& [text, part] : cases) EXPECT_THAT(scene_refusal(text), HasSubstr(part)) << text;
}

TEST(SceneFile, DerivesAWallFromTheValues) {
  const SceneSpec scene =
      accepted(R"({"volumes": [{"name": "a", "files": "x", "segments": {"from": "region"}}]})");
  const SegmentsSpec& segments = scene.volumes[0].segments;
  EXPECT_EQ(segments.from, SegmentsFrom::kRegion);
  EXPECT_TRUE(segments.any());
  EXPECT_FALSE(segments.iso_value);
  EXPECT_FALSE(segments.smooth_mm);
  SegmentSpec wall;
  wall.name = "wall";
  EXPECT_THAT(segments.parts, ::testing::ElementsAre(wall));
  const SceneSpec named = accepted(
      R"({"volumes": [{"name": "a", "files": "x", "segments": {"from": "ridges", "iso_value": 3,
          "smooth_mm": 0, "parts": [{"name": "skin"}]}}],
          "modes": [{"segment": "skin", "strength": 1}]})");
  EXPECT_EQ(named.volumes[0].segments.from, SegmentsFrom::kRidges);
  EXPECT_EQ(named.volumes[0].segments.iso_value, 3.0);
  EXPECT_EQ(named.volumes[0].segments.smooth_mm, 0.0);
  EXPECT_EQ(named.modes[0].segment, "skin");
}

TEST(SceneFile, LooksForItsFilesInAnotherFolder) {
  const auto scene =
      parse_scene("here/scene.json",
                  R"({"volumes": [{"name": "a", "files": "x", "segments": {"files": "y"}}]})", {},
                  nullptr, "there");
  ASSERT_TRUE(scene);
  EXPECT_THAT(scene->volumes[0].files, ::testing::ElementsAre("there/x"));
  EXPECT_THAT(scene->volumes[0].segments.files, ::testing::ElementsAre("there/y"));
}

TEST(SceneFile, RefusesWhatIsNoJsonAndSaysWhere) {
  EXPECT_THAT(scene_refusal("{\n  \"volumes\": [\n  }"), HasSubstr("line 3"));
  EXPECT_THAT(scene_refusal(""), HasSubstr("not JSON"));
  EXPECT_THAT(scene_refusal("{\"a\": NaN}"), HasSubstr("line 1"));
  EXPECT_THAT(scene_refusal(scene_with("\"max_force_n\": 1e999")), HasSubstr("too large"));
  EXPECT_THAT(scene_refusal(scene_with("\"max_force_n\": 2, \"max_force_n\": 3")),
              HasSubstr("stands twice"));
  // Deep nesting must not end the program.
  EXPECT_NE(scene_refusal(std::string(200'000, '[')), "");
  EXPECT_NE(scene_refusal(std::string(200'000, '[') + std::string(200'000, ']')), "");
}

TEST(SceneFile, TakesTheUsersOwnKindsOfModes) {
  const std::string text = mode_with(R"("kind": "ripple", "gain": 3, "range_m": 0.1)");
  EXPECT_THAT(scene_refusal(text), HasSubstr("\"ripple\" is not known"));
  const auto scene = parse_scene("scene.json", text, {"ripple"});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->modes[0].kind, "ripple");
  EXPECT_EQ(scene->modes[0].gain, 3.0);
}

TEST(SceneFile, IsReadFromDiskAndMissesItsFiles) {
  const TemporaryFolder folder;
  const auto message = [&] {
    const auto scene = read_scene(folder / "scene.json");
    return scene ? "" : scene.error().message;
  };
  EXPECT_THAT(message(), HasSubstr("not a file that can be read"));
  std::ofstream(folder / "scene.json")
      << R"({"volumes": [{"name": "a", "files": "ct.nrrd", "motions": [{"fields": ["f.mha"], "confidences": "c.mha"}]}],
             "modes": [{"strength": 1}]})";
  EXPECT_THAT(message(), HasSubstr("volumes[0].files[0]: there is no"));
  std::ofstream(folder / "ct.nrrd") << "x";
  EXPECT_THAT(message(), HasSubstr("volumes[0].motions[0].fields[0]: there is no"));
  std::ofstream(folder / "f.mha") << "x";
  EXPECT_THAT(message(), HasSubstr("confidences[0]: there is no"));
  std::ofstream(folder / "c.mha") << "x";
  EXPECT_EQ(message(), "");
  std::filesystem::resize_file(folder / "scene.json", 20u << 20);
  EXPECT_THAT(message(), HasSubstr("too large"));
  EXPECT_THAT(read_scene(folder.path()).error().message, HasSubstr("not a file"));
}

TEST(SceneFile, TellsWhenItCanNotBeWritten) {
  const Status status = write_scene(shell_scene(), "/no-such-folder/scene.json");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::kBadOutput);
}

}  // namespace
}  // namespace palpate::files
