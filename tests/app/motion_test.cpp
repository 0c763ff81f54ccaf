// The program from input files to output files, on phantoms whose motion is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <regex>

#include "compute/motion/quality.h"
#include "integration/files/read_volume.h"
#include "integration/files/sequence_motion_file.h"
#include "tests/app/pages.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/other_programs.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

// At 48^3 the wall of the heart is four voxels thick and its texture is under-sampled: fields have
// an error of 0.2 to 0.35 voxel; a field of zeros has 1.8.
constexpr double kSmallHeartVoxels = 0.5;

Field field_in(const std::filesystem::path& path) {
  auto field = files::read_field(path);
  EXPECT_TRUE(field) << (field ? "" : field.error().message);
  return field ? std::move(*field) : Field{};
}

double error_on_the_wall(const Field& field, int fixed, int moving, int frames = 4) {
  const Grid grid = heart_grid(kHeartSize);
  const Mask wall = shell_mask(grid, fixed, frames);
  const auto error = endpoint_error(field, shell_truth(grid, fixed, moving, frames), &wall);
  EXPECT_TRUE(error);
  return error ? error->voxels.mean : 1e9;
}

TEST(MotionOfAPair, IsRightAndKeepsTheGeometryInEveryFormat) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.mha");
  const std::string moving = written(heart.frames[1], folder / "moving.nii.gz");
  for (const char* name : {"u.mha", "u.nrrd", "u.nii.gz"}) {
    const Outcome result = run({"motion", fixed, moving, "-o", folder / name});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("Memory"));
    EXPECT_THAT(result.out, HasSubstr("Verdict   ok"));
    const Field field = field_in(folder / name);
    EXPECT_TRUE(same_geometry(field.grid, heart.frames[0].grid)) << name;
    EXPECT_EQ(folds(field).folded, 0U);
    EXPECT_LT(error_on_the_wall(field, 0, 1), kSmallHeartVoxels) << name;
  }
}

TEST(MotionOfAPair, ComesWithInverseConfidenceAndPicture) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.mha");
  const std::string moving = written(heart.frames[1], folder / "moving.mha");
  std::vector<std::string> arguments = {"motion",         fixed,       moving,         "-o",
                                        folder / "u.mha", "--inverse", "--confidence", "--pictures",
                                        "--quiet"};
  if (writes_pages()) arguments.insert(arguments.end(), {"--page", folder / "u.html"});
  const Outcome result = run(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out + result.err, "");
  const Field field = field_in(folder / "u.mha");
  const Field inverse = field_in(folder / "u_inverse.mha");
  const auto consistency = inverse_consistency(field, inverse, field.grid);
  ASSERT_TRUE(consistency);
  // The inverse is right to a thousandth of a voxel at its samples. Between them both fields are
  // trilinear: at voxels of 2.7 mm and the curvature of this motion this adds a few hundredths.
  EXPECT_LT(consistency->voxels.mean, 0.05);
  const auto confidence = files::read_volume(folder / "u_confidence.mha");
  ASSERT_TRUE(confidence) << confidence.error().message;
  const auto [low, high] =
      std::minmax_element(confidence->values.begin(), confidence->values.end());
  EXPECT_GE(*low, 0.0F);
  EXPECT_LE(*high, 1.0F);
  EXPECT_GT(*high, *low);
  // Two numbers for each voxel: nowhere is the motion less certain along the gradient than across.
  const std::string deviation = files::read_bytes(folder / "u_deviation.mha");
  EXPECT_THAT(deviation, HasSubstr("ElementNumberOfChannels = 2\n"));
  std::vector<glm::vec2> sd(confidence->values.size());
  const size_t header = deviation.size() - sd.size() * sizeof(glm::vec2);
  ASSERT_THAT(deviation.substr(0, header), testing::EndsWith("ElementDataFile = LOCAL\n"));
  std::memcpy(sd.data(), deviation.data() + header, sd.size() * sizeof(glm::vec2));
  for (const glm::vec2& voxel : sd) {
    ASSERT_GT(voxel.x, 0.0F);
    ASSERT_GT(voxel.y, voxel.x);
  }
  EXPECT_EQ(files::read_bytes(folder / "u.png").substr(1, 3), "PNG");
  EXPECT_EQ(folder.entry_count(), writes_pages() ? 8U : 7U);
  if (!writes_pages()) return;
  const auto page = page_data(folder / "u.html");
  EXPECT_EQ(page["frame_labels"], nlohmann::json({"fixed", "moving"}));
  EXPECT_EQ(page["volumes"][0]["frame_count"], 2);
  EXPECT_EQ(page["volumes"][1]["frame_count"], 1);
}

