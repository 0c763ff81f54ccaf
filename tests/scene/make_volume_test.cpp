#include "module/scene/make_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <sstream>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "tests/support/fields.h"

namespace palpate {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kMadeFrames = 3;

VolumeSpec some_spec() {
  VolumeSpec spec;
  spec.name = "lung";
  spec.motions = {{"data", {}, {}}};
  return spec;
}

VolumeData some_data() {
  const Grid grid = test::oblique_grid();
  VolumeData data;
  data.motions.resize(1);
  for (int k = 0; k < kMadeFrames; ++k) {
    data.frames.frames.push_back({grid, std::vector<float>(grid.count(), float(k))});
    data.motions[0].fields.push_back(test::linear_field(grid, {k, 0, 0}, glm::dmat3(0.1)));
    data.motions[0].confidences.push_back({grid, std::vector<float>(grid.count(), 0.5F)});
  }
  data.frames.times_s = {2.0, 2.25, 2.5};
  data.frames.times_known = true;
  return data;
}

TEST(MakeVolume, FillsSegmentsWithWhatTheyEnclose) {
  // Muscle around blood around a valve, and a plate that lies against a third of the muscle.
  Grid grid;
  grid.size = glm::ivec3(40);
  const auto mask_of = [&](const auto& is_inside) {
    Mask mask{grid, {}};
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i) mask.values.push_back(is_inside(glm::dvec3(i, j, k) - 19.5));
    return mask;
  };
  const auto between = [](double low, double high) {
    return [=](glm::dvec3 x) { return glm::length(x) >= low && glm::length(x) < high; };
  };
  for (const bool one_body : {true, false}) {
    VolumeData data;
    data.frames.frames.assign(1, {grid, std::vector<float>(grid.count(), 1.0F)});
    data.frames.times_s = {0.0};
    const glm::vec3 white(1.0F);
    data.segments = {{"valve", white, true, {mask_of(between(0.0, 3.0))}},
                     {"muscle", white, true, {mask_of(between(9.0, 14.0))}},
                     {"blood", white, true, {mask_of(between(3.0, 9.0))}},
                     {"plate", white, true, {mask_of([](glm::dvec3 x) {
                        return glm::length(x) >= 14.0 && x.x > 10.0 && x.x < 13.0;
                      })}}};
    VolumeSpec spec;
    spec.name = "heart";
    spec.segments.one_body = one_body;
    const auto volume = build(spec, std::move(data));
    ASSERT_TRUE(volume) << volume.error().message;
    const auto at_mm = [&](size_t segment, double away_mm) {
      return volume->segments[segment].distance_mm.front()->scalar(
          volume_from_lps(glm::dvec3(19.5, 19.5 + away_mm, 19.5)));
    };
    if (one_body) {
      EXPECT_GT(at_mm(1, 6.0), 6.0);  // the muscle is all of the heart
      EXPECT_GT(at_mm(1, 0.0), 10.0);
      EXPECT_GT(at_mm(2, 0.0), 5.0);  // the blood has the valve in it
    } else {
      EXPECT_LT(at_mm(1, 6.0), -2.0);
      EXPECT_LT(at_mm(2, 0.0), -0.5);
    }
    EXPECT_NEAR(at_mm(1, 14.0), 0.0, 0.6);
    EXPECT_NEAR(at_mm(0, 3.0), 0.0, 0.6);
    EXPECT_LT(at_mm(3, 6.0), 0.0);
    // The muscle does not contain what only lies against it.
    EXPECT_LT(volume->segments[1].distance_mm.front()->scalar(
                  volume_from_lps(glm::dvec3(31.0, 31.5, 19.5))),
              0.0);
  }
}

