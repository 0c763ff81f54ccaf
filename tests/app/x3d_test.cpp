// X3D scenes through the program: plan, feel, view, info, convert.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <sstream>

#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/app/ticks.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kExample = PALPATE_SOURCE_DIR "/docs/examples/dichloroethane.x3d";

std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// The output of `plan` without its notes.
std::string plan_of(const std::string& scene) {
  const Outcome outcome = run({"plan", scene});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.out.substr(0, outcome.out.find("Note "));
}

/// A heart of four frames, and an X3D scene in which it beats and moves.
std::string beating(const TemporaryFolder& folder) {
  written(small_heart(), folder / "heart.seq.nrrd");
  std::ofstream(folder / "heart.x3d") << R"(<X3D profile='Full' version='4.0'><Scene>
    <TimeSensor DEF='BEAT' cycleInterval='0.8' loop='true'/>
    <TimeSensor DEF='SWAY' cycleInterval='4' loop='true'/>
    <PositionInterpolator DEF='WAY' key='0 0.5 1' keyValue='0 0 0  0.01 0 0  0 0 0'/>
    <Viewpoint position='0 0 1'/>
    <Transform DEF='PLACE'>
      <VolumeData DEF='heart' dimensions='0.1 0.1 0.1'>
        <PalpateSequenceTexture3D DEF='FRAMES' containerField='voxels' url='"heart.seq.nrrd"'/>
      </VolumeData>
    </Transform>
    <ROUTE fromNode='BEAT' fromField='fraction_changed' toNode='FRAMES' toField='set_fraction'/>
    <ROUTE fromNode='SWAY' fromField='fraction_changed' toNode='WAY' toField='set_fraction'/>
    <ROUTE fromNode='WAY' fromField='value_changed' toNode='PLACE' toField='set_translation'/>
  </Scene></X3D>)";
  return folder / "heart.x3d";
}

TEST(X3d, IsPlannedAndFeltAsTheBuiltInMolecule) {
  EXPECT_EQ(plan_of(kExample), plan_of("molecule"));
  const Outcome felt = run_computed(
      {"feel", kExample, "--device", "simulated", "--seconds", "1", "--headset", "off"});
  EXPECT_EQ(felt.exit_code, 0) << felt.err;
  EXPECT_THAT(felt.out, HasSubstr("Nodes without effect here: Background, ImportLibrary."));
  const Outcome info = run({"info", kExample});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, AllOf(HasSubstr("X3D"), HasSubstr("field lines: follow of molecule")));
}

TEST(X3d, LetsASequenceBeatAndMoveAndFindsItsSurface) {
  const TemporaryFolder folder;
  const std::string scene = beating(folder);
  const Outcome plan = run({"plan", scene});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, AllOf(HasSubstr("frames     4 in 0.8 s, over and over"),
                              HasSubstr("pose, moving by keys, at the tick's own time"),
                              HasSubstr("felt by    surface"), HasSubstr("Viewpoint")));
  const Outcome felt = run_computed({"feel", scene, "--device", "simulated", "--seconds", "1",
                                     "--headset", "off", "--no-motion"});
  EXPECT_EQ(felt.exit_code, 0) << felt.err;
}

