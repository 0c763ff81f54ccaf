#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;

class VolumeWriter : public ::testing::TestWithParam<const char*> {
 protected:
  double tolerance() const {
    return std::string(GetParam()).find(".nii") != std::string::npos ? kNiftiToleranceMm
                                                                     : kTextToleranceMm;
  }
};

TEST_P(VolumeWriter, IsReadByItkWithTheSameValuesAndGeometry) {
  const TemporaryFolder folder;
  Volume volume = known_volume(oblique_grid());
  volume.values[5] = -1000.0625f;
  ASSERT_TRUE(write_volume(volume, folder / GetParam()));
  const auto by_itk = itk_oracle::read(folder / GetParam());
  expect_grid(by_itk.grid, volume.grid, tolerance());
  EXPECT_EQ(by_itk.values, volume.values);
  const auto by_us = read_volume(folder / GetParam());
  ASSERT_TRUE(by_us) << by_us.error().message;
  EXPECT_EQ(by_us->values, volume.values);
}

TEST_P(VolumeWriter, WritesMasksThatItkReads) {
  const TemporaryFolder folder;
  Mask mask{oblique_grid(), std::vector<uint8_t>(60)};
  for (size_t v = 0; v < 60; v += 7) mask.values[v] = uint8_t(v + 1);
  ASSERT_TRUE(write_mask(mask, folder / GetParam()));
  const auto by_itk = itk_oracle::read(folder / GetParam());
  const auto by_us = read_mask(folder / GetParam());
  ASSERT_TRUE(by_us) << by_us.error().message;
  for (size_t v = 0; v < 60; ++v) {
    EXPECT_EQ(by_itk.values[v], v % 7 == 0 ? 1.0f : 0.0f) << v;
    EXPECT_EQ(by_us->values[v], v % 7 == 0 ? 1 : 0) << v;
  }
}

TEST_P(VolumeWriter, LeavesOnlyTheFileItself) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_confidence(Confidence{straight_grid(), std::vector<float>(60, 0.5f)},
                               folder / GetParam()));
  EXPECT_EQ(folder.entry_count(), 1u);
  EXPECT_EQ(itk_oracle::read(folder / GetParam()).values, std::vector<float>(60, 0.5f));
}

INSTANTIATE_TEST_SUITE_P(AllFormats, VolumeWriter,
                         ::testing::Values("v.mha", "v.nrrd", "v.nii", "v.nii.gz"));

TEST(VolumeWriterName, MustEndInAKnownFormat) {
  const TemporaryFolder folder;
  const Status written = write_volume(known_volume(straight_grid()), folder / "v.png");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::kBadOutput);
  EXPECT_NE(written.error().message.find(".nii.gz"), std::string::npos);
  EXPECT_EQ(folder.entry_count(), 0u);
  EXPECT_FALSE(check_can_write_image(folder / "v.png"));
  EXPECT_TRUE(check_can_write_image(folder / "v.mha"));
  EXPECT_EQ(folder.entry_count(), 0u);
}

TEST(SequenceWriter, KeepsUnevenTimes) {
  const TemporaryFolder folder;
  Sequence sequence{"s", {}, {0.0, 0.31, 0.5}, true};
  for (size_t k = 0; k < 3; ++k) sequence.frames.push_back(known_volume(oblique_grid(), k));
  ASSERT_TRUE(write_sequence(sequence, folder / "s.seq.nrrd"));
  const auto found = read_sequence({folder / "s.seq.nrrd"});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->times_known);
  EXPECT_THAT(found->times_s, ElementsAre(0.0, 0.31, 0.5));
  expect_grid(found->frames[2].grid, oblique_grid(), kTextToleranceMm);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(found->frames[k].values, sequence.frames[k].values);
}

TEST(SequenceWriter, LeavesTimesUnknownWhereTheyAreOnlyACount) {
  const TemporaryFolder folder;
  Sequence sequence{
      "s", {known_volume(oblique_grid(), 0), known_volume(oblique_grid(), 1)}, {0.0, 1.0}, false};
  ASSERT_TRUE(write_sequence(sequence, folder / "s.seq.nrrd"));
  const auto found = read_sequence({folder / "s.seq.nrrd"});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->times_known);
  EXPECT_THAT(found->times_s, ElementsAre(0.0, 1.0));
  EXPECT_FALSE(write_sequence(sequence, folder / "s.mha"));
}

}  // namespace
}  // namespace palpate::files