TEST(MakeVolume, MakesSmoothDistancesOfSegmentsAndSaysWhatIsWrongWithThem) {
  const auto built = [](size_t masks, const std::function<void(SegmentData&)>& change) {
    VolumeData data = some_data();
    SegmentData segment{"pool", {1.0F, 0.0F, 0.0F}, true, {}};
    for (size_t k = 0; k < masks; ++k) {
      Mask mask{test::oblique_grid(), {}};
      mask.values.assign(mask.grid.count(), 1);
      segment.masks.push_back(std::move(mask));
    }
    if (change) change(segment);
    data.segments.push_back(std::move(segment));
    VolumeSpec spec = some_spec();
    spec.segments.frame = 1;
    return build(spec, std::move(data));
  };
  const auto one = built(1, {});
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->segments_frame, 1U);
  EXPECT_EQ(one->segments[0].distance_mm.size(), 1U);
  const glm::dvec3 there = volume_from_lps(
      test::oblique_grid().lps_from_index(0.5 * glm::dvec3(test::oblique_grid().size - 1)));
  EXPECT_GT(one->segments[0].distance_mm[0]->scalar(there), 0.0);
  const auto all = built(3, {});
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(all->segments[0].distance_mm.size(), 3U);
  const auto refusal = [&](size_t masks, const std::function<void(SegmentData&)>& change) {
    const auto volume = built(masks, change);
    EXPECT_FALSE(volume);
    return volume ? std::string() : volume.error().message;
  };
  EXPECT_THAT(refusal(2, {}), HasSubstr("has 2 label maps for 3 frames"));
  EXPECT_THAT(refusal(1, [](SegmentData& s) { s.masks[0].grid.origin_mm.x += 1e4; }),
              HasSubstr("\"pool\" lies somewhere else in space"));
  EXPECT_THAT(refusal(1,
                      [](SegmentData& s) {
                        std::fill_n(s.masks[0].values.begin(), s.masks[0].values.size(), 0);
                      }),
              HasSubstr("has no voxel"));
}

TEST(MakeVolume, KeepsFramesFieldsAndTimesTogether) {
  const auto volume = build(some_spec(), some_data());
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->name, "lung");
  EXPECT_THAT(volume->times.times_s, ElementsAre(0.0, 0.25, 0.5));
  EXPECT_DOUBLE_EQ(volume->times.cycle_s, 0.75);
  ASSERT_EQ(volume->frames.size(), 3U);
  const Grid grid = test::oblique_grid();
  const glm::dvec3 middle = volume_from_lps(grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1)));
  for (int k = 0; k < kMadeFrames; ++k) {
    // The spline's weights add up to one in floats.
    EXPECT_NEAR(volume->frames[size_t(k)]->scalar(middle), double(k), 1e-6);
    const MotionSample at = volume->motions[0].steps[size_t(k)]->sample(middle);
    EXPECT_NEAR(at.u_m.x, 1e-3 * k, 1e-9);
    EXPECT_EQ(at.confidence, 0.5);
  }
}

TEST(MakeVolume, EndsAtItsLastFrameWhenItDoesNotRepeat) {
  VolumeSpec spec = some_spec();
  spec.cyclic = false;
  spec.frames_per_second = 10.0;
  VolumeData data = some_data();
  data.motions[0].fields.pop_back();
  data.motions[0].confidences.clear();
  const auto volume = build(spec, std::move(data));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_THAT(volume->times.times_s, ElementsAre(0.0, 0.1, 0.2));
  EXPECT_EQ(volume->times.cycle_s, 0.0);
  EXPECT_EQ(volume->times.steps(), 2);
}

/// Nobody knows the times: a cycle as long as a heart beat, but no film faster than 30 frames a
/// second. What is known or asked for is never changed.
TEST(MakeVolume, AssumesTimesOnlyWhereThereAreNone) {
  for (const auto& [frames, length_s] :
       {std::pair(size_t{2}, 1.0), std::pair(size_t{20}, 1.0), std::pair(size_t{30}, 1.0),
        std::pair(size_t{60}, 2.0), std::pair(size_t{300}, 10.0)}) {
    const std::vector<double> times = assumed_times(frames);
    ASSERT_EQ(times.size(), frames);
    EXPECT_EQ(times.front(), 0.0);
    EXPECT_NEAR(cycle_of(times), length_s, 1e-9) << frames;
    EXPECT_TRUE(are_assumed_times(times));
  }
  VolumeData none = some_data();
  none.frames.times_s.clear();
  const auto assumed = build(some_spec(), none);
  ASSERT_TRUE(assumed) << assumed.error().message;
  EXPECT_TRUE(assumed->times.assumed);
  EXPECT_NEAR(assumed->times.cycle_s, 1.0, 1e-9);
  EXPECT_FALSE(build(some_spec(), some_data())->times.assumed);
  VolumeSpec asked = some_spec();
  asked.frames_per_second = 4.0;
  const auto paced = build(asked, none);
  EXPECT_FALSE(paced->times.assumed);
  EXPECT_THAT(paced->times.times_s, ElementsAre(0.0, 0.25, 0.5));
  asked.frames_per_second = 0.0;
  asked.cycle_s = 6.0;
  const auto long_cycle = build(asked, none);
  EXPECT_FALSE(long_cycle->times.assumed);
  EXPECT_NEAR(long_cycle->times.cycle_s, 6.0, 1e-9);
}

