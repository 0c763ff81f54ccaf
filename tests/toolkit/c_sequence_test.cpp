// Frames of files through the C library. Oracle: files whose bytes the test has written itself.
#include <gmock/gmock.h>

#include <fstream>

#include "tests/files/temporary_folder.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using files::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CSequence : public ::testing::Test {
 protected:
  void TearDown() override { pal_sequence_close(&sequence_); }

  /// A 4D file of 2 x 2 x 1 voxels and three frames, whose samples are 0, 1, 2, ...: its axes are
  /// -P, L, S, which are left-handed.
  std::string write(const std::string& more = "") {
    const std::string path = folder_ / "sequence.nrrd";
    std::ofstream file(path);
    file << "NRRD0005\ntype: short\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 2 1 3\n"
            "space directions: (0,-2,0) (-3,0,0) (0,0,-4) none\nspace origin: (5,6,7)\n"
            "kinds: domain domain domain time\nencoding: ascii\n"
         << more << "\n0 1 2 3 4 5 6 7 8 9 10 11\n";
    return path;
  }
  PalResult open(const std::string& path) {
    const char* const name = path.c_str();
    PalSequenceInfo info{};
    info.size = sizeof info;
    info.paths = &name;
    info.path_count = 1;
    return pal_sequence_open(&info, &sequence_);
  }
  PalSequence* sequence_ = nullptr;

 private:
  TemporaryFolder folder_;
};

TEST_F(CSequence, GivesTheSamplesAndThePlacesOfTheFile) {
  PAL_ASSERT_OK(open(write()));
  PalSequenceSummary known{};
  known.size = sizeof known;
  PAL_ASSERT_OK(pal_sequence_summary(sequence_, &known));
  EXPECT_EQ(known.frame_count, 3U);
  EXPECT_EQ(known.has_times, 0U);
  EXPECT_THAT(known.grid.size, ElementsAre(2, 2, 1));
  EXPECT_THAT(known.grid.spacing_mm, ElementsAre(2.0, 3.0, 4.0));
  EXPECT_THAT(known.grid.origin_mm, ElementsAre(5.0, 6.0, 7.0));
  EXPECT_THAT(known.grid.direction, ElementsAre(0, -1, 0, -1, 0, 0, 0, 0, -1));
  EXPECT_STREQ(known.notes, "");
  // Also backwards.
  for (const uint32_t k : {0U, 2U, 1U}) {
    std::array<float, 4> samples{};
    double time_s = -1.0;
    PAL_ASSERT_OK(pal_sequence_frame(sequence_, k, samples.data(), &time_s));
    const float first = 4.0F * float(k);
    EXPECT_THAT(samples, ElementsAre(first, first + 1.0F, first + 2.0F, first + 3.0F));
    EXPECT_EQ(time_s, double(k));
  }
  EXPECT_EQ(pal_sequence_frame(sequence_, 3, nullptr, nullptr), PAL_END);
}

TEST_F(CSequence, SaysWhatCanNotBeRead) {
  EXPECT_EQ(open("/nowhere.nrrd"), PAL_BAD_INPUT);
  EXPECT_THAT(pal_last_error(), HasSubstr("/nowhere.nrrd"));
  PalSequenceInfo info{};
  info.size = sizeof info;
  EXPECT_EQ(pal_sequence_open(&info, &sequence_), PAL_BAD_INPUT);
  EXPECT_STREQ(pal_last_error(), "A sequence needs a path");
  EXPECT_EQ(pal_sequence_frame(nullptr, 0, nullptr, nullptr), PAL_BAD_INPUT);
  EXPECT_EQ(pal_sequence_close(nullptr), PAL_OK);
}

}  // namespace
}  // namespace palpate::test