/// The same samples at the same places, in a file with left-handed axes.
Volume mirrored(Volume volume) {
  volume.grid.j_reversed_in_file = true;
  return volume;
}

/// Largest difference of two fields on one grid, mm.
double largest_difference_mm(const Field& a, const Field& b) {
  EXPECT_TRUE(same_geometry(a.grid, b.grid));
  EXPECT_EQ(a.u_mm.size(), b.u_mm.size());
  double largest = 0.0;
  for (size_t v = 0; v < std::min(a.u_mm.size(), b.u_mm.size()); ++v)
    largest = std::max(largest, double(glm::distance(a.u_mm[v], b.u_mm[v])));
  return largest;
}

// Axes that were reversed twice are rounded in the last digit of a double; the computation is in
// single precision.
constexpr double kSameFieldMm = 1e-5;

TEST(MotionOfAPair, OfLeftHandedFilesIsTheSameAndLiesOnTheirOwnAxes) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  Mask body{heart.frames[0].grid, std::vector<uint8_t>(heart.frames[0].grid.count(), 0)};
  // Not symmetric along any axis, so that a mask reversed along one is detected.
  for (int k = 4; k < 40; ++k)
    for (int j = 10; j < 46; ++j)
      for (int i = 6; i < 40; ++i) body.values[body.grid.offset(i, j, k)] = 1;
  for (const char* ending : {".mha", ".nrrd", ".nii"}) {
    const bool nifti = std::string(ending) == ".nii";
    for (const bool turn : {false, true}) {
      const auto name = [&](const char* what) {
        return (folder / (std::string(what) + (turn ? "_left" : "_right") + ending)).string();
      };
      const auto in_hand = [&](const Volume& v) { return turn ? mirrored(v) : v; };
      body.grid.j_reversed_in_file = turn;
      ASSERT_TRUE(files::write_mask(body, name("mask")));
      const std::string fixed = written(in_hand(heart.frames[0]), name("fixed"));
      const std::string moving = written(in_hand(heart.frames[1]), name("moving"));
      const Outcome result = run({"motion", fixed, moving, "-o", name("u"), "--mask", name("mask"),
                                  "--inverse", "--confidence"});
      ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
      const Outcome coarse = run({"motion", fixed, moving, "-o", name("coarse"), "--coarse"});
      ASSERT_EQ(coarse.exit_code, 0) << coarse.out << coarse.err;
    }
    // NIfTI stores positions in single precision: 1e-5 mm of 60.
    const double tolerance_mm = nifti ? 1e-3 : kSameFieldMm;
    for (const char* what : {"u", "u_left_inverse", "coarse"}) {
      const bool inverse = std::string(what) == "u_left_inverse";
      const auto right = inverse ? folder / (std::string("u_right_inverse") + ending)
                                 : folder / (std::string(what) + "_right" + ending);
      const auto left = inverse ? folder / (std::string("u_left_inverse") + ending)
                                : folder / (std::string(what) + "_left" + ending);
      const Field field = field_in(left);
      EXPECT_TRUE(field.grid.j_reversed_in_file) << left;
      EXPECT_FALSE(field_in(right).grid.j_reversed_in_file) << right;
      EXPECT_LT(largest_difference_mm(field_in(right), field), tolerance_mm) << left;
    }
    const auto sure = files::read_volume(folder / (std::string("u_right_confidence") + ending)),
               left = files::read_volume(folder / (std::string("u_left_confidence") + ending));
    ASSERT_TRUE(sure && left);
    EXPECT_TRUE(left->grid.j_reversed_in_file);
    for (size_t v = 0; v < sure->values.size(); ++v)
      ASSERT_NEAR(sure->values[v], left->values[v], 1e-3) << v;
    // A left-handed truth for a right-handed field, and the reverse.
    for (const auto& [field, truth] :
         {std::pair("u_right", "u_left"), std::pair("u_left", "u_right")}) {
      const Outcome check = run({"check", folder / (std::string(field) + ending), "--truth",
                                 folder / (std::string(truth) + ending), "--mask",
                                 folder / (std::string("mask_left") + ending), "--json"});
      EXPECT_EQ(check.exit_code, 0) << check.err;
      EXPECT_LT(check.json()["endpoint_error"]["mm"]["max"], tolerance_mm);
    }
  }
}