VolumeData whole_data() {
  VolumeData data = some_data();
  data.motions.clear();
  data.frames.frames.erase(data.frames.frames.begin(), data.frames.frames.begin() + 2);
  data.whole = SequenceMotion{2, {{0.0, 0.25, 0.75}, 1.0, 0}, {}};
  for (int k = 0; k < kMadeFrames; ++k)
    data.whole->terms.push_back(
        test::linear_field(test::oblique_grid(), {2 - k, 0, 0}, glm::dmat3(0.0)));
  return data;
}

TEST(MakeVolume, OfOneMotionKeepsTheReferenceFrameAndTheMotionsTimes) {
  const auto volume = build(some_spec(), whole_data());
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_TRUE(volume->whole);
  EXPECT_EQ(volume->frames.size(), 1U);
  EXPECT_TRUE(volume->motions.empty());
  EXPECT_FALSE(volume->is_still());
  EXPECT_EQ(volume->whole->reference(), 2U);
  EXPECT_THAT(volume->times.times_s, ElementsAre(0.0, 0.25, 0.75));
  EXPECT_DOUBLE_EQ(volume->times.cycle_s, 1.0);
  const Grid grid = test::oblique_grid();
  const glm::dvec3 middle = volume_from_lps(grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1)));
  EXPECT_NEAR(volume->frames[0]->scalar(middle), 2.0, 1e-6);
  // The same motion at another rate, with the same uneven times.
  VolumeSpec fast = some_spec();
  fast.frames_per_second = 8.0;
  const auto quick = build(fast, whole_data());
  ASSERT_TRUE(quick) << quick.error().message;
  EXPECT_NEAR(quick->times.times_s[1], 0.25 / 3.0, 1e-12);
  EXPECT_NEAR(quick->times.times_s[2], 0.25, 1e-12);
  EXPECT_NEAR(quick->times.cycle_s, 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(quick->whole->displacement(middle, quick->whole->basis().at(0.0)).x, 2e-3, 1e-8);
}

TEST(MakeVolume, OfOneMotionCarriesASegmentationToo) {
  VolumeData data = whole_data();
  Mask mask{test::oblique_grid(), std::vector<uint8_t>(test::oblique_grid().count(), 0)};
  mask.values[mask.values.size() / 2] = 1;
  data.segments.emplace_back();
  data.segments.back().name = "ventricle";
  data.segments.back().masks = {mask};
  const auto volume = build(some_spec(), std::move(data));
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_EQ(volume->segments.size(), 1U);
  EXPECT_EQ(volume->segments[0].name, "ventricle");
  EXPECT_EQ(volume->segments[0].distance_mm.size(), 1U);
}

TEST(MakeVolume, OfOneMotionRefusesWhatDoesNotFit) {
  VolumeData two_frames = whole_data();
  two_frames.frames.frames.push_back(two_frames.frames.frames.front());
  VolumeData no_terms = whole_data();
  no_terms.whole->terms.pop_back();
  VolumeData elsewhere = whole_data();
  for (Field& term : elsewhere.whole->terms) term.grid.origin_mm += glm::dvec3(5e3);
  for (VolumeData* data : {&two_frames, &no_terms, &elsewhere}) {
    const auto volume = build(some_spec(), std::move(*data));
    ASSERT_FALSE(volume);
    EXPECT_THAT(volume.error().message, HasSubstr("lung"));
  }
}

TEST(MakeVolume, LetsFieldsComeLater) {
  VolumeData data = some_data();
  data.motions[0].fields[1] = Field{};
  const auto volume = build(some_spec(), std::move(data));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_NE(volume->motions[0].steps[0], nullptr);
  EXPECT_EQ(volume->motions[0].steps[1], nullptr);
}

