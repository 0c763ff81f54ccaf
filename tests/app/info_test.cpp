// palpate info: each kind of file that the program reads, from real data where available.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "integration/files/scene/calibration_file.h"
#include "integration/files/vtk_lines.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/test_images.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const fs::path kShared = PALPATE_SHARED_DATA;

#define NEEDS_SHARED(file)           \
  if (!fs::exists(kShared / (file))) \
  GTEST_SKIP() << "There is no " << (kShared / (file)).string() << "."

/// The information on one file that can be read.
nlohmann::json info(const std::string& file) {
  const Outcome outcome = run({"info", file, "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.exit_code == 0 ? outcome.json()["files"][0] : nlohmann::json();
}

std::vector<std::string> problems(const nlohmann::json& json) {
  return json["problems"].get<std::vector<std::string>>();
}

TEST(Info, OfARealSequence) {
  NEEDS_SHARED("lung/breathing.seq.nrrd");
  const std::string file = kShared / "lung/breathing.seq.nrrd";
  const auto json = info(file);
  EXPECT_EQ(json["kind"], "sequence");
  EXPECT_EQ(json["frames"], 8);
  EXPECT_EQ(json["times_s"].back(), 3.5);
  EXPECT_EQ(json["values"]["not_finite"], 0);
  EXPECT_EQ(json["grid"]["size"], nlohmann::json({115, 157, 129}));
  EXPECT_THAT(problems(json), IsEmpty());
  const Outcome text = run({"info", file});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(
      text.out,
      AllOf(HasSubstr("Is        a sequence of 8 frames"), HasSubstr("0.5 s apart"),
            HasSubstr("115 x 157 x 129 voxels of 1.366 x 1.366 x 2.5 mm"),
            HasSubstr("palpate motion"), HasSubstr("all finite"), Not(HasSubstr("Problem"))));
}

TEST(Info, OfRealVolumesMasksAndLabels) {
  NEEDS_SHARED("heart_cine/frame_00.mha");
  const auto frame = info(kShared / "heart_cine/frame_00.mha");
  EXPECT_EQ(frame["kind"], "volume");
  EXPECT_GT(frame["oblique_degrees"], 5.0);
  EXPECT_THAT(problems(frame), Contains(HasSubstr("times as long as wide")));
  const auto labels = info(kShared / "heart_cine/lv_00.mha");
  EXPECT_EQ(labels["kind"], "labels");
  EXPECT_EQ(labels["values"]["different"], nlohmann::json({0.0, 1.0, 2.0}));
  // The folder has 20 images and 20 label maps.
  const auto folder = info(kShared / "heart_cine");
  EXPECT_THAT(problems(folder), Contains(HasSubstr("20 of its 40 frames hold masks or labels")));
  EXPECT_THAT(problems(folder), Contains(HasSubstr("'frame_#' (20 files), 'lv_#' (20 files)")));
  const auto mask = info(kShared / "lung/pair_body.mha");
  EXPECT_EQ(mask["kind"], "mask");
  EXPECT_THAT(mask["use"], HasSubstr("--mask"));
}

TEST(Info, OfASegmentation) {
  const files::TemporaryFolder folder;
  std::string bytes =
      "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n"
      "space directions: (1,0,0) (0,1,0) (0,0,2)\nkinds: domain domain domain\nencoding: raw\n"
      "Segment0_Color:=1 0.5 0\nSegment0_ID:=Segment_1\nSegment0_LabelValue:=3\nSegment0_Layer:=0\n"
      "Segment0_Name:=left ventricle\n\n";
  bytes += std::string("\0\3\3\0\0\0\0\3\0\0\0\0", 12);
  files::write_bytes(folder / "a.seg.nrrd", bytes);
  const auto json = info(folder / "a.seg.nrrd");
  EXPECT_EQ(json["kind"], "segmentation");
  EXPECT_THAT(json["use"], HasSubstr("--segments"));
  EXPECT_EQ(json["more"][0][1], "left ventricle: label 3, colour 1 0.5 0, 0.006 ml");
}

TEST(Info, OfARealField) {
  NEEDS_SHARED("lung/pair_truth.mha");
  const auto field = info(kShared / "lung/pair_truth.mha");
  EXPECT_EQ(field["kind"], "vectors");
  EXPECT_EQ(field["components"], 3);
  EXPECT_EQ(field["folds"]["folded"], 0);
  // shared/data/README.md: 15.5 mm at most.
  EXPECT_NEAR(field["values"]["high"].get<double>(), 15.5, 0.1);
  EXPECT_THAT(field["use"], AllOf(HasSubstr("palpate check"), HasSubstr("palpate feel")));
}

TEST(Info, OfRealPointsThroughASequence) {
  NEEDS_SHARED("lung/breathing_points.csv");
  const auto points = info(kShared / "lung/breathing_points.csv");
  EXPECT_EQ(points["kind"], "followed points");
  EXPECT_EQ(points["frames"], 8);
  EXPECT_THAT(points["what"], HasSubstr("400 points"));
}

TEST(Info, OfEveryImageOfTheKit) {
  NEEDS_SHARED("kit/tooth_affine/fixed.mha");
  size_t pairs = 0;
  for (const auto& entry : fs::directory_iterator(kShared / "kit")) {
    const fs::path folder = entry.path();
    EXPECT_EQ(info(folder / "fixed.mha")["kind"], "volume") << folder;
    EXPECT_EQ(info(folder / "truth.mha")["kind"], "vectors") << folder;
    EXPECT_EQ(info(folder / "mask.mha")["kind"], "mask") << folder;
    // Image, mask and field together are no sequence.
    const auto all = info(folder);
    EXPECT_EQ(all["kind"], "folder") << folder;
    EXPECT_THAT(all["more"].dump(),
                AllOf(HasSubstr("moving.mha: a volume"), HasSubstr("mask.mha: a mask")));
    EXPECT_THAT(problems(all), Contains(HasSubstr("It is no sequence")));
    ++pairs;
  }
  EXPECT_EQ(pairs, 12U);
}

TEST(Info, OfDicomSlicesAndNiftiFiles) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "slices");
  const Grid grid = files::oblique_grid();
  for (int k = 0; k < grid.size.z; ++k) {
    files::DicomFile file;
    file.grid = grid;
    file.slice = k;
    file.instance = k + 1;
    file.slope = 2.0;
    for (int v = 0; v < grid.size.x * grid.size.y; ++v) file.stored.push_back(100 * k + v);
    files::write_dicom(folder / ("slices/slice" + std::to_string(k) + ".dcm"), file);
  }
  const auto dicom = info(folder / "slices");
  EXPECT_EQ(dicom["kind"], "volume");
  EXPECT_EQ(dicom["format"], "DICOM");
  EXPECT_EQ(dicom["grid"]["size"], nlohmann::json({5, 4, 3}));
  EXPECT_EQ(dicom["values"]["high"], 2.0 * (200 + 19));

  const auto nifti = info(written(small_heart(1).frames[0], folder / "heart.nii.gz"));
  EXPECT_EQ(nifti["kind"], "volume");
  EXPECT_EQ(nifti["format"], "NIfTI, 32-bit numbers, packed");
  // As dcm2niix writes an axial series.
  Volume mirrored = small_heart(1).frames[0];
  mirrored.grid.j_reversed_in_file = true;
  const auto left = info(written(mirrored, folder / "mirrored.nii.gz"));
  EXPECT_EQ(left["axes"], "L-A-S");
  EXPECT_EQ(left["left_handed"], true);
  EXPECT_THAT(problems(left), IsEmpty());
  EXPECT_EQ(nifti["axes"], "L-P-S");
  EXPECT_EQ(nifti["left_handed"], false);
  const auto field = info(written(shell_truth(heart_grid(32), 0, 1), folder / "u.nii.gz"));
  EXPECT_EQ(field["kind"], "vectors");
}