TEST(MotionOfAPair, OfDicomAndOfItsNiftiIsTheSame) {
  NEEDS_DEVICE();
  if (!files::succeeds("command -v dcm2niix")) GTEST_SKIP() << "dcm2niix is not installed";
  const TemporaryFolder folder;
  // Edges of 2 mm: NIfTI's 32-bit numbers represent these axes exactly, so the images are equal to
  // the last bit.
  const Sequence heart = shell_phantom(heart_grid(64), 4, 1, 0.01);
  const char* const names[] = {"fixed", "moving"};
  for (size_t k = 0; k < 2; ++k) {
    Volume frame = heart.frames[k];
    for (float& value : frame.values) value = std::round(10.0F * value);
    std::filesystem::create_directory(folder / names[k]);
    files::write_dicom_volume(folder / names[k], frame);
    ASSERT_TRUE(files::succeeds("dcm2niix -b n -z y -f " + std::string(names[k]) + " -o " +
                                folder.path().string() + " " + (folder / names[k]).string()));
  }
  const Outcome dicom =
      run({"motion", folder / "fixed", folder / "moving", "-o", folder / "u_dicom.nii"});
  EXPECT_EQ(dicom.exit_code, 0) << dicom.out << dicom.err;
  const Outcome nifti =
      run({"motion", folder / "fixed.nii.gz", folder / "moving.nii.gz", "-o", folder / "u.nii"});
  EXPECT_EQ(nifti.exit_code, 0) << nifti.out << nifti.err;
  const Field field = field_in(folder / "u.nii");
  EXPECT_TRUE(field.grid.j_reversed_in_file);
  EXPECT_LT(largest_difference_mm(field_in(folder / "u_dicom.nii"), field), 1e-6);
  EXPECT_LT(error_on_the_wall(field, 0, 1), kSmallHeartVoxels);
}

TEST(MotionOfAPair, SaysWhichFormOfANiftiIsUsed) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.nii");
  const std::string moving = written(heart.frames[1], folder / "moving.nii");
  std::string bytes = files::read_bytes(moving);
  const float shift = 30.0F;
  std::memcpy(bytes.data() + 268, &shift, sizeof(shift));  // qoffset_x
  files::write_bytes(moving, bytes);
  const Outcome result = run({"motion", fixed, moving, "-o", folder / "u.mha"});
  EXPECT_THAT(result.out, HasSubstr("Note      '" + moving));
  EXPECT_THAT(result.out, HasSubstr("the sform is used"));
  EXPECT_LT(error_on_the_wall(field_in(folder / "u.mha"), 0, 1), kSmallHeartVoxels);
  const Outcome check = run({"check", folder / "u.mha", "--fixed", fixed, "--moving", moving});
  EXPECT_THAT(check.out, HasSubstr("the sform is used"));
}

