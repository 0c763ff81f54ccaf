// Every bad input gets one sentence that names the file, what is wrong and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/itk_images.h"
#include "tests/files/raster/packed.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// One line that names the input and says, after a colon, what to do.
void expect_sentence(const Error& error, const std::filesystem::path& input) {
  EXPECT_THAT(error.message,
              AllOf(HasSubstr(input.filename().string()), HasSubstr(": "), Not(HasSubstr("\n"))));
  EXPECT_THAT(error.message, Not(HasSubstr("itk")));
}

class BadInput : public ::testing::Test {
 protected:
  std::string sequence_error(const std::vector<std::filesystem::path>& inputs, const char* name) {
    const auto found = read_sequence(inputs);
    EXPECT_FALSE(found);
    if (found) return {};
    expect_sentence(found.error(), name);
    EXPECT_TRUE(found.error().kind == ErrorKind::kBadInput ||
                found.error().kind == ErrorKind::kNotFinite ||
                found.error().kind == ErrorKind::kOutOfMemory);
    return found.error().message;
  }
  std::string volume_error(const char* name) {
    const auto found = read_volume(folder_ / name);
    EXPECT_FALSE(found) << name;
    if (found) return {};
    expect_sentence(found.error(), name);
    return found.error().message;
  }
  void write_itk(const char* name, const Volume& volume, bool compressed = false) {
    itk_oracle::write(folder_ / name, {volume},
                      {.type = SampleType::kFloat, .compressed = compressed});
  }
  TemporaryFolder folder_;
};

constexpr const char* kNames[] = {"v.mha", "v.nrrd", "v.nii", "v.nii.gz"};

TEST_F(BadInput, TruncatedFilesAreRefusedWhereverTheyAreCut) {
  for (const char* name : kNames) {
    for (const bool compressed : {false, true}) {
      write_itk(name, known_volume(oblique_grid()), compressed);
      const std::string whole = read_bytes(folder_ / name);
      // Some bytes at the end of gzip data may be missing without effect on the samples, so the cut
      // is before them.
      for (size_t n = 0; n + 12 < whole.size(); n += 7) {
        write_bytes(folder_ / name, whole.substr(0, n));
        const auto found = read_volume(folder_ / name);
        ASSERT_FALSE(found) << name << " cut at " << n;
        expect_sentence(found.error(), name);
      }
    }
  }
}

TEST_F(BadInput, TruncatedDataSaysHowMuchIsMissing) {
  write_itk("v.mha", known_volume(oblique_grid()));
  const std::string whole = read_bytes(folder_ / "v.mha");
  write_bytes(folder_ / "v.mha", whole.substr(0, whole.size() - 100));
  EXPECT_THAT(volume_error("v.mha"),
              AllOf(HasSubstr("promises 240 bytes"), HasSubstr("holds 140 bytes")));
}

TEST_F(BadInput, SizesThatWouldReadTheSameAreWrittenOut) {
  write_bytes(
      folder_ / "v.mha",
      "NDims = 3\nDimSize = 1000 1500 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
          std::string(1'499'999, 'x'));
  EXPECT_THAT(volume_error("v.mha"),
              AllOf(HasSubstr("promises 1500000 bytes"), HasSubstr("holds 1499999 bytes")));
}

TEST_F(BadInput, EmptyFilesAreCalledEmpty) {
  for (const char* name : kNames) {
    write_bytes(folder_ / name, "");
    EXPECT_THAT(volume_error(name), HasSubstr("is empty"));
  }
}

TEST_F(BadInput, DamagedPackingIsRefused) {
  write_bytes(
      folder_ / "v.nrrd",
      "NRRD0004\ntype: float\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: gzip\n\n" +
          std::string("\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03 this is no deflate stream", 37));
  EXPECT_THAT(volume_error("v.nrrd"), HasSubstr("is damaged"));
}