TEST(X3d, TakesAnObliqueVolumeWithoutDimensionsOrWithThreeDigits) {
  const TemporaryFolder folder;
  // As an MR of the heart: turned about all axes, slices thicker than voxels are wide.
  Sequence heart = small_heart(1);
  Grid& grid = heart.frames[0].grid;
  grid.spacing_mm.z = 3.1;
  grid.direction = glm::mat3_cast(glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3))));
  written(heart.frames[0], folder / "heart.mha");
  const auto scene = [&](const std::string& fields) {
    const std::string file = folder / "heart.x3d";
    std::ofstream(file) << "<X3D><Scene><VolumeData DEF='heart' " << fields
                        << "><ImageTexture3D url='heart.mha'/></VolumeData></Scene></X3D>";
    return file;
  };
  const glm::dvec3 size = grid.spacing_mm * glm::dvec3(grid.size) / 1000.0;
  const Outcome none = run({"plan", scene("")});
  EXPECT_EQ(none.exit_code, 0) << none.err;
  EXPECT_THAT(none.out, AllOf(HasSubstr("heart lies obliquely and keeps its proportions"),
                              HasSubstr("the scene gives no dimensions")));
  // What is assumed for X3D is written out for JSON.
  const Outcome converted = run({"convert", scene(""), folder / "heart.json"});
  EXPECT_EQ(converted.exit_code, 0) << converted.err;
  const Outcome again = run({"plan", folder / "heart.json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, Not(HasSubstr("obliquely")));
  const Outcome digits = run(
      {"plan", scene(fmt::format("dimensions='{:.3f} {:.3f} {:.3f}'", size.x, size.y, size.z))});
  EXPECT_EQ(digits.exit_code, 0) << digits.err;
  const Outcome cube = run({"plan", scene("dimensions='0.1 0.1 0.1'")});
  EXPECT_EQ(cube.exit_code, 2);
  EXPECT_THAT(cube.err,
              HasSubstr(fmt::format("for example {:.4g} {:.4g} {:.4g}", size.x, size.y, size.z)));
}

TEST(X3d, IsConvertedToJsonAndBack) {
  const TemporaryFolder folder;
  const std::string scene = beating(folder);
  const Outcome there = run({"convert", scene, folder / "heart.json"});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(text_of(folder / "heart.json"),
              AllOf(HasSubstr("\"cycle_s\": 0.8"), HasSubstr("\"keys\"")));
  const Outcome back = run({"convert", folder / "heart.json", folder / "again.x3d"});
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(back.out.find("Note"), std::string::npos) << back.out;
  EXPECT_EQ(plan_of(folder / "again.x3d"), plan_of(scene));
  // JSON, converted to X3D and back, is unchanged.
  const Outcome once_more = run({"convert", folder / "again.x3d", folder / "again.json"});
  ASSERT_EQ(once_more.exit_code, 0) << once_more.err;
  EXPECT_EQ(text_of(folder / "again.json"), text_of(folder / "heart.json"));
}

TEST(X3d, GetsFilesAsBoxesOfTheirSize) {
  const TemporaryFolder folder;
  written(small_heart(), folder / "heart.seq.nrrd");
  std::ofstream(folder / "a.json")
      << R"({"volumes": [{"name": "a", "files": "heart.seq.nrrd", "frames_per_second": 5, "rate": 2,
             "transform": {"translation_m": [0, 0.1, 0], "scale": 0.5}}],
             "modes": [{"strength": 2}]})";
  const Outcome there = run({"convert", folder / "a.json", folder / "a.x3d"});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out, HasSubstr("no words for these keys of the volume \"a\", which are left "
                                   "out: rate."));
  // 48 voxels of 8/3 mm at half their size; four frames at 5 per second.
  EXPECT_THAT(text_of(folder / "a.x3d"),
              AllOf(HasSubstr("dimensions='0.064"), HasSubstr("cycleInterval='0.8'")));
}

template <class T>
void write_raw(const std::string& file, const std::vector<T>& numbers) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(numbers.data()),
             std::streamsize(numbers.size() * sizeof(T)));
}

/// The samples of an image with a header and without one: the same scene.
TEST(X3d, TakesSamplesWithoutAHeaderAsThoseWithOne) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Volume frame = small_heart().frames.front();
  frame.grid.spacing_mm = glm::dvec3(2.5);
  frame.grid.origin_mm = glm::dvec3(0.0);
  frame.grid.direction = glm::dmat3(1, 0, 0, 0, 0, 1, 0, -1, 0);  // the axes of a scene
  ASSERT_TRUE(files::write_volume(frame, folder / "with.mha"));
  write_raw(folder / "without.raw", frame.values);
  const auto scene = [&](const std::string& name, const std::string& texture) {
    std::ofstream(folder / name) << "<X3D><Scene><VolumeData DEF='heart' dimensions='0.1 0.12 0.1'>"
                                 << texture << "</VolumeData></Scene></X3D>";
    return (folder / name).string();
  };
  const std::string with = scene("with.x3d", "<ImageTexture3D url='\"with.mha\"'/>");
  const std::string without =
      scene("without.x3d",
            "<ImageTexture3D url='\"without.raw\"'><RawImageLoader containerField='imageLoader' "
            "width='48' height='48' depth='48' pixelType='LUMINANCE' "
            "pixelComponentType='RATIONAL' bitsPerPixel='32' pixelSize='0.0025 0.0025 "
            "0.0025'/></ImageTexture3D>");
  EXPECT_EQ(plan_of(without), plan_of(with));
  EXPECT_THAT(plan_of(without), HasSubstr("felt by    surface"));
  for (const std::string& one : {with, without}) {
    const Outcome drawn = run({"view", one, "--picture", one + ".png", "--picture-size", "64"});
    ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  }
  EXPECT_EQ(text_of(without + ".png"), text_of(with + ".png"));
  // Through JSON and back, with nothing lost.
  const Outcome there = run({"convert", without, folder / "a.json"});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  const Outcome back = run({"convert", folder / "a.json", folder / "again.x3d"});
  ASSERT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(back.out.find("Note"), std::string::npos) << back.out;
  EXPECT_EQ(plan_of(folder / "again.x3d"), plan_of(without));
  std::ofstream(folder / "without.raw", std::ios::app) << "x";
  const Outcome longer = run({"plan", without});
  EXPECT_EQ(longer.exit_code, 2);
  EXPECT_THAT(longer.err, HasSubstr("48 x 48 x 48 samples of 4 bytes"));
}

