#include "module/scene/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate {
namespace {

using ::testing::HasSubstr;

TEST(Look, ExtinctionTakesTheOpacityOverAMillimetre) {
  Look look{"", {}, {}, 0.0};
  look.points = {{0.0, {0, 0, 0}, 0.0}, {100.0, {1, 1, 1}, 0.8}};
  for (const double value : {0.0, 10.0, 50.0, 100.0, 200.0}) {
    const double opacity = 0.8 * std::min(value / 100.0, 1.0);
    EXPECT_NEAR(std::exp(-look_at(look, value).extinction_per_mm), 1.0 - opacity, 1e-12) << value;
  }
  EXPECT_EQ(look_at(look, -5.0).extinction_per_mm, 0.0);
  EXPECT_EQ(look_at(look, std::nan("")).extinction_per_mm, 0.0);
  EXPECT_EQ(look_at(Look{}, 1.0).extinction_per_mm, 0.0);
}

TEST(Look, ColoursAreBlendedAsWrittenAndThenMadeLinear) {
  Look look{"", {}, {}, 0.0};
  look.points = {{0.0, {0.2, 0.0, 1.0}, 0.5}, {1.0, {0.6, 0.0, 1.0}, 0.5}};
  EXPECT_NEAR(look_at(look, 0.5).colour.x, linear_from_srgb(0.4), 1e-12);
  EXPECT_NEAR(look_at(look, 0.5).colour.z, 1.0, 1e-12);
  // IEC 61966-2-1: half of the light has the code 0.735.
  EXPECT_NEAR(linear_from_srgb(0.7354), 0.5, 1e-4);
}

TEST(Look, AWindowMovesItsEnds) {
  const Look bone = *preset_look("CT bone");
  const Look moved = windowed(bone, 300.0, 500.0);
  EXPECT_DOUBLE_EQ(level_of(moved), 300.0);
  EXPECT_DOUBLE_EQ(width_of(moved), 500.0);
  EXPECT_EQ(moved.points.front().value, 50.0);
  EXPECT_EQ(moved.points.back().value, 550.0);
  const Look back = windowed(moved, level_of(bone), width_of(bone));
  for (size_t k = 0; k < bone.points.size(); ++k)
    EXPECT_NEAR(back.points[k].value, bone.points[k].value, 1e-9);
  EXPECT_EQ(windowed(bone, 0.0, 0.0), bone);
}

TEST(Look, EveryPresetCanBeDrawnAndHasItsName) {
  for (const std::string& name : preset_names()) {
    const Result<Look> look = preset_look(name);
    ASSERT_TRUE(look) << name;
    EXPECT_EQ(look->name, name);
    EXPECT_TRUE(check(*look)) << name;
  }
  const Result<Look> none = preset_look("CT teeth");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("CT bone"));
}

/// Air, a body with a gradient of values, and a small bright part: `scale` and `shift` are those of
/// the unit.
std::shared_ptr<const FrameData> body_in_air(double scale, double shift) {
  Volume volume;
  volume.grid.size = glm::ivec3(40);
  volume.values.resize(volume.grid.count());
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) {
        const double r = glm::length(glm::dvec3(i, j, k) - 19.5);
        const double value = r < 3.0 ? 900.0 : r < 14.0 ? 200.0 + 4.0 * i : 5.0 * ((i + j + k) % 3);
        volume.values[volume.grid.offset(i, j, k)] = float(scale * value + shift);
      }
  return sampled_scalar(std::move(volume));
}

TEST(Look, DataGetALookThatFitsWhateverTheirUnit) {
  for (const auto& [scale, shift] :
       {std::pair(1.0, 0.0), std::pair(1e-3, 0.0), std::pair(40.0, 7000.0)}) {
    SCOPED_TRACE(testing::Message() << scale << " " << shift);
    const auto frame = body_in_air(scale, shift);
    const ValueSummary values = summary_of(*frame);
    // Between the air's noise and the body.
    EXPECT_GT(values.background, 10.0 * scale + shift);
    EXPECT_LT(values.background, 200.0 * scale + shift);
    EXPECT_NEAR(values.foreground[1], 285.0 * scale + shift, 20.0 * scale);
    EXPECT_NEAR(values.size_mm, 40.0 * std::sqrt(3.0), 2.0);
    const Look look = fitting_look(values);
    EXPECT_TRUE(check(look));
    EXPECT_EQ(look_at(look, 10.0 * scale + shift).extinction_per_mm, 0.0);
    EXPECT_GT(look_at(look, 250.0 * scale + shift).extinction_per_mm, 0.0);
    EXPECT_GT(look_at(look, 900.0 * scale + shift).extinction_per_mm,
              4.0 * look_at(look, 250.0 * scale + shift).extinction_per_mm);
    EXPECT_LT(look.flat_opacity, 0.5);
  }
}