TEST(MotionOfAPair, ResamplesAMovingVolumeOnAnotherGrid) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string fixed = written(small_heart().frames[0], folder / "fixed.mha");
  const std::string moving = written(shell_phantom(64, 4).frames[1], folder / "moving.mha");
  const Outcome result = run({"motion", fixed, moving, "-o", folder / "u.mha"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_LT(error_on_the_wall(field_in(folder / "u.mha"), 0, 1), kSmallHeartVoxels);
}

TEST(MotionOfASequence, WritesAFieldPerPairAndASummary) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(), folder / "heart.seq.nrrd");
  const Outcome result =
      run({"motion", heart, "-o", folder / "new/out", "--cyclic", "--json", "--model", "pairwise"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (int k = 0; k < 4; ++k) {
    const int next = (k + 1) % 4;
    const std::string name = "motion_" + std::to_string(k) + "_to_" + std::to_string(next) + ".mha";
    EXPECT_LT(error_on_the_wall(field_in(folder / "new/out" / name), k, next), kSmallHeartVoxels)
        << name;
  }
  const auto summary = result.json();
  EXPECT_EQ(summary["pairs"].size(), 4U);
  EXPECT_EQ(summary["verdict"]["word"], "ok");
  EXPECT_EQ(summary["pairs"][3]["field"], "motion_3_to_0.mha");
  EXPECT_EQ(summary["pairs"][0]["evidence"]["folds"]["folded"], 0);
  EXPECT_LT(summary["cycle_drift"]["structure"]["voxels"]["mean"], 0.5);
  EXPECT_EQ(summary, nlohmann::json::parse(std::ifstream(folder / "new/out/summary.json")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "new/out"), {}), 5);
  EXPECT_EQ(folder.entry_count(), 2U);
}

/// Drift and length have one definition in both commands; the table of 'check' is rounded to a
/// thousandth.
TEST(MotionOfASequence, SaysTheSameNumbersAsCheck) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const Sequence frames = small_heart();
  const std::string heart = written(frames, folder / "heart.seq.nrrd");
  const std::string fixed = written(frames.frames[0], folder / "f.mha"),
                    moving = written(frames.frames[1], folder / "m.mha");
  Volume half{frames.frames[0].grid, std::vector<float>(frames.frames[0].grid.count(), 1.0F)};
  for (size_t n = 0; n < half.values.size() / 3; ++n) half.values[n] = 0.0F;
  const std::string mask = written(half, folder / "mask.mha");
  for (const bool masked : {false, true}) {
    for (const bool coarse : {false, true}) {
      SCOPED_TRACE(::testing::Message() << "masked " << masked << ", coarse " << coarse);
      std::vector<std::string> command = {"motion", heart,      "-o",   folder / "out", "--cyclic",
                                          "--json", "--preset", "fast", "--model",      "pairwise"};
      if (masked) command.insert(command.end(), {"--mask", mask});
      if (coarse) command.push_back("--coarse");
      const Outcome estimated = run(command);
      ASSERT_LE(estimated.exit_code, 4) << estimated.err;
      const auto said = estimated.json();
      std::vector<std::string> check = {"check", folder / "out/motion_0_to_1.mha", "--cycle"};
      for (const char* name : {"1_to_2", "2_to_3", "3_to_0"})
        check.push_back(folder / ("out/motion_" + std::string(name) + ".mha"));
      check.insert(check.end(), {"--fixed", fixed, "--moving", moving, "--json"});
      if (masked) check.insert(check.end(), {"--mask", mask});
      const Outcome checked = run(check);
      const auto found = checked.json();
      EXPECT_EQ(said["cycle_drift"], found["cycle_drift"]);
      EXPECT_EQ(said["pairs"][0]["motion_mm"], found["motion_mm"]);
      EXPECT_EQ(said["pairs"][0]["evidence"]["match"], found["match"]);
      EXPECT_EQ(said["pairs"][0]["evidence"]["folds"], found["folds"]);
      const size_t line = estimated.err.find("Cycle  "), end = estimated.err.find('\n', line);
      ASSERT_NE(line, std::string::npos);
      EXPECT_THAT(checked.err, HasSubstr(estimated.err.substr(line, end - line)));
    }
  }
}