/// A flow along y in the file pushes along y in the scene.
TEST(X3d, FeelsVectorsWithoutAHeaderAlongTheAxesOfTheScene) {
  const TemporaryFolder folder;
  std::vector<float> flow;
  // Zero at the border, which extends outside: there the hand is free and the start ramp can begin.
  const auto is_inside = [](int k) { return k > 0 && k < 7; };
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const bool flows = is_inside(x) && is_inside(y) && is_inside(z);
        flow.insert(flow.end(), {0.0F, flows ? 1.0F : 0.0F, 0.0F});
      }
  write_raw(folder / "flow.raw", flow);
  std::ofstream(folder / "flow.x3d") << R"(<X3D><Scene><PalpateVectorForceMode gain='0.5'>
      <VectorVolume url='"flow.raw"'><RawImageLoader width='8' height='8' depth='8' pixelType='VEC3'
        pixelComponentType='RATIONAL' bitsPerPixel='96' pixelSize='0.004 0.004 0.004'/></VectorVolume>
      <PiecewiseFunction containerField='strength' segments='0 1'/>
    </PalpateVectorForceMode></Scene></X3D>)";
  std::ofstream(folder / "path.csv") << "0,0,0.04,0\n3,0,0.04,0\n4,0,0,0\n20,0,0,0\n";
  const Outcome felt =
      run_computed({"feel", folder / "flow.x3d", "--device", "simulated", "--path",
                    folder / "path.csv", "--headset", "off", "--seconds", "8", "--csv",
                    folder / "ticks.csv", "--watchdog", "1000", "--black-box", folder / "."});
  ASSERT_EQ(felt.exit_code, 0) << felt.err;
  const Table ticks(folder / "ticks.csv");
  double most_n = 0.0;
  for (size_t row = 0; row < ticks.size(); ++row) {
    most_n = std::max(most_n, ticks.number(row, "force_y_n"));
    EXPECT_NEAR(ticks.number(row, "force_x_n"), 0.0, 1e-9) << row;
    EXPECT_NEAR(ticks.number(row, "force_z_n"), 0.0, 1e-9) << row;
  }
  EXPECT_GT(most_n, 0.1);
}

TEST(X3d, SaysInOneSentenceWhatIsWrong) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::vector<std::string>& arguments) {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    return outcome.err;
  };
  std::ofstream(folder / "bad.x3d") << "<!DOCTYPE X3D [<!ENTITY a 'b'>]><X3D>&a;</X3D>";
  for (const char* command : {"plan", "feel", "info"})
    EXPECT_THAT(refusal({command, folder / "bad.x3d"}), HasSubstr("entity"));
  const std::string scene = beating(folder);
  EXPECT_THAT(refusal({"convert", scene, folder / "a.txt"}), HasSubstr(".json nor .x3d"));
  EXPECT_THAT(refusal({"convert", "heart", folder / "a.x3d"}), HasSubstr("palpate phantom"));
  // No output may be a file that the scene reads.
  const std::string before = text_of(folder / "heart.seq.nrrd");
  EXPECT_THAT(refusal({"feel", scene, "--csv", folder / "heart.seq.nrrd"}), HasSubstr("lost"));
  EXPECT_THAT(refusal({"convert", scene, scene}), HasSubstr("lost"));
  EXPECT_EQ(text_of(folder / "heart.seq.nrrd"), before);
}

}  // namespace
}  // namespace palpate::app
