// Hand-written files: what Slicer, teem and others write, and ITK does not.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "integration/files/raster/image_writer.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/raster/nifti2.h"
#include "tests/files/raster/packed.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;

constexpr size_t kFrames = 3;

/// Samples with the frame as the fastest axis.
std::vector<float> frames_fastest(size_t voxels) {
  std::vector<float> values;
  for (size_t v = 0; v < voxels; ++v) {
    for (size_t k = 0; k < kFrames; ++k) values.push_back(known_value(v, k));
  }
  return values;
}

std::vector<float> frames_slowest(size_t voxels) {
  std::vector<float> values;
  for (size_t k = 0; k < kFrames; ++k) {
    for (size_t v = 0; v < voxels; ++v) values.push_back(known_value(v, k));
  }
  return values;
}

const char* const kListFirst =
    "NRRD0005\n# a comment\ntype: short\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 5 "
    "4 3\n"
    "space directions: none (0.75,0,0) (0,1.25,0) (0,0,2.5)\nkinds: list domain domain "
    "domain\nendian: little\n"
    "encoding: raw\nspace origin: (-31.5,12.25,170.125)\n";
const char* const kListLast =
    "NRRD0005\ntype: short\ndimension: 4\nspace: left-posterior-superior\nsizes: 5 4 3 3\n"
    "space directions: (0.75,0,0) (0,1.25,0) (0,0,2.5) none\nkinds: domain domain domain "
    "list\nendian: little\n"
    "encoding: raw\nspace origin: (-31.5,12.25,170.125)\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

class NrrdReader : public ::testing::Test {
 protected:
  Sequence read(const std::string& bytes) {
    write_bytes(folder_ / "s.seq.nrrd", bytes);
    auto found = read_sequence({folder_ / "s.seq.nrrd"});
    EXPECT_TRUE(found) << found.error().message;
    return found ? *found : Sequence{};
  }
  std::string refusal(const std::string& bytes) {
    write_bytes(folder_ / "s.seq.nrrd", bytes);
    const auto found = read_sequence({folder_ / "s.seq.nrrd"});
    EXPECT_FALSE(found);
    return found ? std::string{} : found.error().message;
  }
  void expect_known(const Sequence& found) {
    ASSERT_EQ(found.frames.size(), kFrames);
    for (size_t k = 0; k < kFrames; ++k) {
      expect_grid(found.frames[k].grid, straight_grid(), kTextToleranceMm);
      EXPECT_EQ(found.frames[k].values, known_volume(straight_grid(), k).values) << k;
    }
  }
  const std::string first_ = bytes_of_values<int16_t>(frames_fastest(60));
  const std::string last_ = bytes_of_values<int16_t>(frames_slowest(60));
  TemporaryFolder folder_;
};

TEST_F(NrrdReader, ReadsSequencesWithTheListAxisFirst) {
  expect_known(read(kListFirst + ("\n" + first_)));
}

TEST_F(NrrdReader, ReadsSequencesWithTheListAxisLast) {
  expect_known(read(kListLast + ("\n" + last_)));
}

TEST_F(NrrdReader, ReadsSequencesWithTheListAxisInTheMiddle) {
  std::vector<float> values;
  for (size_t row = 0; row < 12; ++row) {
    for (size_t k = 0; k < kFrames; ++k) {
      for (size_t i = 0; i < 5; ++i) values.push_back(known_value(row * 5 + i, k));
    }
  }
  std::string header = replaced(kListFirst, "3 5 4 3", "5 3 4 3");
  header = replaced(header, "none (0.75,0,0) (0,1.25,0)", "(0.75,0,0) none (0,1.25,0)");
  header = replaced(header, "list domain domain", "domain list domain");
  expect_known(read(header + "\n" + bytes_of_values<int16_t>(values)));
}

TEST_F(NrrdReader, ReadsGzipInBothLayouts) {
  expect_known(read(replaced(kListFirst, "raw", "gzip") + "\n" + gzip(first_)));
  expect_known(read(replaced(kListLast, "raw", "gzip") + "\n" + gzip(last_)));
}

TEST_F(NrrdReader, ReadsGzipInSeveralMembers) {
  expect_known(read(replaced(kListLast, "raw", "gz") + "\n" + gzip(last_.substr(0, 101)) +
                    gzip(last_.substr(101))));
}

