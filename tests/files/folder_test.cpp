#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/frames.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/text.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(FolderOfFiles, IsReadInTheNaturalOrderOfNames) {
  const TemporaryFolder folder;
  for (const size_t k : {0u, 2u, 9u, 10u, 100u}) {
    const std::string name = "frame" + std::to_string(k) + (k == 9 ? ".nrrd" : ".mha");
    ASSERT_TRUE(write_volume(known_volume(oblique_grid(), k), folder / name));
  }
  write_bytes(folder / "notes.txt", "not a frame");
  write_bytes(folder / ".hidden.mha", "not a frame");
  const auto found = read_sequence({folder.path()});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->frames.size(), 5u);
  const size_t order[] = {0, 2, 9, 10, 100};
  for (size_t n = 0; n < 5; ++n)
    EXPECT_EQ(found->frames[n].values, known_volume(oblique_grid(), order[n]).values) << n;
  EXPECT_FALSE(found->times_known);
  EXPECT_THAT(found->times_s, ElementsAre(0, 1, 2, 3, 4));
}

TEST(FolderOfFiles, MayHoldOneFileWithAllFrames) {
  const TemporaryFolder folder;
  const Sequence sequence{
      "s", {known_volume(oblique_grid(), 0), known_volume(oblique_grid(), 1)}, {0.0, 0.4}, true};
  ASSERT_TRUE(write_sequence(sequence, folder / "s.seq.nrrd"));
  const auto found = read_sequence({folder.path()});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_THAT(found->times_s, ElementsAre(0.0, 0.4));
}

/// What was handed out is no longer in memory.
TEST(Pairs, AreReadAgainWhenTheyAreAskedForAgain) {
  const TemporaryFolder folder;
  const Volume first = known_volume(oblique_grid(), 0), second = known_volume(oblique_grid(), 1);
  ASSERT_TRUE(write_volume(first, folder / "a.mha"));
  ASSERT_TRUE(write_volume(second, folder / "b.mha"));
  const auto frames = open_pair(folder / "a.mha", folder / "b.mha");
  ASSERT_TRUE(frames) << frames.error().message;
  for (int time = 0; time < 2; ++time) {
    EXPECT_EQ(frames->read(0)->values, first.values);
    EXPECT_EQ(frames->read(1)->values, second.values);
  }
  std::filesystem::remove(folder / "b.mha");
  EXPECT_TRUE(frames->read(0));
  EXPECT_FALSE(frames->read(1));
}

TEST(Sequences, AreCalledByTheirFileOrFolder) {
  const TemporaryFolder folder;
  const std::filesystem::path cine = folder / "heart_cine", other = folder / "Series.1";
  std::filesystem::create_directories(cine);
  std::filesystem::create_directories(other);
  const auto name = [](const std::vector<std::filesystem::path>& inputs) {
    return sequence_name(inputs);
  };
  EXPECT_EQ(name({cine / "frame_00.mha", cine / "frame_01.mha"}), "heart_cine");
  EXPECT_EQ(name({cine / "frame_00.mha", other / "frame_01.mha"}), "frame_00");
  EXPECT_EQ(name({cine / "frame_00.mha"}), "frame_00");
  EXPECT_EQ(name({cine}), "heart_cine");
  EXPECT_EQ(name({cine / ""}), "heart_cine");
  EXPECT_EQ(name({cine / "." / ""}), "heart_cine");
  EXPECT_EQ(name({other}), "Series.1");
  EXPECT_EQ(name({"breathing.seq.nrrd"}), "breathing");
  EXPECT_EQ(name({"scan.1.nii.gz"}), "scan.1");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(cine);
  EXPECT_EQ(name({"frame_00.mha", "frame_01.mha"}), "heart_cine");
  EXPECT_EQ(name({"."}), "heart_cine");
  std::filesystem::current_path(before);
}

TEST(Sequences, FarAwayOrTooFineAreNamed) {
  Grid usual = oblique_grid();
  EXPECT_TRUE(unusual_place(usual).empty());
  Grid far = usual, fine = usual, coarse = usual;
  far.origin_mm.z += 5e6;
  fine.spacing_mm *= 1e-4;
  coarse.spacing_mm *= 1e3;
  EXPECT_THAT(unusual_place(far), ElementsAre(HasSubstr("from the origin")));
  EXPECT_THAT(unusual_place(fine), ElementsAre(HasSubstr("is finer than")));
  EXPECT_THAT(unusual_place(coarse), ElementsAre(HasSubstr("is coarser than")));
}

TEST(ListOfFiles, IsReadInTheOrderGiven) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_volume(known_volume(oblique_grid(), 1), folder / "b.nii.gz"));
  ASSERT_TRUE(write_volume(known_volume(oblique_grid(), 2), folder / "a.nii.gz"));
  const auto found = read_sequence({folder / "b.nii.gz", folder / "a.nii.gz"});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->frames[0].values, known_volume(oblique_grid(), 1).values);
  EXPECT_EQ(found->frames[1].values, known_volume(oblique_grid(), 2).values);
}

TEST(ListOfFiles, MayNotMixSequencesAndFrames) {
  const TemporaryFolder folder;
  const Sequence sequence{
      "s", {known_volume(oblique_grid(), 0), known_volume(oblique_grid(), 1)}, {0.0, 0.4}, true};
  ASSERT_TRUE(write_sequence(sequence, folder / "s.seq.nrrd"));
  ASSERT_TRUE(write_volume(known_volume(oblique_grid(), 1), folder / "b.mha"));
  const auto found = read_sequence({folder / "b.mha", folder / "s.seq.nrrd"});
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("holds 2 frames itself"));
  const auto mixed = read_sequence({folder.path(), folder / "b.mha"});
  ASSERT_FALSE(mixed);
  EXPECT_THAT(mixed.error().message, HasSubstr("different kinds"));
}

TEST(NaturalOrder, ComparesRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(natural_less("a2", "a10"));
  EXPECT_TRUE(natural_less("a02", "a10b"));
  EXPECT_TRUE(natural_less("a2b3", "a2b20"));
  EXPECT_FALSE(natural_less("a10", "a2"));
  EXPECT_FALSE(natural_less("a10", "a10"));
  EXPECT_TRUE(natural_less("a", "a0"));
  EXPECT_TRUE(natural_less("99999999999999999999998", "99999999999999999999999"));
}

}  // namespace
}  // namespace palpate::files