TEST(MakeVolume, TakesVectors) {
  const Grid grid = test::oblique_grid();
  VolumeSpec spec = some_spec();
  spec.motions.clear();
  VolumeData data;
  data.vectors = {{grid, std::vector<glm::vec3>(grid.count(), glm::vec3(1, 2, 3))}};
  const auto volume = build(spec, std::move(data));
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_TRUE(volume->frames[0]->is_vector());
  EXPECT_TRUE(volume->is_still());
  EXPECT_FALSE(volume->times.cyclic());
  EXPECT_LT(glm::length(volume->frames[0]->vector(glm::dvec3(0.0)) - glm::dvec3(1, 3, -2)), 1e-12);
}

TEST(MakeVolume, RefusesWhatDoesNotBelongTogetherWithTheReason) {
  struct Case {
    std::function<void(VolumeSpec&, VolumeData&)> spoil;
    std::string says;
  };
  const std::vector<Case> cases{
      {[](VolumeSpec&, VolumeData& d) { d.frames.frames.clear(); }, "no frames were read"},
      {[](VolumeSpec&, VolumeData& d) { d.frames.frames[1].values.pop_back(); }, "frame 1 has no"},
      {[](VolumeSpec&, VolumeData& d) { d.frames.frames[2] = Volume{}; }, "frame 2 has no"},
      {[](VolumeSpec&, VolumeData& d) { d.frames.frames[0].grid.spacing_mm.y = 0.0; }, "frame 0"},
      {[](VolumeSpec&, VolumeData& d) {
         d.vectors.push_back({Grid{{1, 1, 1}}, {{}}});
       },
       "one kind"},
      {[](VolumeSpec&, VolumeData& d) { d.motions[0].fields[1].u_mm.pop_back(); },
       "field 1 of its motion \"data\" has more or fewer"},
      {[](VolumeSpec&, VolumeData& d) { d.motions[0].fields[2].grid.origin_mm.z += 500.0; },
       "field 2 of its motion \"data\" lies somewhere else"},
      {[](VolumeSpec&, VolumeData& d) { d.motions[0].confidences.pop_back(); }, "2 confidences"},
      {[](VolumeSpec&, VolumeData& d) { d.motions[0].confidences[0].values.pop_back(); },
       "field 0 of its motion \"data\" has a confidence"},
      {[](VolumeSpec&, VolumeData& d) {
         d.motions[0].fields.pop_back();
         d.motions[0].confidences.pop_back();
       },
       "2 fields, but there are 3"},
      {[](VolumeSpec& s, VolumeData&) { s.cyclic = false; }, "3 fields, but there are 2"},
      {[](VolumeSpec& s, VolumeData&) { s.motions.clear(); }, "names 0 motions but 1"},
      {[](VolumeSpec&, VolumeData& d) { d.frames.times_s[1] = 9.0; }, "frame 2 is not later"},
      {[](VolumeSpec& s, VolumeData&) {
         s.frames_per_second = std::numeric_limits<double>::quiet_NaN();
       },
       "frames per second"}};
  for (const Case& one : cases) {
    VolumeSpec spec = some_spec();
    VolumeData data = some_data();
    one.spoil(spec, data);
    const auto volume = build(spec, std::move(data));
    ASSERT_FALSE(volume) << one.says;
    EXPECT_EQ(volume.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(volume.error().message, HasSubstr("\"lung\""));
    EXPECT_THAT(volume.error().message, HasSubstr(one.says));
  }
}

TEST(MakeVolume, MakesTheBeatingShellWithItsTrueMotion) {
  VolumeSpec spec;
  spec.name = "shell";
  for (const std::string source : {"shell", "shell-exact"}) {
    spec.source = source;
    const auto volume = build(spec);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->frames.size(), 4U);
    EXPECT_DOUBLE_EQ(volume->times.cycle_s, 1.0);
    test::Random random(1);
    for (int draw = 0; draw < 200; ++draw) {
      const int frame = draw % 4;
      const glm::dvec3 x = random.vector(0.03);
      const glm::dvec3 lps = lps_from_volume(x);
      const glm::dvec3 there = volume_from_lps(shell_point(lps, frame, frame + 1));
      // b'' is at most 2e-3 per mm of 42 mm / 59 mm^2: trilinear interpolation at 1 mm has an error
      // of h^2 / 8 of it on each axis.
      const glm::dvec3 u = volume->motions[0].steps[size_t(frame)]->displacement(x);
      EXPECT_LT(glm::length(x + u - there), 2e-5) << source << " draw " << draw;
      // The wall's texture has structures of 4 mm, sampled at 1 mm; edges are 1.5 mm wide.
      if (source == "shell-exact") {
        EXPECT_EQ(volume->frames[size_t(frame)]->scalar(x), shell_value(lps, frame));
      } else {
        EXPECT_NEAR(volume->frames[size_t(frame)]->scalar(x), shell_value(lps, frame), 250.0);
      }
    }
    EXPECT_EQ(volume->motions[0].steps[0]->folded_cells(), 0U);
  }
}