TEST(Info, OfAStudyListsItsSeriesAndEveryCommandChoosesOne) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "study");
  const Sequence heart = small_heart(2);
  int count = 0;
  // Two cines of the same places and frames.
  for (int series = 1; series <= 2; ++series)
    for (int t = 0; t < 2; ++t)
      for (int k = 0; k < heart.frames[0].grid.size.z; ++k) {
        files::DicomFile file;
        file.grid = heart.frames[0].grid;
        file.slice = k;
        file.series = "1.2.3." + std::to_string(series);
        file.series_number = series;
        file.more[0x0008103e] = series == 1 ? "LOrest" : "LOstress";
        file.more[0x00181060] = "DS" + std::to_string(40 * t);
        const auto& values = heart.frames[size_t(t)].values;
        const size_t n = size_t(file.grid.size.x) * size_t(file.grid.size.y);
        for (size_t v = 0; v < n; ++v) file.stored.push_back(int(values[size_t(k) * n + v]));
        files::write_dicom(folder / ("study/" + std::to_string(count++)), file);
      }
  const std::string study = folder / "study";
  const auto all = info(study);
  EXPECT_EQ(all["kind"], "study");
  EXPECT_THAT(all["more"].dump(),
              AllOf(HasSubstr("1 'rest': 2 frames of"), HasSubstr("2 'stress': 2 frames of")));
  const Outcome one = run({"info", study, "--series", "stress"});
  EXPECT_THAT(one.out, AllOf(HasSubstr("a sequence of 2 frames"),
                             HasSubstr("Order     by trigger time (0018,1060)")));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"motion", "-o", folder / "u", "--preset", "fast", "--levels", "1",
                                 "--iterations", "1", "--no-verdict"},
        {"plan"},
        {"view", "--picture", folder / "view.png"}}) {
    std::vector<std::string> words = command;
    words.insert(words.begin() + 1, study);
    const Outcome refused = run(words);
    EXPECT_EQ(refused.exit_code, 2) << command[0];
    EXPECT_THAT(refused.err, HasSubstr("holds 2 sequences"));
    words.insert(words.end(), {"--series", "2"});
    EXPECT_EQ(run(words).exit_code, 0) << command[0];
  }
  const Outcome file = run({"info", study + "/0", "--series", "2"});
  EXPECT_THAT(file.err, HasSubstr("name the folder"));
}

