// The ticks before and after a trip of the guards, written as a table.
#include "module/haptics/servo/black_box.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "module/haptics/servo/recording.h"

namespace palpate {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

class BlackBoxFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "palpate-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void hear(BlackBox& box, int n, Cause cause) {
    for (int k = 0; k < n; ++k) {
      TickInput input;
      input.now_ns = ++ticks_;
      input.reading.position_m = glm::dvec3(1.0, 2.0, 3.0);
      TickOutput output;
      output.cause = cause;
      output.command.force_n.y = double(ticks_);
      box.hear(input, output);
    }
  }
  static std::vector<std::vector<std::string>> table(const std::filesystem::path& path) {
    std::vector<std::vector<std::string>> rows;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      std::vector<std::string>& row = rows.emplace_back();
      std::istringstream cells(line + ",");
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    }
    return rows;
  }
  static size_t column(const std::vector<std::string>& names, const std::string& name) {
    return size_t(std::find(names.begin(), names.end(), name) - names.begin());
  }

  std::filesystem::path folder_;
  int64_t ticks_ = 0;
};

TEST_F(BlackBoxFile, HoldsAThousandTicksAroundTheTrip) {
  BlackBox box({.folder = folder_});
  hear(box, 5000, Cause::kNone);
  // Tick 5001 trips; 99 ticks follow.
  hear(box, 100, Cause::kTooFast);
  EXPECT_TRUE(box.files().empty()) << "a hundred ticks after the trip have to be in it";
  hear(box, 1, Cause::kNone);
  ASSERT_EQ(box.files().size(), 1u);
  EXPECT_THAT(box.files()[0].filename().string(), testing::EndsWith("-too-fast.csv"));

  const auto rows = table(box.files()[0]);
  ASSERT_EQ(rows.size(), 1001u);
  const auto& names = rows[0];
  for (const auto& row : rows) ASSERT_EQ(row.size(), names.size());
  const size_t now = column(names, "now (ns)"), force = column(names, "force_y (N)"),
               cause = column(names, "cause"), position = column(names, "position_z (m)");
  for (size_t at : {now, force, cause, position}) ASSERT_LT(at, names.size());
  for (int k = 0; k < 1000; ++k) {
    const auto& row = rows[size_t(k) + 1];
    ASSERT_EQ(row[0], std::to_string(k - 899));
    ASSERT_EQ(row[now], std::to_string(5001 + k - 899));
    ASSERT_EQ(row[force], std::to_string(5001 + k - 899));
    ASSERT_EQ(row[position], "3");
    ASSERT_EQ(row[cause], k < 899 || k == 999 ? "none" : "too-fast") << k;
  }
}

TEST_F(BlackBoxFile, IsShorterWhenTheTripComesEarly) {
  BlackBox box({.folder = folder_});
  hear(box, 10, Cause::kNone);
  hear(box, 101, Cause::kLate);
  ASSERT_EQ(box.files().size(), 1u);
  const auto rows = table(box.files()[0]);
  ASSERT_EQ(rows.size(), 112u);
  EXPECT_EQ(rows[1][0], "-10");
  EXPECT_EQ(rows[111][0], "100");
}

TEST_F(BlackBoxFile, IsNotWrittenForAStartAStopOrAFade) {
  BlackBox box({.folder = folder_});
  for (Cause cause :
       {Cause::kStarting, Cause::kDeadMan, Cause::kWorkspaceEdge, Cause::kFirstContact, Cause::kHot,
        Cause::kConfidence, Cause::kSceneEmpty, Cause::kStopped, Cause::kUnseen, Cause::kNone}) {
    hear(box, 300, cause);
  }
  EXPECT_TRUE(box.files().empty());
}

TEST_F(BlackBoxFile, IsNotWrittenForADeviceThatIsMissingFromTheStart) {
  BlackBox box({.folder = folder_});
  hear(box, 2000, Cause::kDevice);
  EXPECT_TRUE(box.files().empty());
  hear(box, 1, Cause::kNone);
  hear(box, 200, Cause::kDevice);
  EXPECT_EQ(box.files().size(), 1u);
}