TEST(MakeVolume, MakesTheBeatingHeartWithItsTrueMotion) {
  VolumeSpec spec;
  spec.name = "heart";
  for (const std::string source : {"heart", "heart-exact"}) {
    spec.source = source;
    const auto volume = build(spec);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->frames.size(), size_t(kHeartFrames));
    EXPECT_DOUBLE_EQ(volume->times.cycle_s, 1.0);
    test::Random random(1);
    for (int draw = 0; draw < 400; ++draw) {
      const int frame = draw % kHeartFrames;
      const glm::dvec3 x = random.vector(0.05);
      const glm::dvec3 lps = lps_from_volume(x);
      const glm::dvec3 there = volume_from_lps(heart_point(lps, frame, frame + 1));
      // Trilinear at 2 mm: the second derivatives of a step are at most 0.05 per mm in sum; the
      // error is half the square of a cell times that.
      const glm::dvec3 u = volume->motions[0].steps[size_t(frame)]->displacement(x);
      EXPECT_LT(glm::length(x + u - there), 5e-5) << source << " draw " << draw;
      if (source == "heart-exact") {
        EXPECT_EQ(volume->frames[size_t(frame)]->scalar(x), heart_value(lps, frame));
      }
    }
    for (const auto& step : volume->motions[0].steps) {
      EXPECT_EQ(step->folded_cells(), 0U);
      EXPECT_LT(step->worst_contraction(), 0.7);
    }
  }
}

TEST(MakeVolume, MakesTheMoleculeAndRefusesUnknownNames) {
  VolumeSpec spec;
  spec.name = "x";
  spec.source = "molecule";
  const auto molecule = build(spec);
  ASSERT_TRUE(molecule);
  EXPECT_TRUE(molecule->is_still());
  spec.source = "liver";
  const auto unknown = build(spec);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("\"liver\""));
  spec.source = "heart";
  spec.frames_per_second = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(build(spec));
}

TEST(MakeVolume, FillsABoxWithTheGridsAxes) {
  VolumeSpec spec = some_spec();
  spec.box_m = glm::dvec3(0.2, 0.3, 0.4);
  spec.transform.translation_m = {0.1, 0.2, 0.3};
  spec.transform.rotation = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1, 2, 3)));
  // Along the patient's axes: i along L, j along P, k along S.
  VolumeData data = some_data();
  for (Volume& frame : data.frames.frames) frame.grid.direction = glm::dmat3(1.0);
  const Grid grid = data.frames.frames[0].grid;
  const auto volume = build(spec, std::move(data));
  ASSERT_TRUE(volume) << volume.error().message;
  const auto placed = start_transform(spec, *volume);
  ASSERT_TRUE(placed) << placed.error().message;
  const glm::dvec3 half = 0.5 * *spec.box_m;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 end(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(end * glm::dvec3(grid.size) - 0.5));
    const glm::dvec3 there = spec.transform.world_from_volume((2.0 * end - 1.0) * half);
    EXPECT_LT(glm::length(placed->world_from_volume(x) - there), 1e-12) << corner;
  }
  // The same place, given by a box again.
  VolumeSpec again = some_spec();
  ASSERT_TRUE(place_by_box(again, *volume, *placed));
  EXPECT_LT(glm::length(*again.box_m - *spec.box_m), 1e-12);
  EXPECT_LT(glm::length(again.transform.translation_m - spec.transform.translation_m), 1e-12);
  EXPECT_GT(std::abs(glm::dot(again.transform.rotation, spec.transform.rotation)), 1.0 - 1e-12);
}