TEST(Info, SaysWhetherSeveralAreOnOneGrid) {
  NEEDS_SHARED("lung/pair_fixed.mha");
  const Outcome same =
      run({"info", kShared / "lung/pair_fixed.mha", kShared / "lung/pair_moving.mha",
           kShared / "lung/pair_body.mha", "--json"});
  ASSERT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.err, HasSubstr("all 3 are on the same grid"));
  for (const auto& grid : same.json()["grids"]) EXPECT_EQ(grid["same_grid"], true);

  const TemporaryFolder folder;
  const Volume heart = small_heart(1).frames[0];
  const std::string here = written(heart, folder / "here.mha");
  const std::string beside = written(shifted(heart, 30.0), folder / "beside.mha");
  const std::string away = written(shifted(heart, 1000.0), folder / "away.mha");
  const Outcome apart = run({"info", here, beside, away, "--json"});
  ASSERT_EQ(apart.exit_code, 0) << apart.err;
  const auto grids = apart.json()["grids"];
  ASSERT_EQ(grids.size(), 2U);
  EXPECT_EQ(grids[0]["same_grid"], false);
  EXPECT_GT(grids[0]["overlap"], 0.3);
  EXPECT_LT(grids[0]["overlap"], 0.6);
  EXPECT_EQ(grids[1]["overlap"], 0.0);
  EXPECT_THAT(apart.err, AllOf(HasSubstr("an origin of"), HasSubstr("do not overlap in space")));
}