TEST_F(BlackBoxFile, ComesAtMostOnceInTenSeconds) {
  BlackBox box({.folder = folder_});
  const auto trip_at = [&](int64_t now_ns) {
    // A hundred ticks after the trip the table is due.
    ticks_ = now_ns - 151;
    hear(box, 50, Cause::kNone);
    hear(box, 150, Cause::kEnergy);
  };
  trip_at(5 * kSecond);
  trip_at(6 * kSecond);
  trip_at(15 * kSecond - 1);
  EXPECT_EQ(box.files().size(), 1u);
  EXPECT_EQ(box.skipped(), 2u);
  trip_at(16 * kSecond);
  ASSERT_EQ(box.files().size(), 2u);
  EXPECT_NE(box.files()[0], box.files()[1]);
}

TEST_F(BlackBoxFile, HoldsNoTickTwice) {
  BlackBox box({.folder = folder_, .least_gap_ns = 0});
  for (int trip = 0; trip < 3; ++trip) {
    hear(box, 50, Cause::kNone);
    hear(box, 150, trip == 0 ? Cause::kEnergy : Cause::kLate);
  }
  ASSERT_EQ(box.files().size(), 3u);
  EXPECT_EQ(box.skipped(), 0u);
  EXPECT_THAT(box.files()[0].string(), testing::HasSubstr("-energy"));
  EXPECT_THAT(box.files()[1].string(), testing::HasSubstr("-late"));
  const auto first = table(box.files()[0]), second = table(box.files()[1]);
  ASSERT_EQ(first.size(), 152u);
  ASSERT_EQ(second.size(), 201u);
  const size_t now = column(first[0], "now (ns)");
  EXPECT_EQ(first.back()[now], "151");
  EXPECT_EQ(second[1][now], "152");
}

TEST_F(BlackBoxFile, SaysWhenItCanNotBeWritten) {
  // A file has the name of the folder.
  std::ofstream(folder_ / "none") << "a file";
  BlackBox box({.folder = folder_ / "none"});
  hear(box, 1, Cause::kNone);
  EXPECT_FALSE(box.trouble());
  hear(box, 200, Cause::kClock);
  ASSERT_TRUE(box.trouble());
  EXPECT_THAT(*box.trouble(), testing::HasSubstr("folder that exists"));
  EXPECT_TRUE(box.files().empty());
}

TEST_F(BlackBoxFile, MakesItsFolderWhenThereIsSomethingToKeep) {
  const std::filesystem::path folder = folder_ / "state/palpate";
  BlackBox box({.folder = folder});
  hear(box, 1, Cause::kNone);
  EXPECT_FALSE(std::filesystem::exists(folder)) << "nothing happened";
  hear(box, 200, Cause::kClock);
  ASSERT_EQ(box.files().size(), 1u);
  EXPECT_EQ(box.files()[0].parent_path(), folder);
}

TEST_F(BlackBoxFile, IsWrittenOnARecordersThread) {
  BlackBox box({.folder = folder_});
  TickRecorder recorder({&box});
  for (int k = 0; k < 202; ++k) {
    TickOutput output;
    output.cause = k == 0 ? Cause::kNone : Cause::kClock;
    recorder.hear({}, output);
  }
  EXPECT_TRUE(recorder.finish());
  ASSERT_EQ(box.files().size(), 1u);
  EXPECT_EQ(table(box.files()[0]).size(), 103u);
}

TEST_F(BlackBoxFile, IsWrittenWithoutATripWhereThatIsAsked) {
  BlackBox box({.folder = folder_});
  hear(box, 300, Cause::kNone);
  EXPECT_TRUE(box.files().empty());
  box.write_last("display-lost");
  ASSERT_EQ(box.files().size(), 1u);
  const auto rows = table(box.files()[0]);
  ASSERT_EQ(rows.size(), 301u);
  EXPECT_EQ(rows.back()[0], "0");
}

}  // namespace
}  // namespace palpate