TEST_F(NrrdReader, ReadsGzipWhereverAMemberEnds) {
  // The packed stream is read in pieces of 256 KiB.
  const Grid grid = straight_grid({64, 64, 50});
  const std::string samples = bytes_of_values<int16_t>(known_volume(grid).values);
  const std::string nrrd =
      "NRRD0005\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 64 64 50\n"
      "space directions: (0.75,0,0) (0,1.25,0) (0,0,2.5)\nendian: little\nencoding: gzip\n"
      "space origin: (-31.5,12.25,170.125)\n\n";
  const std::string meta =
      "NDims = 3\nDimSize = 64 64 50\nElementSpacing = 0.75 1.25 2.5\nOffset = -31.5 12.25 "
      "170.125\n"
      "CompressedData = True\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  ImageToWrite picture;
  picture.grid = grid;
  picture.frames = {nullptr};
  std::string nifti = nifti_header_of(picture);
  put<int16_t>(nifti, 70, 4);
  const auto expect_read = [&](const char* name, const std::string& header,
                               const std::string& packed, const std::string& part) {
    constexpr size_t kPiece = 256 * 1024;
    for (const size_t end : {kPiece - 2, kPiece - 1, kPiece, kPiece + 1, 2 * kPiece}) {
      const size_t half = end > kPiece + 1 ? packed.size() - 1000 : 200'000;
      std::string bytes = header;
      if (end > kPiece + 1) bytes += gzip_of_length(packed.substr(0, 200'000), kPiece);
      const size_t from = end > kPiece + 1 ? 200'000 : 0;
      bytes += gzip_of_length(packed.substr(from, half - from), end > kPiece + 1 ? kPiece : end);
      bytes += gzip(packed.substr(half));
      write_bytes(folder_ / name, bytes + part);
      const auto found = read_volume(folder_ / name);
      ASSERT_TRUE(found) << name << ' ' << end << ": " << found.error().message;
      EXPECT_EQ(found->values, known_volume(grid).values) << name << ' ' << end;
    }
  };
  // Zeros behind the last member are padding.
  for (const std::string& behind : {std::string(), std::string(600, '\0')}) {
    expect_read("v.nrrd", nrrd, samples, behind);
    expect_read("v.mha", meta, samples, behind);
    expect_read("v.nii.gz", "", nifti + samples, behind);
  }
}

TEST_F(NrrdReader, ReadsHexadecimalText) {
  std::string text;
  for (const char byte : last_) {
    char digits[4];
    std::snprintf(digits, sizeof digits, text.size() % 3 == 0 ? "%02x" : "%02X", uint8_t(byte));
    text += digits;
    if (text.size() % 7 == 0) text += "\n";
  }
  expect_known(read(replaced(kListLast, "raw", "hex") + "\n" + text));
  EXPECT_THAT(refusal(replaced(kListLast, "raw", "hex") + "\n" + text.replace(20, 1, "g")),
              HasSubstr("hexadecimal"));
  EXPECT_THAT(refusal(replaced(kListLast, "raw", "hex") + "\n" + text.substr(0, 300)),
              HasSubstr("too short"));
}

TEST_F(NrrdReader, ReadsTextAndBigEndianSamples) {
  std::string text;
  for (const float value : frames_slowest(60))
    text += std::to_string(int(value)) + (text.size() % 3 == 0 ? "\n" : "  ");
  expect_known(read(replaced(kListLast, "raw", "ascii") + "\n" + text));
  std::string swapped = last_;
  for (size_t b = 0; b + 1 < swapped.size(); b += 2) std::swap(swapped[b], swapped[b + 1]);
  expect_known(read(replaced(kListLast, "little", "big") + "\n" + swapped));
}

TEST_F(NrrdReader, TrustsDirectionsWhereKindsAreMissing) {
  const std::string without_kinds = replaced(kListFirst, "kinds: list domain domain domain\n", "");
  expect_known(read(without_kinds + "\n" + first_));
}

TEST_F(NrrdReader, TakesFramesInAnyOrderAndAgain) {
  for (const auto& [header, bytes] : {std::pair{kListFirst, first_}, std::pair{kListLast, last_}}) {
    write_bytes(folder_ / "s.seq.nrrd", header + ("\n" + bytes));
    auto reader = SequenceReader::open({folder_ / "s.seq.nrrd"});
    ASSERT_TRUE(reader);
    for (const size_t k : {2u, 0u, 0u, 1u, 2u, 1u}) {
      const auto frame = reader->frame(k);
      ASSERT_TRUE(frame) << frame.error().message;
      EXPECT_EQ(frame->values, known_volume(straight_grid(), k).values) << k;
    }
    EXPECT_FALSE(reader->frame(3));
  }
}

TEST_F(NrrdReader, KeepsUnevenIndexValuesAsTimes) {
  const auto found = read(
      kListFirst + ("axis 0 index type:=numeric\naxis 0 index values:=0 0.3 1.25\n\n" + first_));
  EXPECT_TRUE(found.times_known);
  EXPECT_THAT(found.times_s, ElementsAre(0.0, 0.3, 1.25));
}

TEST_F(NrrdReader, TurnsMillisecondsToSeconds) {
  const auto key =
      read(kListLast + ("axis 3 index unit:=ms\naxis 3 index values:=10 310 1250\n\n" + last_));
  const auto field = read(
      kListLast + ("units: \"\" \"\" \"\" \"ms\"\naxis 3 index values:=10 310 1250\n\n" + last_));
  // 310 * 0.001 is 0.31 to within the last bit.
  EXPECT_THAT(key.times_s, Pointwise(DoubleNear(1e-15), {0.01, 0.31, 1.25}));
  EXPECT_THAT(field.times_s, Pointwise(DoubleNear(1e-15), {0.01, 0.31, 1.25}));
  EXPECT_TRUE(key.times_known && field.times_known);
}

TEST_F(NrrdReader, ReadsTheFrameLabelsOfMultiVolumes) {
  const auto found = read(kListFirst + ("MultiVolume.FrameIdentifyingDICOMTagUnits:=ms\n"
                                        "MultiVolume.FrameLabels:=0,40,90\n\n" +
                                        first_));
  EXPECT_THAT(found.times_s, Pointwise(DoubleNear(1e-15), {0.0, 0.04, 0.09}));
}

TEST_F(NrrdReader, CountsFramesWhereThereAreNoTimes) {
  for (const char* key : {"", "axis 3 index values:=0 1 2\n",
                          "axis 3 index unit:=%\naxis 3 index values:=0 30 60\n"}) {
    const auto found = read(kListLast + (key + ("\n" + last_)));
    EXPECT_FALSE(found.times_known) << key;
    EXPECT_THAT(found.times_s, ElementsAre(0.0, 1.0, 2.0)) << key;
  }
}

TEST_F(NrrdReader, RefusesTimesThatDoNotRise) {
  EXPECT_THAT(refusal(kListLast + ("axis 3 index values:=0 2 1\n\n" + last_)),
              HasSubstr("frame 1 at 2 s but frame 2 at 1 s"));
  EXPECT_THAT(refusal(kListLast + ("axis 3 index values:=0 2\n\n" + last_)),
              HasSubstr("3 frames but 2 index values"));
}

TEST_F(NrrdReader, TurnsRasAndLasToLps) {
  std::string ras = replaced(kListLast, "left-posterior-superior", "right-anterior-superior");
  ras = replaced(ras, "(0.75,0,0) (0,1.25,0)", "(-0.75,0,0) (0,-1.25,0)");
  ras = replaced(ras, "(-31.5,12.25,", "(31.5,-12.25,");
  expect_known(read(ras + "\n" + last_));
  std::string las = replaced(kListLast, "left-posterior-superior", "LAS");
  las = replaced(las, "(0,1.25,0)", "(0,-1.25,0)");
  las = replaced(las, "(-31.5,12.25,", "(-31.5,-12.25,");
  expect_known(read(las + "\n" + last_));
}

TEST_F(NrrdReader, ReadsDetachedDataInOneFileInSeveralAndByPattern) {
  write_bytes(folder_ / "all.raw", "skip this line\nxy" + last_);
  const std::string header = kListLast;
  for (size_t k = 0; k < 3; ++k)
    write_bytes(folder_ / ("part" + std::to_string(k + 8) + ".raw"), last_.substr(k * 120, 120));
  write_bytes(folder_ / "part010.raw", last_.substr(240, 120));
  write_bytes(folder_ / "part008.raw", last_.substr(0, 120));
  write_bytes(folder_ / "part009.raw", last_.substr(120, 120));
  for (const char* data :
       {"data file: all.raw\nline skip: 1\nbyte skip: 2\n", "data file: all.raw\nbyte skip: -1\n",
        "data file: LIST\npart8.raw\npart9.raw\npart10.raw\n", "data file: part%03d.raw 8 10 1\n",
        "datafile: part%d.raw 8 10 1 3\n"}) {
    write_bytes(folder_ / "s.nhdr", header + data);
    auto found = read_sequence({folder_ / "s.nhdr"});
    ASSERT_TRUE(found) << data << found.error().message;
    expect_known(*found);
  }
}

TEST_F(NrrdReader, ReadsSpacingsWithoutDirections) {
  write_bytes(
      folder_ / "v.nrrd",
      "NRRD0001\ntype: unsigned short\ndimension: 3\nsizes: 5 4 3\nspacings: 0.75 1.25 2.5\n"
      "axis mins: -31.5 12.25 170.125\ncenters: node node node\nendian: little\nencoding: raw\n\n" +
          last_.substr(0, 120));
  const auto found = read_volume(folder_ / "v.nrrd");
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, straight_grid(), kTextToleranceMm);
  EXPECT_EQ(found->values, known_volume(straight_grid()).values);
}

TEST_F(NrrdReader, TakesSpacingAndPlaceFromTheRangeOfAnAxisAsTeemDoes) {
  const std::string start = "NRRD0004\ntype: unsigned short\ndimension: 3\nsizes: 5 4 3\n";
  const std::string end = "endian: little\nencoding: raw\n\n" + last_.substr(0, 120);
  // Cells of 0.75, 1.25 and 2.5 mm; the samples are in their middles.
  const char* const cells =
      "axis mins: -31.875 11.625 168.875\naxis maxs: -28.125 16.625 176.375\n";
  const char* const nodes = "axis mins: -31.5 12.25 170.125\naxis maxs: -28.5 16 175.125\n";
  for (const std::string& range :
       {cells + std::string(), cells + std::string("centers: cell cell cell\n"),
        cells + std::string("spacings: 0.75 1.25 2.5\n"),
        nodes + std::string("centers: node node node\n"),
        nodes + std::string("centerings: node node node\n"),
        std::string("axis mins: -3.1875 1.1625 168.875\naxis maxs: -2.8125 1.6625 176.375\n"
                    "units: \"cm\" \"cm\" \"mm\"\n")}) {
    write_bytes(folder_ / "v.nrrd", start + range + end);
    const auto found = read_volume(folder_ / "v.nrrd");
    ASSERT_TRUE(found) << range << found.error().message;
    expect_grid(found->grid, straight_grid(), kTextToleranceMm);
    // ITK knows no units, and takes the place from the range but not the spacing.
    const Grid by_itk = itk_oracle::read(folder_ / "v.nrrd").grid;
    if (range.find("units") == std::string::npos) {
      EXPECT_LT(glm::length(by_itk.origin_mm - straight_grid().origin_mm), kTextToleranceMm);
    }
  }
  // A range that falls runs against the axis.
  write_bytes(folder_ / "v.nrrd", start + "axis mins: 2 0 0\naxis maxs: -3 4 3\n" + end);
  const auto falling = read_volume(folder_ / "v.nrrd");
  ASSERT_TRUE(falling) << falling.error().message;
  EXPECT_TRUE(falling->grid.j_reversed_in_file);
  const Grid stored = as_in_file(falling->grid);
  EXPECT_EQ(stored.lps_from_index({0, 0, 0}), glm::dvec3(1.5, 0.5, 0.5));
  EXPECT_EQ(stored.lps_from_index({4, 0, 0}), glm::dvec3(-2.5, 0.5, 0.5));
}

TEST_F(NrrdReader, TurnsVectorsByTheirMeasurementFrame) {
  const Field field = known_field(straight_grid());
  std::string samples;
  for (const glm::vec3& u : field.u_mm) samples += bytes_of_values<float>({u.x, u.y, u.z});
  const auto header = [&](const char* space, const char* frame) {
    return fmt::format(
        "NRRD0005\ntype: float\ndimension: 4\nspace: {}\nsizes: 3 5 4 3\nspace directions: none "
        "(0.75,0,0) (0,1.25,0) (0,0,2.5)\nkinds: vector domain domain domain\n{}endian: "
        "little\nencoding: raw\nspace origin: (-31.5,12.25,170.125)\n\n",
        space, frame);
  };
  // The vector (1, 2, 3) of the frame's axes in LPS, by the definition of the format: its columns.
  struct MeasuredCase {
    const char* space;
    const char* frame;
    glm::dmat3 lps_from_vector;
  };
  const MeasuredCase cases[] = {
      {"left-posterior-superior", "", glm::dmat3(1.0)},
      {"left-posterior-superior", "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n", glm::dmat3(1.0)},
      {"right-anterior-superior", "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n",
       glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1)},
      {"left-posterior-superior", "measurement frame: (0,1,0) (-1, 0, 0) (0,0,1)\n",
       glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1)},
      {"right-anterior-superior", "measurement frame: (0,0,1) (1,0,0) (0,1,0)\n",
       glm::dmat3(0, 0, 1, -1, 0, 0, 0, -1, 0)}};
  for (const MeasuredCase& one : cases) {
    write_bytes(folder_ / "u.nrrd", header(one.space, one.frame) + samples);
    Notes notes;
    const auto found = read_field(folder_ / "u.nrrd", &notes);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(notes.empty());
    for (size_t v = 0; v < field.u_mm.size(); ++v) {
      const size_t in_file = v;
      const glm::vec3 wanted(one.lps_from_vector * glm::dvec3(field.u_mm[in_file]));
      EXPECT_LT(glm::length(found->u_mm[v] - wanted), 1e-6F) << one.space << one.frame << v;
    }
  }
  // Without a frame the components of another space than LPS are as ITK takes them, and that is
  // said.
  write_bytes(folder_ / "u.nrrd", header("right-anterior-superior", "") + samples);
  Notes notes;
  const auto found = read_field(folder_ / "u.nrrd", &notes);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->u_mm, field.u_mm);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes.front(), HasSubstr("no measurement frame"));
  write_bytes(
      folder_ / "u.nrrd",
      header("left-posterior-superior", "measurement frame: (1,0,0) (1,0,0) (0,0,1)\n") + samples);
  const auto refused = read_field(folder_ / "u.nrrd");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("measurement frame"));
}