TEST(Info, OfWhatPalpateItselfWrites) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart(3);
  written(heart, folder / "heart.seq.nrrd");
  std::ofstream(folder / "scene.json")
      << R"({"volumes": [{"name": "a", "files": "heart.seq.nrrd"}, {"name": "b", "source": "molecule"}],
             "modes": [{"name": "wall", "volume": "a", "strength": 2}]})";
  const auto scene = info(folder / "scene.json");
  EXPECT_EQ(scene["kind"], "scene");
  EXPECT_THAT(scene["more"].dump(), AllOf(HasSubstr("molecule"), HasSubstr("wall")));

  files::StoredCalibration stored;
  stored.calibration.used = 11;
  stored.calibration.all = 12;
  stored.calibration.rms_m = 0.0008;
  stored.device = "simulated device";
  stored.headset = "made headset";
  stored.runtime = "made runtime 1.0";
  ASSERT_TRUE(files::write_calibration(folder / "room.json", stored));
  const auto calibration = info(folder / "room.json");
  EXPECT_EQ(calibration["kind"], "calibration");
  EXPECT_THAT(calibration["more"].dump(), HasSubstr("11 of 12 points agree to 0.8 mm"));

  const Outcome felt = run_computed({"feel", "molecule", "--device", "simulated", "--seconds",
                                     "0.5", "--headset", "off", "--watchdog", "1000", "--record",
                                     folder / "run.rec", "--csv", folder / "run.csv"});
  ASSERT_EQ(felt.exit_code, 0) << felt.err;
  const auto recording = info(folder / "run.rec");
  EXPECT_EQ(recording["kind"], "recording");
  EXPECT_THAT(recording["more"].dump(), AllOf(HasSubstr("molecule"), HasSubstr("Ticks")));
  EXPECT_EQ(info(folder / "run.csv")["kind"], "ticks");

  std::ofstream(folder / "points.csv") << "x,y,z\n1,2,3\n4,5,6\n";
  EXPECT_EQ(info(folder / "points.csv")["kind"], "landmarks");
}

TEST(Info, OfReleasedTubes) {
  const TemporaryFolder folder;
  const std::string file = folder / "tubes.vtk";
  files::VtkLines lines;
  lines.title = "palpate stream tubes, mm";
  lines.points_mm = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {5, 5, 5}, {6, 5, 5}};
  lines.lines = {{0, 1, 2}, {3, 4}};
  ASSERT_TRUE(files::write_vtk_lines(file, lines));
  const auto json = info(file);
  EXPECT_EQ(json["kind"], "tubes");
  EXPECT_EQ(json["more"][0][1], "2 with 5 points");
  lines.title = "somebody's";
  ASSERT_TRUE(files::write_vtk_lines(file, lines));
  EXPECT_EQ(run({"info", file}).exit_code, 2);
}

TEST(Info, OfAFolderOfFieldsAndOfAFolderOfFrames) {
  const TemporaryFolder folder;
  const Sequence heart = small_heart(3);
  fs::create_directory(folder / "fields");
  fs::create_directory(folder / "frames");
  for (int k = 0; k < 3; ++k) {
    const std::string name = std::to_string(k) + "_to_" + std::to_string((k + 1) % 3) + ".mha";
    written(shell_truth(heart.frames[0].grid, k, (k + 1) % 3, 3),
            folder / ("fields/motion_" + name));
    written(heart.frames[size_t(k)], folder / ("fields/confidence_" + name));
    written(heart.frames[size_t(k)], folder / ("frames/frame" + std::to_string(k) + ".mha"));
  }
  const auto fields = info(folder / "fields");
  EXPECT_EQ(fields["kind"], "fields");
  EXPECT_EQ(fields["frames"], 3);
  EXPECT_EQ(fields["folds"]["folded"], 0);
  const auto frames = info(folder / "frames");
  EXPECT_EQ(frames["kind"], "sequence");
  EXPECT_EQ(frames["frames"], 3);
}