TEST(MotionOfASequence, PadsFrameNumbersAndReplacesOldResults) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(24, 11), folder / "heart.seq.nrrd");
  std::filesystem::create_directory(folder / "out");
  files::write_bytes(folder / "out/motion_00_to_01.nrrd", "old");
  const Outcome result = run({"motion", heart, "-o", folder / "out", "--preset", "fast", "--format",
                              "nrrd", "--coarse", "--no-verdict", "--inverse"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Field field = field_in(folder / "out/motion_00_to_01.nrrd");
  EXPECT_LT(field.grid.size.x, 24);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/motion_09_to_10.nrrd"));
  EXPECT_TRUE(same_geometry(field_in(folder / "out/inverse_10_to_09.nrrd").grid, field.grid));
}

TEST(MotionOfASequence, StopsAtCtrlCWithoutATrace) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(96, 6), folder / "heart.seq.nrrd");
  Program program({"motion", heart, "-o", folder / "out", "--preset", "best"});
  ASSERT_TRUE(program.wait_for("Device"));
  program.signal(SIGINT);
  const Outcome result = program.wait();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("Stopped"));
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionOfASequence, StopsAtCtrlCWhileFieldsAreAlreadyWaiting) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(shell_phantom(64, 12), folder / "heart.seq.nrrd");
  Program program({"motion", heart, "-o", folder / "out", "--model", "pairwise"});
  ASSERT_TRUE(program.wait_for("Frame 1 to 2"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait().exit_code, 1);
  EXPECT_EQ(folder.entry_count(), 1U);
}

/// Pairs that must never be ok: the exit status is that of suspect or failed, and a reason is
/// printed.
void expect_distrusted(const Volume& fixed, const Volume& moving) {
  const TemporaryFolder folder;
  const Outcome result = run({"motion", written(fixed, folder / "fixed.mha"),
                              written(moving, folder / "moving.mha"), "-o", folder / "u.mha"});
  EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("\n          - "));
  EXPECT_TRUE(std::filesystem::exists(folder / "u.mha"));
}

TEST(Verdict, DistrustsSwappedSubjects) {
  NEEDS_DEVICE();
  Volume other = sliding_phantom(kHeartSize, 5.0).fixed;
  const Volume heart = small_heart().frames[0];
  other.grid = heart.grid;
  expect_distrusted(heart, other);
  expect_distrusted(other, heart);
}

TEST(Verdict, DistrustsAnEmptyFrame) {
  NEEDS_DEVICE();
  const Volume heart = small_heart().frames[0];
  const Volume empty{heart.grid, std::vector<float>(heart.values.size(), 0.0F)};
  expect_distrusted(heart, empty);
  expect_distrusted(empty, heart);
}

TEST(Verdict, DistrustsAShiftByMostOfTheImage) {
  NEEDS_DEVICE();
  const Sequence heart = small_heart();
  expect_distrusted(heart.frames[0], shifted(heart.frames[1], 90.0));
}

TEST(MotionOfAPair, WhosePageCanNotBeWrittenIsRefusedBeforeItIsEstimated) {
  if (!writes_pages()) GTEST_SKIP() << "palpate was built without NiiVue";
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const std::string fixed = written(heart.frames[0], folder / "fixed.mha");
  const Outcome result =
      run({"motion", fixed, fixed, "-o", folder / "u.mha", "--page", folder / "u.png"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("name it .html"));
  EXPECT_EQ(folder.entry_count(), 1U);
}

TEST(MotionOfAPair, ThatDoesNotOverlapIsRefused) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart();
  const Outcome result = run({"motion", written(heart.frames[0], folder / "fixed.mha"),
                              written(shifted(heart.frames[1], 200.0), folder / "moving.mha"), "-o",
                              folder / "u.mha"});
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, HasSubstr("overlap"));
}