TEST_F(BadInput, AbsurdSizesAreRefusedBeforeAnythingIsAllocated) {
  const std::string body = "endian: little\nencoding: gzip\n\n" + gzip("short");
  for (const char* sizes :
       {"sizes: 100000 100000 100000\n", "sizes: 2000000000 2000000000 2000000000\n",
        "sizes: 4000 4000 4000\n", "sizes: 1e18 1 1\n"}) {
    write_bytes(folder_ / "v.nrrd",
                std::string("NRRD0004\ntype: float\ndimension: 3\n") + sizes + body);
    EXPECT_FALSE(volume_error("v.nrrd").empty()) << sizes;
  }
  write_bytes(folder_ / "v.nrrd",
              "NRRD0004\ntype: float\ndimension: 4\nsizes: 4 4 4 900000000000\n" + body);
  EXPECT_THAT(sequence_error({folder_ / "v.nrrd"}, "v.nrrd"), HasSubstr("damaged"));
  write_bytes(folder_ / "v.mha",
              "NDims = 3\nDimSize = 99999 99999 99999\nElementType = MET_SHORT\nElementDataFile = "
              "LOCAL\nxx");
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("absurd size"));
  write_bytes(
      folder_ / "v.mha",
      "NDims = 4\nDimSize = 2 2 2 800000000\nElementType = MET_SHORT\nElementDataFile = LOCAL\nxx");
  EXPECT_FALSE(volume_error("v.mha").empty());
  write_itk("v.nii", known_volume(straight_grid()));
  std::string bytes = read_bytes(folder_ / "v.nii");
  bytes.replace(42, 6, "\xff\x7f\xff\x7f\xff\x7f");
  write_bytes(folder_ / "v.nii", bytes);
  EXPECT_FALSE(volume_error("v.nii").empty());
}

TEST_F(BadInput, MoreThanTheMemoryHoldsIsRefused) {
  // A sparse file of 1 TB: as long as its header claims, without using disk space.
  const auto path = folder_ / "v.nrrd";
  write_bytes(path,
              "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 10000 10000 10000\nencoding: raw\n\n");
  std::error_code error;
  std::filesystem::resize_file(path, 1'000'000'001'000, error);
  if (error) GTEST_SKIP() << "this file system has no sparse files of 1 TB";
  const auto found = read_volume(path);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::kOutOfMemory);
  EXPECT_THAT(found.error().message, AllOf(HasSubstr("v.nrrd"), HasSubstr("of memory")));
}

TEST_F(BadInput, ValuesThatAreNotFiniteAreCountedAndPlaced) {
  Volume volume = known_volume(straight_grid());
  volume.values[volume.grid.offset(2, 1, 1)] = std::numeric_limits<float>::quiet_NaN();
  volume.values[volume.grid.offset(4, 3, 2)] = -std::numeric_limits<float>::infinity();
  for (const char* name : kNames) {
    write_itk(name, volume);
    EXPECT_THAT(volume_error(name),
                AllOf(HasSubstr("2 values that are not finite"), HasSubstr("voxel (2, 1, 1)")));
  }
  // The reported voxel is that of the file, whatever its axes.
  volume.grid.direction[0] = -volume.grid.direction[0];
  write_itk("v.mha", volume);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("voxel (2, 1, 1)"));
  volume.grid = straight_grid();
  itk_oracle::write(folder_ / "s.mha", {known_volume(straight_grid()), volume},
                    {.type = SampleType::kFloat});
  EXPECT_THAT(sequence_error({folder_ / "s.mha"}, "s.mha"), HasSubstr("in frame 1"));
}

TEST_F(BadInput, FieldsThatAreNotFiniteAreRefused) {
  Field field = known_field(straight_grid());
  field.u_mm[field.grid.offset(3, 2, 1)].y = std::numeric_limits<float>::infinity();
  ASSERT_TRUE(write_field(field, folder_ / "u.nrrd"));
  const auto found = read_field(folder_ / "u.nrrd");
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, AllOf(HasSubstr("1 values"), HasSubstr("voxel (3, 2, 1)")));
}