TEST(MakeVolume, RefusesABoxThatWouldShear) {
  VolumeSpec spec = some_spec();
  // Oblique.
  const auto volume = build(spec, some_data());
  ASSERT_TRUE(volume);
  spec.transform.scale = {1.0, 2.0, 0.5};
  spec.box_m = glm::dvec3(0.2, 0.3, 0.4);
  const auto placed = start_transform(spec, *volume);
  ASSERT_FALSE(placed);
  EXPECT_THAT(placed.error().message, HasSubstr("obliquely"));
  // In true proportions any rotation is allowed.
  const Grid grid = test::oblique_grid();
  spec.transform.scale = glm::dvec3(1.0);
  spec.box_m = 3e-3 * grid.spacing_mm * glm::dvec3(grid.size);
  EXPECT_TRUE(start_transform(spec, *volume));
}

TEST(MakeVolume, FitsAnObliqueGridIntoABoxOfThreeDigits) {
  const Grid grid = test::oblique_grid();
  const glm::dvec3 size = 1e-3 * grid.spacing_mm * glm::dvec3(grid.size);
  const auto volume = build(some_spec(), some_data());
  ASSERT_TRUE(volume);
  std::mt19937 random(29);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto three_digits = [](double x) {
    const double step = std::pow(10.0, std::floor(std::log10(x)) - 2.0);
    return std::round(x / step) * step;
  };
  const auto refusal_of = [&](const VolumeSpec& spec) {
    const auto placed = start_transform(spec, *volume);
    return placed ? std::string() : placed.error().message;
  };
  // The middle of the box is the middle of the data, and the data keep their shape.
  const auto expect_placed = [&](const VolumeSpec& spec, double scale, double off) {
    const auto placed = start_transform(spec, *volume);
    ASSERT_TRUE(placed) << placed.error().message;
    EXPECT_NEAR(placed->scale.x, scale, off * scale);
    EXPECT_NEAR(placed->scale.y, placed->scale.x, 1e-9 * scale);
    EXPECT_NEAR(placed->scale.z, placed->scale.x, 1e-9 * scale);
    const glm::dvec3 middle =
        volume_from_lps(grid.lps_from_index(0.5 * glm::dvec3(grid.size) - 0.5));
    EXPECT_LT(glm::length(placed->world_from_volume(middle) - spec.transform.translation_m), 1e-9);
  };
  for (int k = 0; k < 200; ++k) {
    VolumeSpec spec = some_spec();
    spec.transform.translation_m = {0.1, share(random), 0.0};
    spec.transform.rotation = glm::angleAxis(share(random), glm::normalize(glm::dvec3(1, 2, 3)));
    const double scale = std::pow(10.0, share(random));
    glm::dvec3 box = scale * size;
    for (int a = 0; a < 3; ++a) box[a] = three_digits(box[a]);
    spec.box_m = box;
    SCOPED_TRACE(k);
    expect_placed(spec, scale, 0.011);
    // A box that is 1.5 % or more off is refused, and the one that the sentence names is taken.
    const int a = k % 3;
    spec.box_m = scale * size;
    (*spec.box_m)[a] *= k % 2 ? 1.015 : 0.9;
    spec.transform.scale = glm::dvec3(1.0, k % 5 ? 1.0 : 0.8, 1.0);
    const std::string message = refusal_of(spec);
    const size_t at = message.find("for example ");
    ASSERT_NE(at, std::string::npos) << message;
    std::istringstream named(message.substr(at + 12));
    glm::dvec3 fits;
    named >> fits.x >> fits.y >> fits.z;
    spec.box_m = fits;
    EXPECT_EQ(refusal_of(spec), "");
  }
  // A box that the scene does not give is only as large as fits into it.
  VolumeSpec spec = some_spec();
  spec.box_m = glm::dvec3(1.0);
  EXPECT_THAT(refusal_of(spec), HasSubstr("obliquely"));
  spec.box_assumed = true;
  expect_placed(spec, 1.0 / std::max({size.x, size.y, size.z}), 1e-9);
  const glm::dvec3 filled = filled_box(spec, *volume);
  EXPECT_NEAR(std::max({filled.x, filled.y, filled.z}), 1.0, 1e-12);
  // Along the patient's axes it is filled as a whole.
  VolumeData straight = some_data();
  for (Volume& frame : straight.frames.frames) frame.grid.direction = glm::dmat3(1.0);
  const auto other = build(some_spec(), std::move(straight));
  ASSERT_TRUE(other);
  EXPECT_EQ(filled_box(spec, *other), glm::dvec3(1.0));
}

