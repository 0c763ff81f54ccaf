// palpate-lab as a user starts it: refused command lines, and the rows that its commands write.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "compute/vulkan/context.h"
#include "tests/app/program.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::StartsWith;

void expect_refused(const Outcome& result, const std::string& words) {
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, StartsWith("palpate-lab: "));
  EXPECT_THAT(result.err, HasSubstr(words));
}

/// The three files of one run, which must have the same content.
void expect_rows(const TemporaryFolder& folder, const std::string& title, const std::string& key,
                 size_t most_rows) {
  const auto json = nlohmann::json::parse(files::read_bytes(folder / "rows.json"));
  for (const char* about : {"device", "driver", "commit", "date"})
    EXPECT_FALSE(json["conditions"][about].get<std::string>().empty()) << about;
  const auto& tables = json["tables"];
  const auto table = std::find_if(tables.begin(), tables.end(),
                                  [&](const auto& t) { return t["title"] == title; });
  ASSERT_NE(table, tables.end()) << json.dump(2);
  const auto& rows = (*table)["rows"];
  ASSERT_GT(rows.size(), 0U);
  EXPECT_LE(rows.size(), most_rows);
  const double value = rows[0][key].get<double>();
  EXPECT_GT(value, 0.0);
  // The same number, to the last digit, in the long rows of the CSV.
  const std::string csv = files::read_bytes(folder / "rows.csv");
  const std::string begin = "\"" + title + "\",0,\"" + key + "\",";
  ASSERT_THAT(csv, HasSubstr(begin));
  EXPECT_EQ(std::strtod(csv.c_str() + csv.find(begin) + begin.size(), nullptr), value);
  EXPECT_THAT(files::read_bytes(folder / "rows.md"), HasSubstr("## " + title));
}

std::vector<std::string> with_rows(std::vector<std::string> words, const TemporaryFolder& folder) {
  words.insert(words.end(), {"--json", folder / "rows.json", "--csv", folder / "rows.csv",
                             "--markdown", folder / "rows.md"});
  return words;
}

TEST(Lab, RefusesATableThatThereIsNotAndNamesTheNearest) {
  expect_refused(run({"feel", "tiem"}), "'time'");
  expect_refused(run({"motion", "phantom"}), "'phantoms'");
}

TEST(Lab, RefusesAnOutputThatCanNotBeWrittenBeforeItMeasures) {
  const TemporaryFolder folder;
  for (const char* command : {"motion", "anatomies", "sequence", "harmonics", "feel", "view"})
    expect_refused(run({command, "--csv", folder / "absent/rows.csv"}), "absent");
}

TEST(Lab, WritesWhatAHandFeelsAsRows) {
  const TemporaryFolder folder;
  const Outcome result = run(with_rows({"feel", "frame-ends", "--quick"}, folder));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Goals"));
  expect_rows(folder, "Ticks at the ends of graphics frames", "step_n", 3);
}

TEST(Lab, WritesSpeedAndAccuracyOfMotionAsRows) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const TemporaryFolder folder;
  const Outcome result = run(with_rows({"motion", "phantoms", "--quick", "--no-peers"}, folder));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  // Four presets: the heart's wall, the organ and the wall that it slides past.
  expect_rows(folder, "Synthetic pairs: beating heart, organ that slides past a still wall",
              "error_mean_voxels", 12);
}

TEST(Lab, ChoosesForAnAnatomyOnTheOthersWithAPeerBeside) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const TemporaryFolder folder;
  const Outcome result = run(with_rows(
      {"anatomies", "--quick", "--leave-one-out", "--no-large", "--data", folder / ""}, folder));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  expect_rows(folder, "Leaving one anatomy out", "itk_voxels", 2);
}

}  // namespace
}  // namespace palpate::app