TEST(Look, CtIsKnownByItsUnit) {
  ValueSummary values;
  values.lowest = -1024.0;
  values.highest = 1800.0;
  EXPECT_EQ(fitting_look(values).name, "CT bone");
  values.highest = 300.0;
  EXPECT_EQ(fitting_look(values).name, "CT lung");
}

TEST(Look, WhatHasOneValueOnlyCanBeDrawn) {
  Volume volume;
  volume.grid.size = glm::ivec3(4);
  volume.values.assign(volume.grid.count(), 7.0F);
  EXPECT_TRUE(check(fitting_look(summary_of(*sampled_scalar(volume)))));
}

TEST(Look, PlacesWithoutDataDoNotCount) {
  Volume volume;
  volume.grid.size = glm::ivec3(20);
  volume.values.assign(volume.grid.count(), 0.0F);
  Mask outside{volume.grid, std::vector<uint8_t>(volume.grid.count(), 1)};
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 10; ++i) {
        volume.values[volume.grid.offset(i, j, k)] = float(500 + 10 * j);
        outside.values[volume.grid.offset(i, j, k)] = i > 7;
      }
  const auto frame = sampled_scalar(volume);
  EXPECT_LT(summary_of(*frame).lowest, 100.0);
  EXPECT_GT(summary_of(*frame, &outside).lowest, 400.0);
}

TEST(Look, TakesTransferFunctionsOfTexturesForTheRange) {
  Look texture;
  texture.points = {{0.0, {1, 0, 0}, 0.0}, {0.25, {0, 1, 0}, 0.64}, {1.0, {0, 0, 1}, 0.999}};
  const Look fine = over_range(texture, -100.0, 300.0, 0.5);
  EXPECT_DOUBLE_EQ(fine.points[0].value, -100.0);
  EXPECT_DOUBLE_EQ(fine.points[1].value, 0.0);
  EXPECT_DOUBLE_EQ(fine.points[2].value, 300.0);
  EXPECT_EQ(fine.points[1].colour, texture.points[1].colour);
  // A tenth of the range between neighbouring samples.
  EXPECT_DOUBLE_EQ(fine.surface_slope, 80.0);
  // A sample has its texel's opacity for any thickness, also the most opaque texel's.
  for (const double thickness_mm : {1e-3, 0.25, 0.5, 1.0, 2.0}) {
    const Look look = over_range(texture, -100.0, 300.0, thickness_mm);
    EXPECT_TRUE(check(look)) << thickness_mm;
    for (const LookPoint& point : look.points) {
      const double through = std::exp(-thickness_mm * look_at(look, point.value).extinction_per_mm);
      EXPECT_NEAR(1.0 - through, point.opacity, 1e-12) << thickness_mm;
    }
    EXPECT_EQ(look.points[2].opacity, 0.999) << thickness_mm;
  }
  // All values equal: the points do not rise, and must not fall.
  EXPECT_TRUE(check(over_range(texture, 7.0, 7.0, 1.0)));
}

TEST(Look, RefusesWhatCanNotBeDrawn) {
  const auto message = [](const Look& look) {
    const Status status = check(look);
    return status ? std::string() : status.error().message;
  };
  Look look = *preset_look("MR");
  EXPECT_EQ(message(look), "");
  look.points[1].value = -1e9;
  EXPECT_THAT(message(look), HasSubstr("sort the points"));
  look.points[1].value = std::nan("");
  EXPECT_THAT(message(look), HasSubstr("no finite value"));
  look = *preset_look("MR");
  look.points[2].opacity = 1.0;
  EXPECT_THAT(message(look), HasSubstr("opacity"));
  look = *preset_look("MR");
  look.points[2].colour.y = 1.5;
  EXPECT_THAT(message(look), HasSubstr("colour"));
  look = *preset_look("MR");
  look.shine.diffuse = -1.0;
  EXPECT_THAT(message(look), HasSubstr("shine"));
  for (const double thickness_mm :
       {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    look = *preset_look("MR");
    look.thickness_mm = thickness_mm;
    EXPECT_THAT(message(look), HasSubstr("thickness")) << thickness_mm;
  }
  look = *preset_look("MR");
  look.surface_slope = std::nan("");
  EXPECT_THAT(message(look), HasSubstr("slope"));
}

}  // namespace
}  // namespace palpate