TEST(MakeVolume, TiesOnlyTheAxesThatLieObliquely) {
  // Turned about its first axis: the edge along that may have any length.
  const double c = std::cos(0.4), s = std::sin(0.4);
  VolumeData data = some_data();
  for (Volume& frame : data.frames.frames)
    frame.grid.direction = glm::dmat3(glm::dvec3(1, 0, 0), {0, c, s}, {0, -s, c});
  const Grid grid = data.frames.frames[0].grid;
  const glm::dvec3 size = 1e-3 * grid.spacing_mm * glm::dvec3(grid.size);
  const auto volume = build(some_spec(), std::move(data));
  ASSERT_TRUE(volume);
  VolumeSpec spec = some_spec();
  spec.box_m = size * glm::dvec3(3.0, 1.004, 0.998);
  EXPECT_TRUE(start_transform(spec, *volume));
  EXPECT_EQ(filled_box(spec, *volume).x, spec.box_m->x);
  spec.box_m = size * glm::dvec3(1.0, 1.02, 1.0);
  EXPECT_FALSE(start_transform(spec, *volume));
}

TEST(MakeVolume, TakesAsLongAsACycleIsSaidToTake) {
  VolumeSpec spec = some_spec();
  spec.cycle_s = 3.0;
  const auto cycle = build(spec, some_data());
  ASSERT_TRUE(cycle);
  EXPECT_THAT(cycle->times.times_s, ElementsAre(0.0, 1.0, 2.0));
  EXPECT_DOUBLE_EQ(cycle->times.cycle_s, 3.0);
  spec.cyclic = false;
  VolumeData data = some_data();
  data.motions[0].fields.pop_back();
  data.motions[0].confidences.pop_back();
  const auto once = build(spec, std::move(data));
  ASSERT_TRUE(once) << once.error().message;
  EXPECT_THAT(once->times.times_s, ElementsAre(0.0, 1.5, 3.0));
  EXPECT_DOUBLE_EQ(once->times.cycle_s, 0.0);
}

TEST(MakeVolume, MakesThePotentialOfCharges) {
  VolumeSpec spec;
  spec.name = "x";
  spec.source = "charges";
  EXPECT_FALSE(build(spec));
  spec.charges = {{{0.01, 0.0, 0.0}, 2.0, 0.003}};
  const auto volume = build(spec);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_NEAR(volume->frames[0]->scalar({0.01, 0.004, 0.0}), 2.0 / 0.005, 1e-9);
  EXPECT_LT(glm::length(volume->frames[0]->low_m() - glm::dvec3(-0.005, -0.015, -0.015)), 1e-15);
  spec.box_m = glm::dvec3(0.1);
  EXPECT_EQ(build(spec)->frames[0]->high_m(), glm::dvec3(0.05));
  spec.charges[0].softness_m = 0.0;
  EXPECT_FALSE(build(spec));
  spec.charges[0] = {{std::nan(""), 0.0, 0.0}, 1.0, 0.1};
  EXPECT_FALSE(build(spec));
}

TEST(MakeVolume, PutsTheMiddleOfFilesWhereTheTransformSays) {
  VolumeSpec spec = some_spec();
  spec.transform.translation_m = {0.1, 0.2, 0.3};
  spec.transform.rotation = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1, 2, 3)));
  spec.transform.scale = {1.0, 2.0, 0.5};
  const auto volume = build(spec, some_data());
  ASSERT_TRUE(volume);
  const FrameData& frame = *volume->frames[0];
  const glm::dvec3 middle = 0.5 * (frame.low_m() + frame.high_m());
  const Transform placed = *start_transform(spec, *volume);
  EXPECT_LT(glm::length(placed.world_from_volume(middle) - spec.transform.translation_m), 1e-15);
  spec.centred = false;
  EXPECT_EQ(start_transform(spec, *volume)->translation_m, spec.transform.translation_m);
}

}  // namespace
}  // namespace palpate
