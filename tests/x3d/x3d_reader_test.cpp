#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <glm/gtc/constants.hpp>
#include <sstream>

#include "integration/x3d/x3d_file.h"
#include "module/scene/drive.h"
#include "tests/files/temporary_folder.h"

namespace palpate::x3d {
namespace {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const std::string kVolume =
    "<VolumeData DEF='v' dimensions='0.1 0.2 0.3'><ImageTexture3D url='\"a.nrrd\"'/></VolumeData>";

std::string scene_of(const std::string& nodes) {
  return "<X3D><Scene>" + nodes + "</Scene></X3D>";
}

X3dScene accepted(const std::string& nodes) {
  const auto scene = parse_x3d("folder/scene.x3d", scene_of(nodes));
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? *scene : X3dScene{};
}

std::string refusal_of(const std::string& text) {
  const auto scene = parse_x3d("folder/scene.x3d", text);
  return scene ? "" : scene.error().message;
}
std::string refusal(const std::string& nodes) {
  return refusal_of(scene_of(nodes));
}

/// One sentence about the file.
auto is_sentence(const std::string& part) {
  return AllOf(StartsWith("'folder/scene.x3d' "), HasSubstr(part), HasSubstr(": "), EndsWith("."));
}

glm::dvec3 place_of(const VolumeSpec& v, double time_s, glm::dvec3 x = glm::dvec3(0.0)) {
  return driven(v.drive, v.transform, time_s).world_from_volume(x);
}

void expect_near(glm::dvec3 a, glm::dvec3 b) {
  EXPECT_LT(glm::length(a - b), 1e-12)
      << a.x << " " << a.y << " " << a.z << " instead of " << b.x << " " << b.y << " " << b.z;
}

TEST(X3dReader, ReadsAVolumeAsABoxOfItsDimensions) {
  const X3dScene scene = accepted(kVolume);
  ASSERT_EQ(scene.spec.volumes.size(), 1U);
  const VolumeSpec& v = scene.spec.volumes[0];
  EXPECT_EQ(v.name, "v");
  EXPECT_THAT(v.files, ElementsAre("folder/a.nrrd"));
  EXPECT_EQ(v.box_m, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_EQ(v.drive.kind, DriveSpec::Kind::kStill);
  EXPECT_THAT(scene.spec.modes, IsEmpty());
  EXPECT_THAT(scene.notes, IsEmpty());
  // H3D's scenes have no root node of their own.
  EXPECT_TRUE(parse_x3d("scene.x3d", "<Group>" + kVolume + "</Group>"));
  // The default of X3D.
  EXPECT_EQ(
      accepted("<VolumeData><ImageTexture3D url='a.nrrd'/></VolumeData>").spec.volumes[0].box_m,
      glm::dvec3(1.0));
}

TEST(X3dReader, ReadsWhatOtherBrowsersScenesLookLike) {
  // The structure of scenes for X_ITE: a DOCTYPE, head, viewpoint, styles, a texture by DEF.
  const auto scene = parse_x3d("folder/scene.x3d", R"(<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE X3D PUBLIC "ISO//Web3D//DTD X3D 4.0//EN" "https://www.web3d.org/specifications/x3d-4.0.dtd">
<X3D profile='Full' version='4.0' xmlns:xsd='http://www.w3.org/2001/XMLSchema-instance'>
  <head><component name='VolumeRendering' level='4'/><meta name='title' content='skull'/></head>
  <Scene>
    <Viewpoint position='0 0 2'/>
    <Background skyColor='0 0 0'/>
    <Transform rotation='1 0 0 -1.5707963267948966'>
      <IsoSurfaceVolumeData DEF='skull' surfaceValues='0.3' dimensions='0.2 0.2 0.25'>
        <ImageTexture3D containerField='voxels' url='"https://example.org/skull.nrrd" "skull.nrrd"'/>
        <OpacityMapVolumeStyle/>
      </IsoSurfaceVolumeData>
    </Transform>
    <SegmentedVolumeData dimensions='0.1 0.1 0.1'>
      <ImageTexture3D containerField='segmentIdentifiers' url='"labels.nrrd"'/>
      <ImageTexture3D containerField='voxels' url='"brain.nrrd"'/>
    </SegmentedVolumeData>
  </Scene>
</X3D>)");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->spec.volumes.size(), 2U);
  EXPECT_THAT(scene->spec.volumes[0].files, ElementsAre("folder/skull.nrrd"));
  expect_near(place_of(scene->spec.volumes[0], 0.0, {0.0, 1.0, 0.0}), {0.0, 0.0, -1.0});
  EXPECT_THAT(scene->spec.volumes[1].segments.files, ElementsAre("folder/labels.nrrd"));
  EXPECT_THAT(
      scene->notes,
      ElementsAre("Nodes without effect here: Background, OpacityMapVolumeStyle, Viewpoint, "
                  "head.",
                  "Fields without effect here: IsoSurfaceVolumeData.surfaceValues."));
}

TEST(X3dReader, PutsTransformsOneIntoTheOther) {
  // x' = T C R SR S -SR -C x, twice.
  const X3dScene scene = accepted(
      "<Transform translation='1 0 0' rotation='0 0 1 1.5707963267948966' scale='2 2 2'>"
      "<Transform translation='0 1 0' center='0.5 0 0' rotation='0 0 1 3.141592653589793'>" +
      kVolume + "</Transform></Transform>");
  // Inner: (0.1, 0, 0) rotated by half a turn about (0.5, 0, 0) is (0.9, 0, 0), moved (0.9, 1, 0).
  // Outer: scaled by two, (1.8, 2, 0), a quarter turn, (-2, 1.8, 0), moved.
  expect_near(place_of(scene.spec.volumes[0], 0.0, {0.1, 0.0, 0.0}), {-1.0, 1.8, 0.0});
  EXPECT_THAT(refusal("<Transform scale='1 2 1'><Transform rotation='0 0 1 0.5'>" + kVolume +
                      "</Transform></Transform>"),
              is_sentence("VolumeData"));
  EXPECT_THAT(refusal("<Transform scale='1 -1 1'>" + kVolume + "</Transform>"),
              is_sentence("Transform: scale"));
}

TEST(X3dReader, FollowsRoutesFromASensorThroughInterpolators) {
  const X3dScene scene = accepted(
      "<TimeSensor DEF='T' cycleInterval='4' loop='true'/>"
      "<TimeSensor DEF='ONCE' cycleInterval='2'/>"
      "<PositionInterpolator DEF='P' key='0 0.5 1' keyValue='0 0 0, 0.2 0 0, 0 0 0'/>"
      "<OrientationInterpolator DEF='O' key='0 1' keyValue='0 0 1 0, 0 0 1 1.5707963267948966'/>"
      "<PositionInterpolator DEF='S' key='0 1' keyValue='1 1 1 3 3 3'/>"
      "<Transform DEF='A' translation='7 7 7'><Transform translation='0 1 0'>"
      "<Transform DEF='B' center='0 0.1 0'>" +
      kVolume +
      "</Transform></Transform></Transform>"
      "<ROUTE fromNode='T' fromField='fraction_changed' toNode='P' toField='set_fraction'/>"
      "<ROUTE fromNode='P' fromField='value_changed' toNode='A' toField='set_translation'/>"
      "<ROUTE fromNode='ONCE' fromField='fraction_changed' toNode='O' toField='set_fraction'/>"
      "<ROUTE fromNode='O' fromField='value_changed' toNode='B' toField='rotation'/>"
      "<ROUTE fromNode='ONCE' fromField='fraction_changed' toNode='S' toField='set_fraction'/>"
      "<ROUTE fromNode='S' fromField='value_changed' toNode='B' toField='scale'/>");
  EXPECT_THAT(scene.notes, IsEmpty());
  const VolumeSpec& v = scene.spec.volumes[0];
  EXPECT_EQ(v.drive.kind, DriveSpec::Kind::kKeys);
  EXPECT_EQ(v.path, PosePath::kExact);
  // At each time: A moves; B rotates about (0, 0.1, 0) and grows.
  const auto expected = [](double t, glm::dvec3 x) {
    const double share = t / 4.0 - std::floor(t / 4.0);
    const double along = 0.2 * (share < 0.5 ? 2.0 * share : 2.0 - 2.0 * share);
    const double once = std::min(t / 2.0, 1.0);
    const glm::dquat turn = glm::angleAxis(0.5 * glm::pi<double>() * once, glm::dvec3(0, 0, 1));
    const glm::dvec3 centre(0.0, 0.1, 0.0);
    return glm::dvec3(along, 1.0, 0.0) + centre + turn * ((1.0 + 2.0 * once) * (x - centre));
  };
  for (const double t : {0.0, 0.3, 1.0, 1.999, 2.0, 3.7, 4.0, 9.1})
    for (const glm::dvec3 x : {glm::dvec3(0.0), glm::dvec3(0.1, 0.2, -0.3)})
      expect_near(place_of(v, t, x), expected(t, x));
}

TEST(X3dReader, BendsPathsThroughSplines) {
  const auto moved = [](const std::string& fields) {
    return accepted("<TimeSensor DEF='T' loop='true'/><SplinePositionInterpolator DEF='P' " +
                    fields + "/><Transform DEF='A'>" + kVolume +
                    "</Transform><ROUTE fromNode='T' fromField='fraction_changed' toNode='P' "
                    "toField='set_fraction'/><ROUTE fromNode='P' fromField='value_changed' "
                    "toNode='A' toField='set_translation'/>");
  };
  const auto x = [](const X3dScene& scene, double t) {
    return place_of(scene.spec.volumes[0], t).x;
  };
  // With velocities of a parabola, x = s^2 and y = 3 s from one key to the next.
  const X3dScene given = moved("key='0 1' keyValue='0 0 0 1 3 0' keyVelocity='0 3 0 2 3 0'");
  EXPECT_THAT(given.notes, IsEmpty());
  // 32 straight pieces: a parabola of second derivative 2 is at most 2 / 8 / 32^2 away from them.
  for (double t = 0.0; t < 1.0; t += 0.037) {
    EXPECT_NEAR(x(given, t), t * t, 2.5e-4);
    EXPECT_NEAR(place_of(given.spec.volumes[0], t).y, 3.0 * t, 1e-12);
  }
  // Without velocities: half of the way between the neighbours; at the ends 0, or cyclic if closed.
  const X3dScene found = moved("key='0 0.5 1' keyValue='0 0 0 1 0 0 0 0 0'");
  EXPECT_NEAR(x(found, 0.25), 0.5, 1e-12);
  const X3dScene line = moved("key='0 0.25 0.5 1' keyValue='0 0 0 1 0 0 2 0 0 0 0 0'");
  // At key 1: tangent (2 - 0) / 2; Hermite in the middle of the second interval: (1 + 2) / 2 + (1 -
  // m) / 8 with m, of key 2, (0 - 1) / 2 times 2 * 0.5 / 0.75.
  EXPECT_NEAR(x(line, 0.375), 1.5 + (1.0 + 2.0 / 3.0) / 8.0, 1e-12);
  const X3dScene round =
      moved("closed='true' key='0 0.25 0.5 0.75 1' keyValue='0 0 0 1 0 0 0 0 0 -1 0 0 0 0 0'");
  EXPECT_NEAR(x(round, 0.125), 0.5 + 1.0 / 8.0, 1e-12);
  // At constant speed velocities only give directions, with the length of the whole way.
  const X3dScene even = moved(
      "normalizeVelocity='true' key='0 1' keyValue='0 0 0 1 0 0' "
      "keyVelocity='7 0 0 0.1 0 0'");
  EXPECT_NEAR(x(even, 0.4375), 0.4375, 1e-12);
  EXPECT_THAT(refusal("<TimeSensor DEF='T'/><SplinePositionInterpolator DEF='P' key='0 1' "
                      "keyValue='0 0 0 1 0 0' keyVelocity='1'/><Transform DEF='A'/>"
                      "<ROUTE fromNode='T' fromField='fraction_changed' toNode='P' "
                      "toField='set_fraction'/><ROUTE fromNode='P' fromField='value_changed' "
                      "toNode='A' toField='set_translation'/>"),
              is_sentence("keyVelocity"));
}

TEST(X3dReader, TakesAWholeTurnForTheDriveThatTurns) {
  const auto turning = [](const std::string& around, const std::string& values) {
    return accepted(
               "<TimeSensor DEF='T' cycleInterval='8' loop='true'/>"
               "<OrientationInterpolator DEF='O' key='0 0.25 0.5 0.75 1' keyValue='" +
               values + "'/><Transform " + around +
               "><Transform DEF='A' center='0.1 0 0'><Transform translation='0 0.05 0'>" + kVolume +
               "</Transform></Transform></Transform>"
               "<ROUTE fromNode='T' fromField='fraction_changed' toNode='O' "
               "toField='set_fraction'/><ROUTE fromNode='O' fromField='value_changed' "
               "toNode='A' toField='set_rotation'/>")
        .spec.volumes[0];
  };
  const VolumeSpec v = turning("translation='0 0 1'",
                               "0 0 1 0 0 0 1 -1.570796 0 0 1 -3.141593 0 0 1 -4.712389 0 0 1 0");
  EXPECT_EQ(v.drive.kind, DriveSpec::Kind::kTurn);
  EXPECT_EQ(v.drive.rate_hz, -0.125);
  expect_near(v.drive.axis, {0, 0, 1});
  expect_near(v.drive.centre_m, {0.1, 0.0, 1.0});
  expect_near(v.transform.translation_m, {0.0, 0.05, 1.0});
  // Back and forth is not a full turn.
  EXPECT_EQ(turning("", "0 0 1 0 0 0 1 1.5 0 0 1 0 0 0 1 -1.5 0 0 1 0").drive.kind,
            DriveSpec::Kind::kKeys);
}

TEST(X3dReader, DrivesASequenceByItsOwnNode) {
  const X3dScene scene = accepted(
      "<TimeSensor DEF='T' cycleInterval='0.8' loop='true'/>"
      "<VolumeData dimensions='0.1 0.1 0.1'>"
      "<PalpateSequenceTexture3D DEF='S' containerField='voxels' url='\"heart.seq.nrrd\"'/>"
      "</VolumeData>"
      "<ROUTE fromNode='T' fromField='fraction_changed' toNode='S' toField='set_fraction'/>");
  EXPECT_THAT(scene.notes, IsEmpty());
  EXPECT_THAT(scene.spec.volumes[0].files, ElementsAre("folder/heart.seq.nrrd"));
  EXPECT_EQ(scene.spec.volumes[0].cycle_s, 0.8);
  EXPECT_TRUE(scene.spec.volumes[0].cyclic);
  EXPECT_EQ(scene.spec.volumes[0].name, "heart.seq");
}

TEST(X3dReader, ReadsTheModesOfVhtkAndPalpate) {
  const X3dScene scene = accepted(
      "<DeviceInfo><FalconDevice forceLimit='2.5' deviceName='x' "
      "positionCalibration='2 0 0 0.1 0 2 0 0 0 0 2 0 0 0 0 1'/></DeviceInfo>"
      "<VolumeHaptics stiffness='350' palpateDamping='0.5'/>"
      "<Transform scale='0.05 0.05 0.05'>"
      "<VectorFollowMode DEF='F' active='TRUE'>"
      "<VectorElectroPotential DEF='E' point='0 0 0, +1 0 0' potential='+.4 -2' "
      "palpateSoftness='0.2 0.3'/>"
      "<PiecewiseFunction DEF='S' containerField='strength' segments='0 0 0.3 1.0 1000 5'/>"
      "</VectorFollowMode>"
      "<VectorFrontShapeMode active='false' twoSided='true' snapdrag='true'>"
      "<VHTKVectorDataNode USE='E'/><PiecewiseFunction USE='S' containerField='strength'/>"
      "</VectorFrontShapeMode></Transform>" +
      kVolume +
      "<PalpateSurfaceMode leaving='true' palpateScalar='gradient-magnitude'>"
      "<VolumeData USE='v' containerField='scalarVolume'/>"
      "<WindowFunction containerField='strength' level='300' width='100'/>"
      "<PiecewiseFunction containerField='friction' continuous='false' segments='0 0.1 5 0.3'/>"
      "</PalpateSurfaceMode>");
  const SceneSpec& spec = scene.spec;
  EXPECT_EQ(spec.stiffness_n_per_m, 350.0);
  EXPECT_EQ(spec.damping_n_s_per_m, 0.5);
  EXPECT_EQ(spec.max_force_n, 2.5);
  EXPECT_EQ(spec.world_from_device.scale, glm::dvec3(2.0));
  expect_near(spec.world_from_device.translation_m, {0.1, 0.0, 0.0});
  // One volume of charges for both modes, and the one that is drawn.
  ASSERT_EQ(spec.volumes.size(), 2U);
  EXPECT_EQ(spec.volumes[0].source, "charges");
  ASSERT_EQ(spec.volumes[0].charges.size(), 2U);
  EXPECT_EQ(spec.volumes[0].charges[1], (PointCharge{{1.0, 0.0, 0.0}, -2.0, 0.3}));
  EXPECT_LT(glm::length(spec.volumes[0].transform.scale - 0.05), 1e-15);
  ASSERT_EQ(spec.modes.size(), 3U);
  EXPECT_EQ(spec.modes[0].kind, "follow");
  EXPECT_EQ(spec.modes[0].name, "F");
  EXPECT_EQ(spec.modes[0].vector, VectorProperty::kGradient);
  EXPECT_THAT(spec.modes[0].strength.out(), ElementsAre(0.0, 1.0, 5.0));
  EXPECT_TRUE(spec.modes[0].on);
  EXPECT_EQ(spec.modes[1].kind, "front");
  EXPECT_EQ(spec.modes[1].volume, spec.modes[0].volume);
  EXPECT_TRUE(spec.modes[1].two_sided);
  EXPECT_FALSE(spec.modes[1].on);
  EXPECT_THAT(spec.modes[1].strength.in(), ElementsAre(0.0, 0.3, 1000.0));
  EXPECT_EQ(spec.modes[2].volume, "v");
  EXPECT_EQ(spec.modes[2].scalar, ScalarProperty::kGradientMagnitude);
  EXPECT_TRUE(spec.modes[2].leaving);
  EXPECT_EQ(spec.modes[2].strength(350.0), 1.0);
  EXPECT_TRUE(spec.modes[2].friction.is_stepped());
  EXPECT_THAT(scene.notes, ElementsAre("The scene names a FalconDevice: which device gives the "
                                       "force is said by `device`.",
                                       "Fields without effect here: FalconDevice.deviceName, "
                                       "VectorFrontShapeMode.snapdrag."));
}

TEST(X3dReader, NamesWhatHasNoEffectOnce) {
  const X3dScene scene =
      accepted(kVolume +
               "<Shape><Sphere radius='1'/></Shape><Shape><Box/></Shape>"
               "<TimeSensor DEF='T' loop='true'/><Transform DEF='A' bboxSize='1 1 1'/>"
               "<ROUTE fromNode='T' fromField='isActive' toNode='A' toField='center'/>");
  EXPECT_THAT(scene.notes,
              ElementsAre("Nodes without effect here: Box, Shape (2), Sphere, TimeSensor (drives "
                          "nothing).",
                          "ROUTEs without effect here: T.isActive to A.center."));
}

TEST(X3dReader, NamesEveryNodeThatItLeavesOutWhereverItStands) {
  // An unknown node with its own name at each place where a node is allowed.
  int number = 0;
  std::vector<std::string> names;
  const auto odd = [&] {
    names.push_back("Odd" + std::to_string(10 + number++));
    return "<" + names.back() + "/>";
  };
  const auto route = [](const char* from, const char* from_field, const char* to,
                        const char* to_field) {
    return std::string("<ROUTE fromNode='") + from + "' fromField='" + from_field + "' toNode='" +
           to + "' toField='" + to_field + "'>";
  };
  const std::string scene =
      odd() + "<TimeSensor DEF='T' loop='true'>" + odd() +
      "</TimeSensor><PositionInterpolator DEF='P' key='0 1' keyValue='0 0 0 1 0 0'>" + odd() +
      "</PositionInterpolator><Transform DEF='A'>" + odd() +
      "<VolumeData DEF='v' dimensions='0.1 0.1 0.1'>" + odd() +
      "<MetadataString name='palpate name' value='\"lung\"'>" + odd() +
      "</MetadataString><ImageTexture3D url='a.nrrd'>" + odd() + "<NrrdImageLoader>" + odd() +
      "</NrrdImageLoader></ImageTexture3D><PixelTexture3D/></VolumeData></Transform>"
      "<SegmentedVolumeData><ImageTexture3D url='b.nrrd'/><ImageTexture3D url='c.nrrd' "
      "containerField='segmentIdentifiers'>" +
      odd() +
      "</ImageTexture3D></SegmentedVolumeData>"
      "<VectorVolume DEF='w' url='d.nrrd'><NrrdImageLoader>" +
      odd() +
      "</NrrdImageLoader></VectorVolume>"
      "<Shape>" +
      odd() + "<StreamTubes>" + odd() +
      "<VectorVolume USE='w'/></StreamTubes></Shape>"
      "<DeviceInfo>" +
      odd() + "<AnyDevice>" + odd() + "</AnyDevice></DeviceInfo><VolumeHaptics>" + odd() +
      "</VolumeHaptics>"
      "<VectorFollowMode>" +
      odd() + "<SampledScalarVolume><ScalarElectroPotential point='0 0 0' potential='1'>" + odd() +
      "</ScalarElectroPotential>" + odd() +
      "</SampledScalarVolume><PiecewiseFunction containerField='strength' segments='0 1'>" + odd() +
      "</PiecewiseFunction><WindowFunction containerField='friction'/></VectorFollowMode>"
      "<VolumeData USE='v'>" +
      odd() + "</VolumeData>" + route("T", "fraction_changed", "P", "set_fraction") + odd() +
      "</ROUTE>" + route("P", "value_changed", "A", "set_translation") + "</ROUTE>";
  const std::vector<std::string> notes = accepted(scene).notes;
  ASSERT_FALSE(notes.empty());
  for (const std::string& name : names) EXPECT_THAT(notes[0], HasSubstr(name + ","));
  EXPECT_THAT(notes[0], AllOf(StartsWith("Nodes without effect here: "),
                              HasSubstr("PixelTexture3D"), HasSubstr("WindowFunction")));
  // A second texture is left out, not taken for the first.
  const X3dScene twice = accepted(
      "<VolumeData><ImageTexture3D url='a.nrrd'/><ImageTexture3D url='b.nrrd'/></VolumeData>");
  EXPECT_THAT(twice.spec.volumes[0].files, ElementsAre("folder/a.nrrd"));
  EXPECT_THAT(twice.notes, ElementsAre("Nodes without effect here: ImageTexture3D."));
}

TEST(X3dReader, FindsVolumesInAllKindsOfGroups) {
  for (const char* group :
       {"Group", "StaticGroup", "Anchor", "Collision", "PickableGroup", "CADLayer", "CADAssembly",
        "CADPart", "LayerSet", "Layer", "ToggleGroup", "LOD", "Transform"}) {
    const std::string name = group;
    const X3dScene scene = accepted("<" + name + ">" + kVolume + "</" + name + ">");
    EXPECT_EQ(scene.spec.volumes.size(), 1U) << group;
    EXPECT_THAT(scene.notes, IsEmpty()) << group;
  }
  const auto volume = [](const std::string& file) {
    return "<VolumeData><ImageTexture3D url='" + file + "'/></VolumeData>";
  };
  const std::string three =
      "<MetadataString name='x' value='y'/>" + volume("a.mha") + volume("b.mha") + volume("c.mha");
  // The choice of a Switch, counted from 0 and without metadata; the finest level of a LOD.
  const X3dScene second =
      accepted("<Anchor url='#x'><Switch whichChoice='1'>" + three + "</Switch></Anchor>");
  ASSERT_EQ(second.spec.volumes.size(), 1U);
  EXPECT_THAT(second.spec.volumes[0].files, ElementsAre("folder/b.mha"));
  EXPECT_THAT(second.notes,
              ElementsAre("Volumes are left out: VolumeData in Switch, whose whichChoice is 1 (2).",
                          "Nodes without effect here: ImageTexture3D (2), MetadataString, "
                          "VolumeData (2).",
                          "Fields without effect here: Anchor.url."));
  const X3dScene finest = accepted("<LOD range='1 2' center='0 0 0'>" + three + "</LOD>");
  ASSERT_EQ(finest.spec.volumes.size(), 1U);
  EXPECT_THAT(finest.spec.volumes[0].files, ElementsAre("folder/a.mha"));
  EXPECT_THAT(finest.notes[0], HasSubstr("VolumeData in a coarser level of LOD (2)"));
  // A part of a design is moved as by a Transform; the shape of a collision is not seen.
  EXPECT_EQ(accepted("<CADPart translation='0 0 2'>" + kVolume + "</CADPart>")
                .spec.volumes[0]
                .transform.translation_m.z,
            2.0);
  const X3dScene proxy =
      accepted("<Collision><Shape containerField='proxy'/>" + kVolume + "</Collision>");
  EXPECT_THAT(proxy.notes, ElementsAre("Nodes without effect here: Shape."));
}

TEST(X3dReader, SaysInWhatItLeavesVolumesOut) {
  const X3dScene scene = accepted(
      kVolume + "<GeoTransform><Group><VolumeData USE='v'/></Group></GeoTransform><Switch>" +
      "<Group><VectorVolume url='f.nrrd'/></Group></Switch><Switch whichChoice='7'><Shape/>"
      "</Switch>");
  EXPECT_THAT(scene.notes[0],
              "Volumes are left out: VectorVolume in Switch, whose whichChoice is -1, VolumeData "
              "in GeoTransform.");
  EXPECT_THAT(refusal("<Switch>" + kVolume + "</Switch>"),
              is_sentence("VolumeData in Switch, whose whichChoice is -1"));
  EXPECT_THAT(refusal("<ProtoDeclare><ProtoBody>" + kVolume + "</ProtoBody></ProtoDeclare>"),
              is_sentence("VolumeData in ProtoDeclare"));
  EXPECT_THAT(refusal("<Switch whichChoice='one'>" + kVolume + "</Switch>"),
              is_sentence("whichChoice: a number"));
}

TEST(X3dReader, NamesTheNodeThatAMisspelledOneMeans) {
  for (const auto& [wrong, meant] : {std::pair{"VolumeDate", "VolumeData"},
                                     {"volumedata", "VolumeData"},
                                     {"VolumData", "VolumeData"},
                                     {"IsoSurfaceVolume", "IsoSurfaceVolumeData"},
                                     {"SegmentdVolumeData", "SegmentedVolumeData"},
                                     {"VectorVolumes", "VectorVolume"}})
    EXPECT_THAT(refusal("<" + std::string(wrong) + " url='a.mha'/>"),
                is_sentence(wrong + std::string(" in line 1 (is ") + meant + " meant?)"));
  EXPECT_THAT(refusal("<Transfrom>" + kVolume + "</Transfrom>"),
              is_sentence("Transfrom in line 1 (is Transform meant?)"));
  EXPECT_THAT(refusal("<VolumeData>\n<ImageTexture3d url='a.mha'/></VolumeData>"),
              is_sentence("put an ImageTexture3D into it (ImageTexture3d in line 2 is no node: "
                          "correct its name to ImageTexture3D)"));
  EXPECT_THAT(accepted(kVolume + "<PalpateSurfaceMod/><tranform/>").notes[0],
              "Unknown nodes are left out: PalpateSurfaceMod in line 1 (is PalpateSurfaceMode "
              "meant?), tranform in line 1 (is Transform meant?).");
  // Other nodes of X3D are no typing errors, nor are names that are near to nothing.
  for (const char* real :
       {"ImageTexture", "PixelTexture3D", "LineSensor", "PositionInterpolator2D",
        "SquadOrientationInterpolator", "GeoLOD", "Text", "Box", "Fog", "ScalarInterpolator",
        "ViewpointGroup", "VolumeRenderer", "TransformSensor", "Odd12"})
    EXPECT_THAT(accepted(kVolume + "<" + real + "/>").notes,
                ElementsAre("Nodes without effect here: " + std::string(real) + "."));
}

TEST(X3dReader, SaysWhyVoxelsInTheSceneAreNotRead) {
  EXPECT_THAT(refusal("<VolumeData><PixelTexture3D image='1 1 1 2 0 255'/></VolumeData>"),
              is_sentence("PixelTexture3D stand in the scene itself"));
  EXPECT_THAT(refusal("<VolumeData><ComposedTexture3D><ImageTexture url='a.png'/>"
                      "</ComposedTexture3D></VolumeData>"),
              is_sentence("ComposedTexture3D are single pictures"));
}

TEST(X3dReader, ReadsPackedFilesAndRefusesOtherEncodingsByName) {
  const files::TemporaryFolder folder;
  const auto write = [&](const char* name, std::string_view text) {
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  };
  const auto packed = [&](const char* name, const std::string& text) {
    const gzFile file = gzopen((folder / name).c_str(), "wb1");
    gzwrite(file, text.data(), unsigned(text.size()));
    gzclose(file);
    return folder / name;
  };
  write("a.nrrd", "not looked at");
  const fs::path good = packed("good.x3dz", scene_of(kVolume));
  EXPECT_TRUE(is_x3d(good));
  const auto scene = read_x3d(good);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_THAT(scene->spec.volumes[0].files, ElementsAre(folder / "a.nrrd"));
  // Any of the two may have the name of the other.
  EXPECT_TRUE(read_x3d(packed("packed.x3d", scene_of(kVolume))));
  EXPECT_TRUE(read_x3d(write("plain.X3DZ", scene_of(kVolume))));
  EXPECT_TRUE(read_x3d(write("outer.x3d", scene_of("<Inline url='good.x3dz'/>"))));
  std::ostringstream bytes;
  bytes << std::ifstream(good, std::ios::binary).rdbuf();
  const auto cut = read_x3d(write("cut.x3dz", bytes.str().substr(0, bytes.str().size() / 2)));
  ASSERT_FALSE(cut);
  EXPECT_THAT(cut.error().message, HasSubstr("can not be unpacked"));
  const auto large = read_x3d(packed("large.x3dz", std::string(20 << 20, ' ')));
  ASSERT_FALSE(large);
  EXPECT_THAT(large.error().message, HasSubstr("too large"));
  const auto refused = [&](const char* name, std::string_view text, const char* encoding) {
    const fs::path file = write(name, text);
    EXPECT_TRUE(is_x3d(file)) << name;
    const auto read = read_x3d(file);
    ASSERT_FALSE(read) << name;
    EXPECT_THAT(read.error().message,
                AllOf(HasSubstr(std::string("in the ") + encoding + " encoding of X3D"),
                      HasSubstr(": save it as .x3d (XML)"), EndsWith(".")))
        << name;
  };
  refused("a.x3dv", "#X3D V3.3 utf8\nVolumeData {}", "classic VRML");
  refused("b.x3dv", "VolumeData {}", "classic VRML");
  refused("c.wrl", "#VRML V2.0 utf8\nGroup {}", "classic VRML");
  refused("d.x3d", "#X3D V3.3 utf8\nVolumeData {}", "classic VRML");
  refused("e.x3db", std::string_view("\xE0\0\0\x01\0x", 6), "binary");
  refused("f.x3d", "{ \"X3D\": {} }", "JSON");
}

TEST(X3dReader, KnowsWhetherTheSceneGivesDimensions) {
  const auto assumed = [](const char* fields) {
    return accepted("<VolumeData " + std::string(fields) +
                    "><ImageTexture3D url='a.mha'/></VolumeData>")
        .spec.volumes[0]
        .box_assumed;
  };
  EXPECT_TRUE(assumed(""));
  EXPECT_FALSE(assumed("dimensions='1 1 1'"));
}

std::string with_style(const std::string& style) {
  return "<VolumeData>" + style + "<ImageTexture3D url='a.nrrd'/></VolumeData>";
}

TEST(X3dReader, TakesColoursAndOpacitiesFromATransferFunction) {
  // Transparent black, half red, opaque green, quarter white; decimal and hexadecimal.
  const X3dScene scene = accepted(with_style(
      "<OpacityMapVolumeStyle><PixelTexture containerField='transferFunction' repeatS='false' "
      "image='4 1 4 0x00000000 0xFF000080, 16711935 0XFFFFFF40'/></OpacityMapVolumeStyle>"));
  const AppearanceSpec& seen = scene.spec.volumes[0].appearance;
  EXPECT_TRUE(seen.points_of_range);
  const std::vector<LookPoint> points = {{0.125, {0, 0, 0}, 0.0},
                                         {0.375, {1, 0, 0}, 128.0 / 255.0},
                                         {0.625, {0, 1, 0}, 0.999},
                                         {0.875, {1, 1, 1}, 64.0 / 255.0}};
  EXPECT_EQ(seen.points, points);
  EXPECT_THAT(scene.notes, ElementsAre("Fields without effect here: PixelTexture.repeatS."));
  // Fewer components: grey, grey with opacity, colours without opacity.
  const auto one = [](const char* image) {
    return accepted(with_style("<OpacityMapVolumeStyle><PixelTexture image='" + std::string(image) +
                               "'/></OpacityMapVolumeStyle>"))
        .spec.volumes[0]
        .appearance.points.at(0);
  };
  EXPECT_EQ(one("1 1 1 0x33"), (LookPoint{0.5, glm::dvec3(0.2), 0.999}));
  EXPECT_EQ(one("1 1 2 0x3366"), (LookPoint{0.5, glm::dvec3(0.2), 0.4}));
  EXPECT_EQ(one("1 1 3 0x336699"), (LookPoint{0.5, {0.2, 0.4, 0.6}, 0.999}));
}

TEST(X3dReader, TakesTheFirstStyleThatSaysColoursAndNamesTheOthers) {
  const std::string map =
      "<OpacityMapVolumeStyle><PixelTexture image='2 1 4 0 255'/></OpacityMapVolumeStyle>";
  const X3dScene composed =
      accepted(with_style("<ComposedVolumeStyle><EdgeEnhancementVolumeStyle/>" + map +
                          "<CartoonVolumeStyle/></ComposedVolumeStyle>"));
  EXPECT_EQ(composed.spec.volumes[0].appearance.points.size(), 2U);
  EXPECT_THAT(composed.notes, ElementsAre("Nodes without effect here: CartoonVolumeStyle, "
                                          "EdgeEnhancementVolumeStyle."));
  // Styles that are disabled, two-dimensional, in a file, or nested.
  for (const char* style :
       {"<OpacityMapVolumeStyle enabled='false'><PixelTexture image='1 1 1 9'/>"
        "</OpacityMapVolumeStyle>",
        "<OpacityMapVolumeStyle><PixelTexture image='1 2 1 9 9'/></OpacityMapVolumeStyle>",
        "<OpacityMapVolumeStyle><ImageTexture url='a.png'/></OpacityMapVolumeStyle>",
        "<OpacityMapVolumeStyle/>", "<ProjectionVolumeStyle/>", "<ShadedVolumeStyle/>",
        "<ComposedVolumeStyle DEF='c'><ComposedVolumeStyle USE='c'/></ComposedVolumeStyle>"}) {
    const X3dScene scene = accepted(with_style(style));
    EXPECT_THAT(scene.spec.volumes[0].appearance.points, IsEmpty()) << style;
    EXPECT_THAT(scene.notes, ElementsAre(HasSubstr("VolumeStyle"))) << style;
  }
  const X3dScene twice = accepted(with_style(map + map));
  EXPECT_EQ(twice.spec.volumes[0].appearance.points.size(), 2U);
  EXPECT_THAT(twice.notes, ElementsAre(HasSubstr("OpacityMapVolumeStyle")));
  for (const char* image : {"", "1 1 4", "2 1 4 0", "1 1 5 0", "1 1 0 0", "0 0 1 0", "1 1 4 0x",
                            "1 1 4 -1", "1 1 4 0x100000000", "70000 1 1 0", "1 1 4 x"})
    EXPECT_THAT(refusal(with_style("<OpacityMapVolumeStyle><PixelTexture image='" +
                                   std::string(image) + "'/></OpacityMapVolumeStyle>")),
                is_sentence("PixelTexture: image"))
        << image;
}

TEST(X3dReader, DrawsTubesWhereVhtkDraws) {
  const X3dScene scene = accepted(
      "<Transform scale='0.1 0.1 0.1'><Shape><Appearance><Material/></Appearance>"
      "<StreamTubes radius='0.02' source='0 0 0'><VectorVolume DEF='w' url='flow.nrrd'/>"
      "<VectorVolume USE='w' containerField='radiusVolume'/></StreamTubes></Shape>"
      "<Shape><StreamRibbons><VectorElectroPotential containerField='vectorVolume' "
      "point='0 0 0' potential='1'/></StreamRibbons></Shape><Shape><StreamTubes/></Shape>"
      "</Transform>" +
      kVolume);
  ASSERT_EQ(scene.spec.volumes.size(), 3U);
  EXPECT_EQ(scene.spec.volumes[0].appearance.tubes, true);
  EXPECT_EQ(scene.spec.volumes[0].transform.scale, glm::dvec3(0.1));
  EXPECT_EQ(scene.spec.volumes[1].appearance.tubes, true);
  EXPECT_EQ(scene.spec.volumes[2].appearance.tubes, std::nullopt);
  EXPECT_THAT(scene.notes,
              ElementsAre("Nodes without effect here: Appearance, Material, StreamTubes, "
                          "VectorVolume.",
                          "Fields without effect here: StreamTubes.radius, StreamTubes.source."));
}

/// As in scenes for H3D: the scene gives the size of a file without a header.
TEST(X3dReader, ReadsSamplesWithoutAHeader) {
  const X3dScene scene = accepted(
      "<VectorVolume url='flume.raw'><RawImageLoader width='40' height='20' depth='10' "
      "bitsPerPixel='96' pixelType='VEC3' pixelComponentType='SIGNED' pixelSize='0.015 0.015 "
      "0.06'/></VectorVolume><VolumeData dimensions='0.1 0.1 0.1'><Image3DTexture "
      "url='\"ct.raw\"'><RawImageLoader containerField='imageLoader' width='64' height='64' "
      "depth='32' pixelType='LUMINANCE' bitsPerPixel='16'/></Image3DTexture></VolumeData>");
  EXPECT_THAT(scene.notes, IsEmpty());
  const VolumeSpec &flume = scene.spec.volumes.at(0), &ct = scene.spec.volumes.at(1);
  EXPECT_THAT(flume.files, ElementsAre("folder/flume.raw"));
  EXPECT_EQ(flume.raw, (RawSamples{{40, 20, 10}, SampleType::kInt32, 3, {0.015, 0.015, 0.06}}));
  EXPECT_FALSE(flume.box_m);
  EXPECT_THAT(ct.files, ElementsAre("folder/ct.raw"));
  EXPECT_EQ(ct.raw, (RawSamples{{64, 64, 32}, SampleType::kUint16, 1, glm::dvec3(0.001)}));
  EXPECT_EQ(ct.box_m, glm::dvec3(0.1));
}

TEST(X3dReader, RefusesSamplesWithoutAHeaderThatCanNotBe) {
  const auto of_loader = [](const std::string& fields) {
    return refusal("<VectorVolume url='a.raw'><RawImageLoader " + fields + "/></VectorVolume>");
  };
  EXPECT_THAT(of_loader("width='0'"), is_sentence("width"));
  EXPECT_THAT(of_loader("height='2.5'"), is_sentence("height: a whole number"));
  EXPECT_THAT(of_loader("depth='1e9'"), is_sentence("depth"));
  EXPECT_THAT(of_loader("pixelType='BGRA'"), is_sentence("pixelType: one of LUMINANCE, VEC3, RGB"));
  EXPECT_THAT(of_loader("pixelComponentType='FLOAT'"), is_sentence("pixelComponentType"));
  EXPECT_THAT(of_loader("bitsPerPixel='16'"), is_sentence("bitsPerPixel"));
  EXPECT_THAT(of_loader("bitsPerPixel='48' pixelComponentType='RATIONAL'"),
              is_sentence("bitsPerPixel"));
  EXPECT_THAT(of_loader("pixelSize='1 1'"), is_sentence("pixelSize"));
  EXPECT_THAT(of_loader("pixelSize='1 -1 1'"), is_sentence("pixelSize"));
  EXPECT_THAT(of_loader("width='3'"), is_sentence("pixelSize: it is missing"));
  EXPECT_THAT(refusal("<VolumeData><PalpateSequenceTexture3D url='a.raw'><RawImageLoader "
                      "width='3'/></PalpateSequenceTexture3D></VolumeData>"),
              is_sentence("one volume here"));
  const std::string sequence = "<PalpateSequenceTexture3D url='\"a.raw\" \"b.raw\"'/>",
                    loader = "<RawImageLoader width='3'/>";
  for (const std::string& children : {sequence + loader, loader + sequence})
    EXPECT_THAT(refusal("<VectorVolume>" + children + "</VectorVolume>"),
                is_sentence("one volume here"));
}

TEST(X3dReader, RefusesInOneSentence) {
  EXPECT_THAT(refusal_of("<X3D><Scene>"), is_sentence("is no XML at line 1"));
  EXPECT_THAT(refusal_of(""), is_sentence("is no XML"));
  EXPECT_THAT(refusal(""), is_sentence("holds no volume"));
  EXPECT_THAT(refusal("<VolumeData/>"), is_sentence("VolumeData: it has no voxels"));
  EXPECT_THAT(refusal("<VolumeData dimensions='1 2'/>"), is_sentence("dimensions: 3 numbers"));
  for (const char* wrong : {"nan nan nan", "1e999 1 1", "0 1 1", "inf 1 1", "1 1 x", "1e30 1 1"})
    EXPECT_THAT(refusal("<VolumeData dimensions='" + std::string(wrong) + "'/>"),
                is_sentence("dimensions"));
  EXPECT_THAT(refusal("<Transform rotation='0 0 0 1'>" + kVolume + "</Transform>"),
              is_sentence("rotation: an axis"));
  EXPECT_THAT(refusal("<Transform translation='1e308 0 0'><Transform scale='1e4 1e4 1e4' "
                      "translation='1e308 1e308 1'>" +
                      kVolume + "</Transform></Transform>"),
              is_sentence("VolumeData"));
  EXPECT_THAT(refusal("<VolumeHaptics stiffness='-1'/>"), is_sentence("stiffness"));
  EXPECT_THAT(refusal("<VectorFollowMode/>"), is_sentence("it has no data"));
  EXPECT_THAT(refusal(kVolume + "<VectorFollowMode><VolumeData USE='v'/></VectorFollowMode>"),
              is_sentence("it has no strength"));
  EXPECT_THAT(refusal(kVolume + "<PalpateSurfaceMode><VolumeData USE='v'/><PiecewiseFunction "
                                "segments='0 -1'/></PalpateSurfaceMode>"),
              is_sentence("segments"));
  EXPECT_THAT(refusal(kVolume + kVolume), is_sentence("another node is called 'v'"));
  EXPECT_THAT(refusal("<VolumeData USE='w'/>"), is_sentence("no node before it is called 'w'"));
  EXPECT_THAT(refusal("<VolumeData><ImageTexture3D url='\"http://a/b.nrrd\"'/></VolumeData>"),
              is_sentence("nothing is fetched"));
  EXPECT_THAT(refusal("<unit category='length' name='mm' conversionFactor='0.001'/>" + kVolume),
              is_sentence("metres"));
}

TEST(X3dReader, RefusesWhatCouldGrowWithoutBound) {
  EXPECT_THAT(refusal_of("<!DOCTYPE X3D [<!ENTITY a 'x'><!ENTITY b '&a;&a;&a;'>]>"
                         "<X3D><Scene id='&b;'/></X3D>"),
              is_sentence("declares the entity 'a'"));
  EXPECT_THAT(refusal_of("<!DOCTYPE X3D [<!ENTITY a SYSTEM '/etc/passwd'>]><X3D id='&a;'/>"),
              is_sentence("declares the entity"));
  std::string deep, flat;
  for (int k = 0; k < 100'000; ++k) deep += "<Group>";
  EXPECT_THAT(refusal_of(deep), is_sentence("more than 64 deep"));
  for (int k = 0; k < 100'001; ++k) flat += "<a/>";
  EXPECT_THAT(refusal(flat), is_sentence("more than 100000 elements"));
  // Nested references: ten times ten times ... the same nodes.
  std::string bomb = "<Group DEF='g0'><Shape/></Group>";
  for (int k = 1; k < 12; ++k) {
    bomb += "<Group DEF='g" + std::to_string(k) + "'>";
    for (int n = 0; n < 10; ++n) bomb += "<Group USE='g" + std::to_string(k - 1) + "'/>";
    bomb += "</Group>";
  }
  EXPECT_THAT(refusal(bomb), is_sentence("unfolds to more than"));
  std::string chain = "<Group DEF='g0'/>";
  for (int k = 1; k < 2000; ++k)
    chain += "<Group DEF='g" + std::to_string(k) + "'><Group USE='g" + std::to_string(k - 1) +
             "'/></Group>";
  EXPECT_THAT(refusal(chain), is_sentence("nests more than"));
  EXPECT_THAT(refusal("<Group DEF='a'><Group USE='a'/></Group>"),
              is_sentence("leads back to itself"));
}

TEST(X3dReader, RefusesRoutesInACircle) {
  const std::string nodes = kVolume + "<Transform DEF='A'/><Transform DEF='B'/>";
  const auto route = [](const std::string& from, const std::string& to) {
    return "<ROUTE fromNode='" + from + "' fromField='translation_changed' toNode='" + to +
           "' toField='set_translation'/>";
  };
  EXPECT_THAT(refusal(nodes + route("A", "B") + route("B", "A")), is_sentence("part of a circle"));
  EXPECT_THAT(refusal(nodes + route("A", "A")), is_sentence("part of a circle"));
  EXPECT_THAT(accepted(nodes + route("A", "B")).notes.size(), 1U);
}

TEST(X3dReader, ReadsFilesThatAreThereAndScenesWithinScenes) {
  const files::TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  write("a.nrrd", "not looked at");
  write("inner.x3d", scene_of(kVolume));
  write("outer.x3d", scene_of("<Transform translation='0 0 1'><Inline url='\"inner.x3d\"'/>"
                              "</Transform>"));
  const auto scene = read_x3d(folder / "outer.x3d");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->spec.volumes[0].transform.translation_m.z, 1.0);
  EXPECT_THAT(scene->files,
              ElementsAre(folder / "outer.x3d", folder / "inner.x3d", folder / "a.nrrd"));
  write("circle.x3d", scene_of("<Inline url='\"circle.x3d\"'/>"));
  EXPECT_THAT(read_x3d(folder / "circle.x3d").error().message, HasSubstr("leads back to itself"));
  write("lost.x3d", scene_of("<VolumeData><ImageTexture3D url='\"b.nrrd\"'/></VolumeData>"));
  EXPECT_THAT(read_x3d(folder / "lost.x3d").error().message,
              AllOf(HasSubstr("there is no file"), HasSubstr("b.nrrd"), EndsWith(".")));
  EXPECT_THAT(read_x3d(folder.path()).error().message, HasSubstr("not a file"));
  // A file that is named without a folder: in the one that the process works in.
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  const auto bare = read_x3d("lost.x3d");
  fs::current_path(before);
  ASSERT_FALSE(bare);
  EXPECT_THAT(bare.error().message,
              HasSubstr("relative to '" + fs::canonical(folder.path()).string() + "'"));
  // Another folder for the files.
  const files::TemporaryFolder elsewhere;
  std::ofstream(elsewhere / "b.nrrd") << "not looked at";
  const auto there = read_x3d(folder / "lost.x3d", elsewhere.path());
  ASSERT_TRUE(there) << there.error().message;
  EXPECT_THAT(there->spec.volumes[0].files, ElementsAre(elsewhere / "b.nrrd"));
}

}  // namespace
}  // namespace palpate::x3d
