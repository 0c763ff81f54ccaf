// Thousands of damaged headers per parser, from a fixed seed: none may crash, hang or give an
// invalid result.
#include <gtest/gtest.h>

#include "integration/files/raster/image_writer.h"
#include "integration/files/read_sequence.h"
#include "integration/files/sequence_motion_file.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/fuzz/parse_bytes.h"
#include "tests/files/itk_images.h"
#include "tests/files/raster/nifti2.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"
#include "tests/support/mutator.h"

namespace palpate::files {
namespace {

constexpr int kRounds = 4000;

/// Texts that parsers of headers treat specially.
const std::vector<std::string> kPieces = {"none",   "-1",   "0",
                                          "1e308",  "nan",  "99999999999999999999",
                                          "(",      ")",    ",",
                                          ":=",     ":",    "=",
                                          "\n",     "%d",   "LIST",
                                          "LOCAL",  "list", "vector",
                                          "domain", "gzip", "\xff\xff\xff\xff",
                                          "\"",     " ",    "-0"};

void run(void (*parse)(std::string_view), const std::vector<std::string>& seeds) {
  test::Mutator mutator(kPieces);
  for (const std::string& seed : seeds) mutator.run(seed, kRounds, parse);
}

ImageToWrite picture(size_t components, size_t frames) {
  ImageToWrite result;
  result.grid = oblique_grid();
  result.components = components;
  result.frames.assign(frames, nullptr);
  for (size_t k = 0; k < frames && frames > 1; ++k) result.times_s.push_back(0.25 * double(k));
  return result;
}

TEST(HeaderFuzz, NrrdParserHolds) {
  run(fuzz::parse_nrrd,
      {nrrd_header_of(picture(1, 1)), nrrd_header_of(picture(3, 1)), nrrd_header_of(picture(1, 4)),
       "NRRD0004\ntype: short\ndimension: 4\nspace: RAS\nsizes: 3 5 4 3\nspacings: nan 1 2 "
       "3\nendian: big\nencoding: gz\n"
       "units: \"ms\" \"mm\" \"mm\" \"mm\"\nMultiVolume.FrameLabels:=1,2,5\nline skip: 2\nbyte "
       "skip: 7\n"
       "data file: a%03d.raw 1 9 2\n",
       "NRRD0005\ntype: float\ndimension: 3\nsizes: 3 5 4\naxis mins: 1 2 3\nencoding: ascii\ndata "
       "file: LIST\na\nb\n"});
}

TEST(HeaderFuzz, SequenceMotionParserHolds) {
  std::vector<std::string> seeds;
  for (const char* keys : {"0 0.25 1|1.5|1", "0 1 2 3|4|0", "0 1 2|0|0"}) {
    const std::string all = keys;
    const size_t first = all.find('|'), second = all.find('|', first + 1);
    ImageToWrite one = picture(3, all.starts_with("0 1 2 3") ? 4 : 3);
    one.times_s.clear();
    one.keys = {{"SequenceMotion.Version", "1"},
                {"SequenceMotion.ReferenceFrame", "1"},
                {"SequenceMotion.FrameTimes_s", all.substr(0, first)},
                {"SequenceMotion.Cycle_s", all.substr(first + 1, second - first - 1)},
                {"SequenceMotion.Harmonics", all.substr(second + 1)},
                {"SequenceMotion.Clock", "frames"},
                {"SequenceMotion.RepeatsFirst", seeds.size() == 1 ? "1" : "0"}};
    seeds.push_back(nrrd_header_of(one));
    ASSERT_TRUE(parse_sequence_motion_header("seed.nrrd", seeds.back())) << keys;
  }
  run(fuzz::parse_sequence_motion, seeds);
}

TEST(HeaderFuzz, MetaImageParserHolds) {
  run(fuzz::parse_meta, {meta_header_of(picture(1, 1)), meta_header_of(picture(3, 1)),
                         "ObjectType = Image\nNDims = 4\nDimSize = 3 4 5 6\nElementSpacing = 1 2 3 "
                         "0.5\nOffset = 1 2 3 4\nTransformMatrix = "
                         "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nHeaderSize = -1\nCompressedData = "
                         "True\nElementType = MET_USHORT\n"
                         "ElementToIntensityFunctionSlope = 2\nElementDataFile = LIST\na\nb\n"});
}

TEST(HeaderFuzz, NiftiParserHolds) {
  std::string four_d = nifti_header_of(picture(1, 1));
  four_d[40] = 4;
  four_d[48] = 6;
  std::string pair = nifti_header_of(picture(3, 1));
  pair.replace(344, 3, "ni1");
  run(fuzz::parse_nifti, {nifti_header_of(picture(1, 1)), nifti_header_of(picture(3, 1)), four_d,
                          pair, nifti2_of(nifti_header_of(picture(3, 1))), nifti2_of(four_d)});
}

TEST(HeaderFuzz, VtkParserHolds) {
  run(fuzz::parse_vtk,
      {"# vtk DataFile Version 3.0\na title\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 4 "
       "5\nASPECT_RATIO 1 2 0.5\nORIGIN -1 2 3\nPOINT_DATA 60\nSCALARS density float "
       "1\nLOOKUP_TABLE default\n"});
}

TEST(HeaderFuzz, DicomParserHolds) {
  const TemporaryFolder folder;
  DicomFile file;
  file.grid = oblique_grid();
  file.stored.assign(20, 7);
  file.more = {{kTagCardiacPhase, "FD30"}, {kTagTriggerTime, "DS120"}};
  write_dicom(folder / "a", file);
  std::vector<std::string> seeds = {read_bytes(folder / "a")};
  EnhancedFile enhanced;
  enhanced.grid = oblique_grid();
  for (int k = 0; k < 3; ++k) {
    enhanced.frames.push_back({k, file.stored, 1.0, 0.0, {}});
    enhanced.frames.back().groups[0x00209111] = {{0x00209128, "UL1"}};
  }
  for (const DicomSyntax syntax :
       {DicomSyntax::kImplicitLittle, DicomSyntax::kExplicitBig, DicomSyntax::kDeflated}) {
    enhanced.syntax = syntax;
    enhanced.open_sequences = !enhanced.open_sequences;
    write_enhanced(folder / "e", enhanced);
    seeds.push_back(read_bytes(folder / "e"));
  }
  run(fuzz::parse_dicom_file, seeds);
}

TEST(HeaderFuzz, DicomReaderHolds) {
  // Behind the parser: places, times and pixels of files whose elements are valid.
  const TemporaryFolder folder;
  EnhancedFile file;
  file.grid = oblique_grid();
  file.grid.size = {20, 16, 3};
  for (int n = 0; n < 6; ++n) {
    file.frames.push_back({n % 3, std::vector<int>(320, 40 * n), 1.0, 0.0, {}});
    file.frames.back().groups[0x00209111] = {
        {0x00189074, n < 3 ? "DT20240101120000.5" : "DT20240101120001.5"}};
  }
  write_enhanced(folder / "plain", file);
  // JPEG, JPEG-LS, JPEG 2000 and run lengths.
  for (const char* syntax : {"", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80",
                             "1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.5"}) {
    const bool packed = *syntax != '\0';
    if (packed) {
      ASSERT_TRUE(itk_oracle::pack_dicom(folder / "plain", folder / "packed", syntax));
    }
    size_t read = 0;
    test::Mutator(kPieces).run(read_bytes(folder / (packed ? "packed" : "plain")), 300,
                               [&](std::string_view bytes) {
                                 write_bytes(folder / "e", bytes);
                                 const auto found = read_sequence({folder / "e"});
                                 EXPECT_TRUE(found || found.error().message.size() > 10);
                                 if (!found) return;
                                 ++read;
                                 for (const Volume& frame : found->frames)
                                   ASSERT_EQ(frame.values.size(), frame.grid.count());
                               });
    // Damage to pixels and names is not detected; most damage to the structure is.
    EXPECT_GT(read, 0U) << syntax;
    EXPECT_LT(read, 290U) << syntax;
  }
}

TEST(HeaderFuzz, LandmarkParserHolds) {
  run(fuzz::parse_points,
      {"# comment\nx,y,z\n1,2,3\n4,5,6\n",
       "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow\n"
       "a,1,2,3,0\nb,4,5,6,0\n"});
}

TEST(HeaderFuzz, FollowedPointsParserHolds) {
  run(fuzz::parse_followed, {"# a way\nx0,y0,z0,x1,y1,z1\n1,2,3,4,5,6\n7,8,9,10,11,12\n",
                             "\xef\xbb\xbfname;z1;y1;x1\na;1;2;3\nb;-4;5e1;6\n"});
}

TEST(HeaderFuzz, SceneReaderHolds) {
  run(fuzz::parse_scene_file,
      {R"({"volumes":[{"name":"a","source":"heart","drive":{"kind":"turn","axis":[0,1,0]}}],)"
       R"("modes":[{"volume":"a","strength":{"window":{"level":5,"width":2,"full":1}},"friction":0.2}]})",
       R"({"stiffness_n_per_m":6e2,"world_from_device":{"quaternion_wxyz":[1,0,0,0],"scale":[1,2,3]},)"
       R"("volumes":[{"name":"b","files":["x","y"],"motions":[{"fields":["f"],"confidences":["c"]}],)"
       R"("transform":{"matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]},"rate":-1,"path":"paper"}],)"
       R"("modes":[{"kind":"follow","strength":{"pairs":[[0,1],[2,3]],"stepped":true},"on":false}]})",
       R"({"volumes":[{"name":"c","source":"charges","box_m":[1,1,1],"charges":[{"position_m":[0,0,1],)"
       R"("strength_v_m":-1,"softness_m":0.01}]},{"name":"d","files":"x","box_m":[1,2,3],"cycle_s":0.8,)"
       R"("drive":{"kind":"keys","poses":[{"pose":{"scale":2},"scale":{"cycle_s":2,"keys":[[0,[1,1,1]],)"
       R"([1,[2,2,2]]]}},{"quaternion_wxyz":{"loop":false,"keys":[[0,[1,0,0,0]],[1,[0.6,0.8,0,0]]]},)"
       R"("translation_m":{"keys":[[0.5,[0,0,0]]]}}]}}],"modes":[{"volume":"d","strength":1}]})"});
}

TEST(HeaderFuzz, CalibrationReaderHolds) {
  run(fuzz::parse_calibration_file,
      {R"({"stage_from_device":{"position_m":[0.31,0.74,-0.55],"quaternion_wxyz":[1,0,0,0]},)"
       R"("space":"local","rms_m":0.001,"used":48,"all":60,"delay_s":0.031,)"
       R"("controller_from_tip_m":[0.01,-0.1,0.02],"device":"Falcon","headset":"h","runtime":"r"})",
       R"({"stage_from_device":{"quaternion_wxyz":[0.5,-0.5,0.5,0.5],"position_m":[1e3,-1e-9,0]}})"});
}

}  // namespace
}  // namespace palpate::files
