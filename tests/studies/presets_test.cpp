// Each preset's place on the front, by what is the same on every machine: bytes moved and error.
#include <gtest/gtest.h>

#include "compute/vulkan/context.h"
#include "integration/report/pareto.h"
#include "integration/studies/motion_choice.h"
#include "integration/studies/motion_study.h"

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

TEST(Presets, AreNotBeatenInBothWorkAndErrorByAnotherCarefulSetting) {
  const auto context = vulkan::Context::open({});
  if (!context) GTEST_SKIP() << context.error().message;
  // At the size of a scanner's volume, which the presets are made for.
  const MotionCase heart = heart_case(128);
  std::vector<Place> places;
  for (const MotionSetting& setting : motion_settings(true)) {
    if (!setting.careful) continue;
    const auto result = palpate_method(*context, setting)->run(heart.fixed, heart.moving);
    ASSERT_TRUE(result) << setting.name;
    places.push_back({setting.name,
                      setting.is_preset(),
                      {result->work_bytes, error_mm(result->field, heart)->mean}});
  }
  for (const Place& preset : places) {
    if (!preset.preset) continue;
    for (const Place& other : places)
      EXPECT_FALSE(report::beats(other.costs, preset.costs, kTimeMargin, kErrorMargin))
          << preset.name << " is beaten by " << other.name << "\n"
          << list_of(places);
  }
  RecordProperty("places", list_of(places));
}

}  // namespace
}  // namespace palpate::studies