TEST(Verdict, DistrustsASequenceWithAForeignFrame) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  Sequence heart = small_heart();
  heart.frames[2].values = sliding_phantom(kHeartSize, 5.0).fixed.values;
  const std::string frames = written(heart, folder / "heart.seq.nrrd");
  for (const auto& [model, where] :
       {std::pair("pairwise", "Frame 1 to 2: "), std::pair("sequence", "Frame 2: ")}) {
    const Outcome result =
        run({"motion", frames, "-o", folder / model, "--quiet", "--model", model});
    EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.exit_code;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr(where));
  }
}

TEST(OneMotion, IsWrittenInAllItsFormsAndRead) {
  NEEDS_DEVICE();
  constexpr int kFrames = 6;
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(kFrames), folder / "heart.seq.nrrd");
  const std::string out = folder / "out", page = folder / "page.html";
  std::vector<std::string> arguments = {"motion",   heart,    "-o",          out,
                                        "--cyclic", "--json", "--confidence"};
  if (writes_pages()) arguments.insert(arguments.end(), {"--page", page});
  const Outcome result = run(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("one for all 6 frames"));
  if (writes_pages()) {
    // A step leads on from each frame of a cycle.
    const auto shown = page_data(page);
    std::vector<std::string> titles;
    for (const auto& volume : shown["volumes"]) {
      titles.push_back(volume["title"]);
      EXPECT_EQ(volume["frame_count"], kFrames);
    }
    EXPECT_THAT(titles, testing::ElementsAre("value", "motion", "confidence", "deviation",
                                             "volume change"));
    EXPECT_EQ(shown["verdict"]["word"], "ok");
    EXPECT_EQ(shown["plots"].size(), 2U);
    EXPECT_GT(shown["plots"][0]["curves"][0]["y"][0], 0.0);
  }
  const auto summary = result.json();
  EXPECT_EQ(summary["model"], "sequence");
  EXPECT_EQ(summary["verdict"]["word"], "ok");
  EXPECT_EQ(summary["evidence"]["frames"].size(), size_t(kFrames));
  EXPECT_FALSE(summary.contains("notes"));
  const int reference = summary["sequence"]["reference_frame"];
  for (int k = 0; k < kFrames; ++k) {
    const std::string next = std::to_string((k + 1) % kFrames), here = std::to_string(k);
    if (k != reference) {
      EXPECT_LT(error_on_the_wall(field_in(out + "/reference_to_" + here + ".mha"), reference, k,
                                  kFrames),
                kSmallHeartVoxels);
    }
    EXPECT_LT(error_on_the_wall(field_in(out + "/motion_" + here + "_to_" + next + ".mha"), k,
                                (k + 1) % kFrames, kFrames),
              kSmallHeartVoxels);
    EXPECT_TRUE(files::read_volume(out + "/confidence_" + here + "_to_" + next + ".mha"));
    EXPECT_TRUE(std::filesystem::exists(out + "/deviation_" + here + "_to_" + next + ".mha"));
  }
  const auto motion = files::read_sequence_motion(out + "/sequence_motion.nrrd");
  ASSERT_TRUE(motion) << motion.error().message;
  EXPECT_EQ(motion->reference, size_t(reference));
  EXPECT_DOUBLE_EQ(motion->basis.cycle_s, 1.0);
  EXPECT_LT(largest_difference_mm(field_in(out + "/reference_to_1.mha"),
                                  resampled(motion->at_frame(1), heart_grid(kHeartSize))),
            1e-4);
  // The written motion is used by `feel`, without an estimation.
  for (const std::string& fields : {out, out + "/sequence_motion.nrrd"}) {
    const Outcome felt = run_computed({"feel", heart, "--fields", fields, "--headset", "off",
                                       "--device", "simulated", "--seconds", "1"});
    EXPECT_EQ(felt.exit_code, 0) << felt.err;
    EXPECT_THAT(felt.out, HasSubstr("6 frames in 1 s, with one motion for all of them"));
  }
  const Outcome info = run({"info", out + "/sequence_motion.nrrd"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("one motion for a sequence of 6 frames"));
  // All its forms are measured: the frames' residual, folds, drift.
  std::vector<std::string> steps, from_reference;
  for (int k = 0; k < kFrames; ++k) {
    steps.push_back(out + "/motion_" + std::to_string(k) + "_to_" +
                    std::to_string((k + 1) % kFrames) + ".mha");
    from_reference.push_back(out + "/reference_to_" + std::to_string(k) + ".mha");
  }
  from_reference.push_back("--cyclic");
  for (const std::vector<std::string>& form :
       {std::vector<std::string>{out}, std::vector<std::string>{out + "/sequence_motion.nrrd"},
        steps, from_reference}) {
    std::vector<std::string> command = {"check"};
    command.insert(command.end(), form.begin(), form.end());
    command.insert(command.end(), {"--sequence", heart, "--json"});
    const Outcome checked = run(command);
    ASSERT_TRUE(checked.exit_code == 0 || checked.exit_code == 3 || checked.exit_code == 4)
        << checked.err;
    const auto found = checked.json();
    // Chained fields are measured from frame 0, which is twice as far from the other frames as the
    // reference frame: too far for such a coarse heart.
    if (form != steps) {
      EXPECT_EQ(found["verdict"]["word"], "ok") << form.front();
    }
    EXPECT_EQ(found["evidence"]["frames"].size(), size_t(kFrames));
    EXPECT_LT(found["evidence"]["drift"]["voxels"]["mean"], 0.1) << form.front();
    EXPECT_GT(found["evidence"]["frames"][0]["acceleration_mm_per_frame2"], 0.0);
  }
  // The motion of another sequence is refused.
  const std::string other = written(small_heart(4), folder / "other.seq.nrrd");
  const Outcome refused = run({"feel", other, "--fields", out, "--headset", "off"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("the motion of 6 frames"));
  // Pairwise fields in the same folder would be read as part of it.
  const Outcome beside = run({"motion", heart, "-o", out, "--model", "pairwise"});
  EXPECT_EQ(beside.exit_code, 2);
  EXPECT_THAT(beside.err, HasSubstr("sequence_motion.nrrd"));
}

TEST(Demo, MakesEstimatesComparesAndDraws) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  for (const auto& [phantom, last, count] : {std::tuple("heart", "motion_7_to_0.png", 16U),
                                             std::tuple("shell", "motion_3_to_0.png", 8U)}) {
    const std::string out = folder / phantom;
    const Outcome result = run({"demo", "-o", out, "--phantom", phantom, "--size", "48"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("beat.png"));
    for (const char* name : {"summary.txt", "beat.png", "motion_0_to_1.mha", last})
      EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / name)) << name;
    // The warning about a pair in the log is also in the table.
    const size_t table = result.out.find("palpate felt a ");
    ASSERT_NE(table, std::string::npos);
    const std::string log = result.out.substr(0, table), summary = result.out.substr(table);
    const std::regex pair("Frame [0-9] to [0-9]   ([0-9.]+ s)|inverse consistency ([0-9.]+ voxel)");
    size_t pairs = 0;
    for (std::sregex_iterator at(log.begin(), log.end(), pair), end; at != end; ++at, ++pairs)
      EXPECT_THAT(summary, HasSubstr((*at)[1].matched ? (*at)[1].str() : (*at)[2].str()));
    EXPECT_EQ(pairs, count);
  }
}

}  // namespace
}  // namespace palpate::app