TEST_F(NrrdReader, ReadsPicturesOfTwoDimensionsAsSlices) {
  const std::string end = "endian: little\nencoding: raw\n";
  const std::string samples = "\n" + last_.substr(0, 40);
  for (const std::string& place :
       {std::string("spacings: 0.75 1.25\n"),
        std::string(
            "space dimension: 2\nspace directions: (0.75,0) (0,1.25)\nspace origin: (3,4)\n"),
        std::string("space: left-posterior-superior\nspace directions: (0.75,0,0) (0,1.25,0)\n"
                    "space origin: (3,4,5)\n")}) {
    write_bytes(folder_ / "s.nrrd",
                "NRRD0005\ntype: short\ndimension: 2\nsizes: 5 4\n" + place + end + samples);
    const auto found = read_volume(folder_ / "s.nrrd");
    ASSERT_TRUE(found) << place << found.error().message;
    EXPECT_EQ(found->grid.size, glm::ivec3(5, 4, 1));
    EXPECT_EQ(found->grid.spacing_mm, glm::dvec3(0.75, 1.25, 1.25));
    const std::vector<float> known = known_volume(straight_grid()).values;
    EXPECT_EQ(found->values, std::vector<float>(known.begin(), known.begin() + 20));
  }
}

TEST_F(NrrdReader, SaysWhatItDoesNotRead) {
  EXPECT_THAT(refusal(replaced(kListLast, "raw", "bzip2") + "\n" + last_),
              HasSubstr("encoding 'bzip2'"));
  EXPECT_THAT(refusal(replaced(kListLast, "short", "block") + "\n" + last_),
              HasSubstr("type 'block'"));
  EXPECT_THAT(refusal(replaced(kListLast, "endian: little\n", "") + "\n" + last_),
              HasSubstr("byte order"));
  EXPECT_THAT(refusal(replaced(kListLast, "5 4 3 3", "5 4 -3 3") + "\n" + last_),
              HasSubstr("'sizes'"));
  EXPECT_THAT(
      refusal(replaced(kListLast, "domain domain domain list", "domain domain vector list") + "\n" +
              last_),
      HasSubstr("two axes beside space"));
  EXPECT_THAT(
      refusal(replaced(kListLast, "domain domain domain list", "domain vector vector list") + "\n" +
              last_),
      HasSubstr("1 axes of space"));
  EXPECT_THAT(refusal(replaced(kListLast, "list\n", "vector\n") + "\n" + last_),
              HasSubstr("3 values per voxel"));
}

}  // namespace
}  // namespace palpate::files
