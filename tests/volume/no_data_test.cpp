// What lies outside of what was scanned. Oracle: sectors and cylinders cut out of speckle, of which
// it is known what was cut; organs on black, which were not; real data.
#include "compute/volume/no_data.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "integration/files/read_volume.h"
#include "tests/support/random.h"

namespace palpate {
namespace {

using Inside = std::function<bool(glm::dvec3 index)>;

constexpr int kSize = 48;

/// A probe above the middle of the top, 70 degrees wide, from 2 to 47 samples away.
bool in_fan(glm::dvec3 x) {
  const glm::dvec3 from = x - glm::dvec3(23.5, 23.5, 0.0);
  const double r = glm::length(from);
  return r > 2.0 && r < 47.0 && std::acos(from.z / r) < 35.0 * std::numbers::pi / 180.0;
}

bool in_circle(glm::dvec3 x) {
  return std::hypot(x.x - 23.5, x.y - 23.5) < 23.5;
}

/// Two frames of tissue: speckle that changes, of which a share is black; `outside` elsewhere.
std::vector<Volume> scanned(const Inside& inside, double black_share, float outside = 0.0F,
                            int slices = kSize) {
  test::Random random(7);
  std::vector<Volume> frames(2);
  for (Volume& frame : frames) {
    frame.grid.size = {kSize, kSize, slices};
    for (int k = 0; k < slices; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i) {
          const bool is_black = random.draw(0.0, 1.0) < black_share;
          const float value = is_black ? outside : float(random.draw(20.0, 200.0));
          frame.values.push_back(inside(glm::dvec3(i, j, k)) ? value : outside);
        }
  }
  return frames;
}

std::optional<Mask> found_in(const std::vector<Volume>& frames) {
  NoDataFinder finder;
  for (const Volume& frame : frames) finder.add(frame);
  return finder.found();
}

struct Errors {
  double eaten = 0.0;   ///< share of the tissue that is taken for no data
  double missed = 0.0;  ///< share of the outside that is not
};

Errors errors_of(const Mask& found, const Inside& inside) {
  double tissue = 0, eaten = 0, outside = 0, missed = 0;
  for (int k = 0; k < found.grid.size.z; ++k)
    for (int j = 0; j < found.grid.size.y; ++j)
      for (int i = 0; i < found.grid.size.x; ++i) {
        const bool is_found = found.values[found.grid.offset(i, j, k)];
        const bool is_tissue = inside(glm::dvec3(i, j, k));
        (is_tissue ? tissue : outside) += 1.0;
        eaten += is_tissue && is_found;
        missed += !is_tissue && !is_found;
      }
  return {eaten / tissue, missed / outside};
}

TEST(NoData, IsAllOutsideOfASectorOrACircle) {
  struct Scan {
    const char* name;
    Inside inside;
    float outside;
    int slices;
  };
  for (const Scan& scan : {Scan{"fan", in_fan, 0.0F, kSize}, Scan{"CT", in_circle, -2000.0F, kSize},
                           Scan{"thin CT", in_circle, -2000.0F, 6}})
    for (const double black_share : {0.0, 0.1, 0.33}) {
      SCOPED_TRACE(scan.name);
      SCOPED_TRACE(black_share);
      const auto found = found_in(scanned(scan.inside, black_share, scan.outside, scan.slices));
      ASSERT_TRUE(found);
      // The rim of two samples is taken on purpose.
      const auto deep_inside = [&](glm::dvec3 x) {
        for (const double a : {-3.0, 0.0, 3.0})
          for (const double b : {-3.0, 0.0, 3.0})
            for (const double c : {-3.0, 0.0, 3.0})
              if (!scan.inside(x + glm::dvec3(a, b, c))) return false;
        return true;
      };
      EXPECT_LT(errors_of(*found, deep_inside).eaten, 0.01);
      EXPECT_LT(errors_of(*found, scan.inside).missed, 0.08);
    }
}

TEST(NoData, IsNoTissueThatIsBlack) {
  // A ventricle of 0 in the fan.
  const auto frames = scanned(
      [](glm::dvec3 x) {
        return in_fan(x) && glm::distance(x, {23.5, 23.5, 28.0}) > 8.0;
      },
      0.1);
  const auto found = found_in(frames);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->values[found->grid.offset(23, 23, 28)]);
}

TEST(NoData, IsNotTheBlackAroundAnOrgan) {
  // Two lobes with a cleft between them, cut out by a segmentation.
  const Inside organ = [](glm::dvec3 x) {
    return glm::distance(x, {15.0, 24.0, 24.0}) < 9.5 || glm::distance(x, {33.0, 24.0, 24.0}) < 9.5;
  };
  EXPECT_FALSE(found_in(scanned(organ, 0.0)));
  // The same, cropped tightly.
  const Inside cropped = [](glm::dvec3 x) {
    const glm::dvec3 half(12.0, 24.0, 24.0);
    return glm::length((x - glm::dvec3(11.5, 23.5, 23.5)) / half) < 1.0 ||
           glm::length((x - glm::dvec3(35.5, 23.5, 23.5)) / half) < 1.0;
  };
  EXPECT_FALSE(found_in(scanned(cropped, 0.0)));
  // A ball has no cleft, but the grid has room around it.
  const Inside ball = [](glm::dvec3 x) { return glm::distance(x, glm::dvec3(23.5)) < 20.0; };
  EXPECT_FALSE(found_in(scanned(ball, 0.0)));
  // Nothing is constant, or nothing else is there.
  EXPECT_FALSE(found_in(scanned([](glm::dvec3) { return true; }, 0.0)));
  EXPECT_FALSE(found_in(scanned([](glm::dvec3) { return false; }, 0.0)));
}

TEST(NoData, IsNotInRealDataThatFillTheirGrid) {
  const std::filesystem::path shared = PALPATE_SHARED_DATA;
  int looked = 0;
  for (const char* file : {"kit/headmr_waves/fixed.mha", "kit/spineus_breathing/fixed.mha",
                           "kit/chestct_breathing/fixed.mha", "kit/tooth_affine/fixed.mha",
                           "kit/bodypet_breathing/fixed.mha", "heart_cine/frame_00.mha"}) {
    if (!std::filesystem::exists(shared / file)) continue;
    SCOPED_TRACE(file);
    ++looked;
    const auto frame = files::read_volume(shared / file);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_FALSE(found_in({*frame}));
  }
  if (!looked) GTEST_SKIP() << "There are no real data in " << shared;
}

TEST(NoData, OfARealSpineCutToASector) {
  const std::filesystem::path folder =
      std::filesystem::path(PALPATE_SHARED_DATA) / "kit/spineus_breathing";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "There is no " << folder;
  std::vector<Volume> frames;
  Inside inside;
  for (const char* name : {"fixed.mha", "moving.mha"}) {
    auto frame = files::read_volume(folder / name);
    ASSERT_TRUE(frame) << frame.error().message;
    const glm::dvec3 n = frame->grid.size, h = frame->grid.spacing_mm;
    inside = [n, h](glm::dvec3 x) {
      const glm::dvec3 from = (x - glm::dvec3(0.5 * n.x, 0.0, 0.5 * n.z)) * h;
      const double r = glm::length(from);
      return r < 0.95 * n.y * h.y && from.y > 0.75 * r;
    };
    for (int k = 0; k < frame->grid.size.z; ++k)
      for (int j = 0; j < frame->grid.size.y; ++j)
        for (int i = 0; i < frame->grid.size.x; ++i)
          if (!inside(glm::dvec3(i, j, k))) frame->values[frame->grid.offset(i, j, k)] = 0.0F;
    frames.push_back(std::move(*frame));
  }
  const auto found = found_in(frames);
  ASSERT_TRUE(found);
  const Errors errors = errors_of(*found, inside);
  EXPECT_LT(errors.eaten, 0.15);  // the rim
  EXPECT_LT(errors.missed, 0.01);
}

TEST(NoData, IsFilledByWhatIsBesideIt) {
  const std::vector<Volume> frames = scanned(in_fan, 0.0);
  const auto found = found_in(frames);
  ASSERT_TRUE(found);
  Volume frame = frames.front();
  continue_into(frame, *found);
  for (size_t v = 0; v < frame.values.size(); ++v) {
    if (found->values[v]) {
      ASSERT_GE(frame.values[v], 20.0F) << v;
    } else {
      ASSERT_EQ(frame.values[v], frames.front().values[v]) << v;
    }
  }
  EXPECT_NEAR(share_of(*found), 0.8, 0.15);
}

}  // namespace
}  // namespace palpate
