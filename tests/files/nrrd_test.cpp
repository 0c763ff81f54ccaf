// Hand-written files: what Slicer, teem and others write, and ITK does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/packed.h"
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
      "axis mins: -31.5 12.25 170.125\nendian: little\nencoding: raw\n\n" +
          last_.substr(0, 120));
  const auto found = read_volume(folder_ / "v.nrrd");
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, straight_grid(), kTextToleranceMm);
  EXPECT_EQ(found->values, known_volume(straight_grid()).values);
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
      HasSubstr("axes of space"));
  EXPECT_THAT(refusal(replaced(kListLast, "list\n", "vector\n") + "\n" + last_),
              HasSubstr("3 values per voxel"));
}

}  // namespace
}  // namespace palpate::files