TEST_F(BadInput, OneFrameIsNoSequence) {
  write_itk("v.mha", known_volume(straight_grid()));
  EXPECT_THAT(sequence_error({folder_ / "v.mha"}, "v.mha"), HasSubstr("one frame only"));
}

TEST_F(BadInput, SeveralFramesAreNoVolume) {
  itk_oracle::write(folder_ / "s.mha",
                    {known_volume(straight_grid()), known_volume(straight_grid())}, {});
  EXPECT_THAT(volume_error("s.mha"), HasSubstr("2 frames"));
}

TEST_F(BadInput, FramesThatDifferAreNamedWithTheDifference) {
  const Grid first = straight_grid();
  Grid size = first, spacing = first, origin = first, direction = first;
  size.size.z = 4;
  spacing.spacing_mm.y = 1.3;
  origin.origin_mm.x += 1.0;
  direction.direction = oblique_grid().direction;
  write_itk("a.mha", known_volume(first));
  const auto refusal = [&](const Grid& grid) {
    write_itk("b.mha", known_volume(grid));
    return sequence_error({folder_ / "a.mha", folder_ / "a.mha", folder_ / "b.mha"}, "b.mha");
  };
  EXPECT_THAT(refusal(size),
              HasSubstr("(frame 2) has a size of 5 x 4 x 4 where frame 0 has 5 x 4 x 3"));
  EXPECT_THAT(refusal(spacing), HasSubstr("a spacing of 0.75 x 1.3 x 2.5 mm"));
  EXPECT_THAT(refusal(origin), HasSubstr("an origin of (-30.5, 12.25, 170.125) mm"));
  EXPECT_THAT(refusal(direction), HasSubstr("a direction of axis 0"));
}

TEST_F(BadInput, ShearedAxesAndBadSpacingsAreRefused) {
  const std::string start = "NDims = 3\nDimSize = 1 1 1\nElementType = MET_UCHAR\n",
                    end = "ElementDataFile = LOCAL\nx";
  write_bytes(folder_ / "v.mha", start + "TransformMatrix = 1 0 0 0.1 1 0 0 0 1\n" + end);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("not perpendicular"));
  write_bytes(folder_ / "v.mha", start + "TransformMatrix = 1 0 0 0 0 0 0 0 1\n" + end);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("axis 1"));
  write_bytes(folder_ / "v.mha", start + "ElementSpacing = 1 0 1\n" + end);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("must be positive"));
  write_bytes(folder_ / "v.mha", start + "Offset = 1 nan 1\n" + end);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("direction that is not finite"));
  write_bytes(folder_ / "v.mha", start + "Offset = 1 1\n" + end);
  EXPECT_THAT(volume_error("v.mha"), HasSubstr("'Offset'"));
}

TEST_F(BadInput, UnknownFormatsAreToldWhatIsKnown) {
  write_bytes(folder_ / "v.png", "\x89PNG\r\n\x1a\n and so on");
  EXPECT_THAT(volume_error("v.png"), AllOf(HasSubstr("NRRD"), HasSubstr("MetaImage"),
                                           HasSubstr("NIfTI"), HasSubstr("DICOM")));
  write_bytes(folder_ / "v.gz", gzip("no picture at all"));
  EXPECT_FALSE(volume_error("v.gz").empty());
}

TEST_F(BadInput, WhatIsNotThereIsSaidToBeMissing) {
  EXPECT_THAT(volume_error("none.mha"), HasSubstr("does not exist"));
  EXPECT_FALSE(read_sequence({}));
  write_bytes(folder_ / "v.mhd",
              "NDims = 3\nDimSize = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = gone.raw\n");
  EXPECT_THAT(volume_error("v.mhd"), HasSubstr("gone.raw"));
}

TEST_F(BadInput, AFolderWithNothingReadableIsSaidToBeSo) {
  std::filesystem::create_directories(folder_ / "empty/below");
  write_bytes(folder_ / "empty/notes.txt", "nothing");
  EXPECT_THAT(sequence_error({folder_ / "empty"}, "empty"),
              HasSubstr("nothing that palpate can read"));
}

}  // namespace
}  // namespace palpate::files