TEST(Info, NamesWhatIsSuspicious) {
  const TemporaryFolder folder;
  const Volume heart = small_heart(1).frames[0];
  const auto problems_of = [&](const Volume& volume) {
    return problems(info(written(volume, folder / "suspicious.mha")));
  };
  EXPECT_THAT(problems_of(heart), IsEmpty());

  Volume bad = heart;
  bad.values[bad.grid.offset(3, 4, 5)] = std::numeric_limits<float>::quiet_NaN();
  bad.values[bad.grid.offset(4, 4, 5)] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(problems_of(bad), Contains(AllOf(HasSubstr("2 values that are not finite"),
                                               HasSubstr("voxel (3, 4, 5)"))));
  Volume constant = heart;
  std::fill(constant.values.begin(), constant.values.end(), 7.0F);
  EXPECT_THAT(problems_of(constant), Contains(HasSubstr("the value 7 everywhere")));
  Volume fine = heart;
  fine.grid.spacing_mm = glm::dvec3(1e-4);
  EXPECT_THAT(problems_of(fine), Contains(HasSubstr("is the unit right?")));
  Volume coarse = heart;
  coarse.grid.spacing_mm = glm::dvec3(1000.0);
  EXPECT_THAT(problems_of(coarse), Contains(HasSubstr("is the unit right?")));
  Volume slice = heart;
  slice.grid.size.z = 1;
  slice.values.resize(slice.grid.count());
  EXPECT_THAT(problems_of(slice), Contains(HasSubstr("single slice")));

  Sequence sequence = small_heart(4);
  sequence.frames[2] = sequence.frames[1];
  sequence.times_s = {0.0, 0.1, 0.2, 0.5};
  sequence.times_known = true;
  const auto of_sequence = problems(info(written(sequence, folder / "uneven.seq.nrrd")));
  EXPECT_THAT(of_sequence, Contains(HasSubstr("uneven")));
  EXPECT_THAT(of_sequence, Contains(HasSubstr("Frames 1 and 2 are equal")));

  Field unknown = still_field(heart.grid);
  unknown.u_mm[7].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(
      problems(info(written(unknown, folder / "unknown.mha"))),
      Contains(AllOf(HasSubstr("1 value that is not finite"), HasSubstr("voxel (7, 0, 0)"))));
  Field folded = still_field(heart.grid);
  for (int i = 0; i < heart.grid.size.x; ++i)
    folded.u_mm[heart.grid.offset(i, 5, 5)].x = i % 2 ? 20.0F : -20.0F;
  EXPECT_THAT(problems(info(written(folded, folder / "folded.mha"))),
              Contains(HasSubstr("it folds at")));
  Field far = still_field(heart.grid);
  for (glm::vec3& u : far.u_mm) u.x = 1e5F;
  EXPECT_THAT(problems(info(written(far, folder / "far.mha"))),
              Contains(HasSubstr("further than the volume is large")));
}

TEST(Info, SaysWhatItCanOfTheOthersWhenOneFileIsBad) {
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(1).frames[0], folder / "heart.mha");
  files::write_bytes(folder / "noise.bin", "no header at all, but some text");
  files::write_bytes(folder / "other.json", R"({"colour": 3})");
  const Outcome outcome = run({"info", folder / "absent.mha", heart, folder / "noise.bin",
                               folder / "other.json", "--json"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("absent.mha"), HasSubstr("noise.bin"), HasSubstr("other.json")));
  const auto all = outcome.json()["files"];
  ASSERT_EQ(all.size(), 4U);
  EXPECT_TRUE(all[0].contains("error"));
  EXPECT_EQ(all[1]["kind"], "volume");
  EXPECT_TRUE(all[2].contains("error"));
  EXPECT_THAT(all[3]["error"].get<std::string>(), HasSubstr("neither a scene nor a calibration"));
}

}  // namespace
}  // namespace palpate::app
