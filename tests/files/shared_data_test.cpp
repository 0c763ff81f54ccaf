// The real CT with known motion, if the data are beside the project.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"

namespace palpate::files {
namespace {

class SharedLung : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << "there is no " << folder_;
  }
  const std::filesystem::path folder_ = std::filesystem::path(PALPATE_SHARED_DATA) / "lung";
};

TEST_F(SharedLung, SequenceHasEightFramesHalfASecondApart) {
  const auto found = read_sequence({folder_ / "breathing.seq.nrrd"});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->frames.size(), 8u);
  EXPECT_TRUE(found->times_known);
  EXPECT_THAT(found->times_s, ::testing::ElementsAre(0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5));
  EXPECT_EQ(found->frames[7].grid.size, glm::ivec3(115, 157, 129));
  EXPECT_EQ(found->frames[7].grid.origin_mm, glm::dvec3(-153.827, -150.352, -1434.5));
  EXPECT_EQ(found->frames[7].grid.spacing_mm, glm::dvec3(1.366, 1.366, 2.5));
}

TEST_F(SharedLung, PairIsReadAsItkReadsIt) {
  for (const char* name : {"pair_fixed.mha", "pair_body.mha"}) {
    const auto ours = read_volume(folder_ / name);
    ASSERT_TRUE(ours) << ours.error().message;
    const auto by_itk = itk_oracle::read(folder_ / name);
    expect_grid(ours->grid, by_itk.grid, kTextToleranceMm);
    EXPECT_EQ(ours->values, by_itk.values) << name;
  }
}

TEST_F(SharedLung, TruthIsReadAsItkReadsIt) {
  const auto ours = read_field(folder_ / "pair_truth.mha");
  ASSERT_TRUE(ours) << ours.error().message;
  const auto by_itk = itk_oracle::read(folder_ / "pair_truth.mha");
  size_t different = 0;
  for (size_t v = 0; v < ours->u_mm.size(); ++v) {
    for (int c = 0; c < 3; ++c) different += ours->u_mm[v][c] != by_itk.values[3 * v + size_t(c)];
  }
  EXPECT_EQ(different, 0u);
}

}  // namespace
}  // namespace palpate::files
