// Each preset's place on the front, by values that are the same on every machine: bytes moved and
// error.
#include <gtest/gtest.h>

#include <filesystem>

#include "compute/vulkan/context.h"
#include "integration/app/choice/motion_front.h"
#include "integration/files/read_volume.h"
#include "tests/lab/report/pareto.h"
#include "tests/lab/studies/motion_study.h"

namespace palpate::studies {
namespace {

struct Place {
  std::string name;
  bool preset = false;
  report::Costs costs;  ///< bytes moved, error in mm
};

std::string list_of(const std::vector<Place>& places) {
  std::string text;
  for (const Place& p : places)
    text += p.name + ": " + std::to_string(1e-9 * p.costs.first) + " GB, " +
            std::to_string(p.costs.second) + " mm\n";
  return text;
}

void expect_none_beaten(const std::shared_ptr<vulkan::Context>& context, const MotionCase& known) {
  std::vector<Place> places;
  for (const app::MotionSetting& setting : app::motion_settings(true)) {
    if (!setting.careful) continue;
    const auto result = palpate_method(context, setting)->run(known.fixed, known.moving);
    ASSERT_TRUE(result) << setting.name;
    places.push_back({setting.name,
                      setting.is_preset(),
                      {result->work_bytes, error_of(result->field, known)->mm.mean}});
  }
  for (const Place& preset : places) {
    if (!preset.preset) continue;
    for (const Place& other : places)
      EXPECT_FALSE(report::beats(other.costs, preset.costs, kTimeMargin, kErrorMargin))
          << preset.name << " is beaten by " << other.name << "\n"
          << list_of(places);
  }
  testing::Test::RecordProperty("places", list_of(places));
}

// At the size of a scanner's volume, for which the presets are made.

TEST(Presets, AreNotBeatenInBothWorkAndErrorByAnotherCarefulSettingOnTheHeart) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  expect_none_beaten(*context, heart_case(128));
}

TEST(Presets, AreNotBeatenInBothWorkAndErrorByAnotherCarefulSettingOnARealChest) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  const std::filesystem::path lung = std::filesystem::path(PALPATE_SHARED_DATA) / "lung";
  const auto fixed = files::read_volume(lung / "pair_fixed.mha");
  if (!fixed) GTEST_SKIP() << "No chest CT: " << fixed.error().message;
  const auto moving = files::read_volume(lung / "pair_moving.mha");
  const auto truth = files::read_field(lung / "pair_truth.mha");
  const auto body = files::read_mask(lung / "pair_body.mha");
  ASSERT_TRUE(moving && truth && body);
  MotionCase chest;
  chest.fixed = *fixed;
  chest.moving = *moving;
  chest.truth = *truth;
  chest.mask = *body;
  expect_none_beaten(*context, chest);
}

}  // namespace
}  // namespace palpate::studies
