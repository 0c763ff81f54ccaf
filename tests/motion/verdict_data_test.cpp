// The verdict on real data: pairs with known motion, real pairs, and failures made of them. The
// oracle is the known motion; a pair of two different objects has no true motion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "compute/motion/verdict.h"
#include "compute/volume/phantom.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/motion/solver_test.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct KnownPair {
  Volume fixed, moving;
  Field truth;  ///< empty where the motion is not known
  Mask mask;    ///< where to score; empty: everywhere
};

/// An error below this counts as right, voxels of the finest axis.
constexpr double kRight = 0.5;

const char* const kKit[] = {"bodypet_affine",    "bodypet_breathing", "chestct_breathing",
                            "chestct_sliding",   "headmr_sliding",    "headmr_waves",
                            "spineus_breathing", "spineus_bspline",   "thoraxmr_bspline",
                            "thoraxmr_heart",    "tooth_affine",      "tooth_bspline"};

template <class T>
T value_of(Result<T> result) {
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return T{};
  }
  return std::move(*result);
}

/// Mean endpoint error in voxels of the image's finest axis, at the truth's samples in the mask.
double voxels_off(const Field& u, const KnownPair& pair) {
  double sum = 0.0, count = 0.0;
  const Grid& grid = pair.truth.grid;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        if (!pair.mask.values.empty()) {
          const Grid& m = pair.mask.grid;
          const glm::ivec3 at(glm::round(m.index_from_lps(x)));
          if (glm::any(glm::lessThan(at, glm::ivec3(0))) ||
              glm::any(glm::greaterThanEqual(at, m.size)) ||
              !pair.mask.values[m.offset(at.x, at.y, at.z)])
            continue;
        }
        sum += glm::length(sample_at_lps(u, x) - glm::dvec3(pair.truth.at(i, j, k)));
        count += 1.0;
      }
  return count > 0.0 ? sum / count / pair.fixed.grid.finest_mm() : NAN;
}

/// The means of blocks of 2 x 2 x 2 voxels; an axis with fewer than 32 voxels is kept.
Volume halved(const Volume& from) {
  const glm::ivec3 block =
      glm::mix(glm::ivec3(1), glm::ivec3(2), glm::greaterThanEqual(from.grid.size, glm::ivec3(32)));
  Grid grid = from.grid;
  grid.size = from.grid.size / block;
  grid.spacing_mm *= glm::dvec3(block);
  grid.origin_mm = from.grid.lps_from_index(0.5 * glm::dvec3(block - 1));
  Volume result{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        double sum = 0.0;
        for (int c = 0; c < block.x * block.y * block.z; ++c) {
          const glm::ivec3 in(c % block.x, c / block.x % block.y, c / (block.x * block.y));
          const glm::ivec3 at = glm::ivec3(i, j, k) * block + in;
          sum += double(from.values[from.grid.offset(at.x, at.y, at.z)]);
        }
        result.values[grid.offset(i, j, k)] = float(sum / (block.x * block.y * block.z));
      }
  return result;
}

class VerdictOnRealData : public test::SolverTest {
 protected:
  void SetUp() override {
    SolverTest::SetUp();
    if (IsSkipped()) return;
    if (!fs::exists(data_)) GTEST_SKIP() << "there is no " << data_;
    std::printf("%-44s %7s %-8s %11s %6s %6s %11s %6s %5s %5s\n", "", "error", "verdict",
                "correlation", "no", "motion", "there, back", "leaves", "SD of", "low");
    std::printf("%-44s %7s %-8s %5s %5s %6s %6s %5s %5s %6s %5s %5s\n", "", "voxels", "", "before",
                "after", "match", "left", "mean", "p99", "", "det", "conf.");
  }

  KnownPair kit(const std::string& name) const {
    const fs::path folder = data_ / "kit" / name;
    return {value_of(files::read_volume(folder / "fixed.mha")),
            value_of(files::read_volume(folder / "moving.mha")),
            value_of(files::read_field(folder / "truth.mha")),
            value_of(files::read_mask(folder / "mask.mha"))};
  }
  KnownPair lung() const {
    const fs::path folder = data_ / "lung";
    return {value_of(files::read_volume(folder / "pair_fixed.mha")),
            value_of(files::read_volume(folder / "pair_moving.mha")),
            value_of(files::read_field(folder / "pair_truth.mha")),
            value_of(files::read_mask(folder / "pair_body.mha"))};
  }
  Volume cine(int k) const {
    char name[32];
    std::snprintf(name, sizeof(name), "frame_%02d.mha", k);
    return value_of(files::read_volume(data_ / "heart_cine" / name));
  }
  /// A frame of each anatomy, at half the resolution along each axis; many pairs are made of them.
  std::map<std::string, Volume> bodies() const {
    std::map<std::string, Volume> all = {{"lung", halved(lung().fixed)}, {"cine", halved(cine(0))}};
    for (const char* name : {"bodypet_affine", "chestct_breathing", "headmr_waves",
                             "spineus_bspline", "thoraxmr_heart", "tooth_bspline"})
      all[name] = halved(kit(name).fixed);
    return all;
  }

  /// Estimates as the program does, and gives the verdict.
  Trust solved(const std::string& name, const KnownPair& pair, const char* with = "balanced") {
    EstimatorOptions options = preset(with);
    options.backward = true;
    const PairMotion motion = motion_of(pair.fixed, pair.moving, options);
    EXPECT_TRUE(motion.backward);
    const Field u = resampled(motion.field, pair.fixed.grid);
    return told(name, u, pair,
                examined(pair.fixed, pair.moving, u, &*motion.backward, &motion.confidence));
  }
  /// The verdict on a field from its frames alone, as in 'palpate check'.
  Trust given(const std::string& name, const Field& field, const KnownPair& pair) {
    const Field u = resampled(field, pair.fixed.grid);
    return told(name, u, pair, examined(pair.fixed, pair.moving, u));
  }

  void expect_no_alarm(const std::string& name, const KnownPair& pair) {
    const Trust trust = solved(name, pair);
    EXPECT_TRUE(trust == Trust::kOk || error_ >= kRight) << name;
  }

  /// Prints one row of the table in docs/decisions/motion-engine.md.
  Trust told(const std::string& name, const Field& u, const KnownPair& pair,
             const Result<Evidence>& evidence) {
    const Evidence e = value_of(evidence);
    error_ = pair.truth.u_mm.empty() ? NAN : voxels_off(u, pair);
    const Verdict verdict = judged(e);
    const Match match = e.match.value_or(Match{});
    std::printf("%-44s %7.3f %-8s %5.2f %5.2f %6.3f %6.3f", name.c_str(), error_,
                word(verdict.trust), match.correlation_before, match.correlation_after,
                match.mismatched, match.motion_left_voxels);
    if (e.inverse) {
      std::printf(" %5.2f %5.1f", e.inverse->own_voxels.mean, e.inverse->own_voxels.p99);
    } else {
      std::printf(" %5s %5s", "-", "-");
    }
    std::printf(" %6.3f %5.2f %5.2f\n", match.leaving, e.folds->sd_log_det,
                e.low_confidence.value_or(NAN));
    for (const std::string& reason : verdict.reasons) std::printf("    %s\n", reason.c_str());
    return verdict.trust;
  }

  const fs::path data_ = PALPATE_SHARED_DATA;
  double error_ = NAN;  ///< of the last one told
};

/// Another volume, resampled to fill a grid.
Volume stretched(const Volume& from, const Grid& onto) {
  Volume result{onto, std::vector<float>(onto.count())};
  const glm::dvec3 step = glm::dvec3(from.grid.size - 1) / glm::dvec3(glm::max(onto.size - 1, 1));
  for (int k = 0; k < onto.size.z; ++k)
    for (int j = 0; j < onto.size.y; ++j)
      for (int i = 0; i < onto.size.x; ++i)
        result.values[onto.offset(i, j, k)] = float(sample(from, step * glm::dvec3(i, j, k)));
  return result;
}

/// The volume with its voxels in another order: the value at index is that at index_of(index).
template <class Index>
Volume rearranged(const Volume& from, const Index& index_of) {
  Volume result{from.grid, std::vector<float>(from.values.size())};
  for (int k = 0; k < from.grid.size.z; ++k)
    for (int j = 0; j < from.grid.size.y; ++j)
      for (int i = 0; i < from.grid.size.x; ++i)
        result.values[from.grid.offset(i, j, k)] =
            float(sample(from, index_of(glm::dvec3(i, j, k))));
  return result;
}

Volume cropped(const Volume& from, glm::ivec3 low, glm::ivec3 size) {
  Grid grid = from.grid;
  grid.size = size;
  grid.origin_mm = from.grid.lps_from_index(glm::dvec3(low));
  return resampled(from, grid);
}

Field scaled(Field u, glm::vec3 by) {
  for (glm::vec3& v : u.u_mm) v *= by;
  return u;
}

/// Where the error is known, "right" is below half a voxel. The other pairs are neighbours in a
/// cycle, or its ends, whose labels agree well (heart_cine's README).
TEST_F(VerdictOnRealData, HasNoFalseAlarmOnKnownMotion) {
  for (const char* name : kKit) expect_no_alarm(name, kit(name));
  expect_no_alarm("lung", lung());
}

TEST_F(VerdictOnRealData, HasNoFalseAlarmOnABreathingLung) {
  const Sequence breath = value_of(files::read_sequence({data_ / "lung" / "breathing.seq.nrrd"}));
  for (size_t k = 0; k < breath.frames.size(); ++k)
    expect_no_alarm("breathing " + std::to_string(k),
                    {breath.frames[k], breath.frames[(k + 1) % 8], {}, {}});
}

TEST_F(VerdictOnRealData, HasNoFalseAlarmOnABeatingHeart) {
  for (int k = 0; k < 20; ++k)
    expect_no_alarm("cine " + std::to_string(k), {cine(k), cine((k + 1) % 20), {}, {}});
  expect_no_alarm("cine 0 to 12", {cine(0), cine(12), {}, {}});
  expect_no_alarm("cine 12 to 0", {cine(12), cine(0), {}, {}});
}

TEST_F(VerdictOnRealData, AcceptsTheMiddleOfAPictureAndThickSlices) {
  for (const char* name : kKit) {
    const KnownPair pair = kit(name);
    const glm::ivec3 n = pair.fixed.grid.size;
    const Volume fixed = cropped(pair.fixed, n / 4, n / 2),
                 moving = cropped(pair.moving, n / 4, n / 2);
    Mask mask = resampled(pair.mask, fixed.grid);
    const Mask seen = test::seen_in_both(resampled(pair.truth, fixed.grid), 2.0);
    for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] &= seen.values[v];
    const Trust trust = solved(std::string(name) + ", middle", {fixed, moving, pair.truth, mask});
    if (error_ < kRight) {
      EXPECT_EQ(trust, Trust::kOk) << name;
    }
  }
  for (const double thick_mm : {4.0, 20.0, 50.0}) {
    test::AffineMap map;
    map.shift_mm = {2.5, -3.2, 0.0};
    map.linear[0][0] = 1.03;
    const Grid grid = test::plain_grid({96, 80, 12}, {1.0, 1.0, thick_mm});
    map.centre_mm = test::middle_of(grid);
    const test::MadePair pair = test::made_pair(grid, map);
    const std::string name = "slices " + std::to_string(int(thick_mm)) + " times as thick";
    EXPECT_EQ(solved(name, {pair.fixed, pair.moving, pair.truth, {}}), Trust::kOk) << name;
  }
}

TEST_F(VerdictOnRealData, NeverCallsTwoDifferentThingsOk) {
  const auto all = bodies();
  size_t failures = 0;
  const auto expect = [&](const std::string& name, const Volume& fixed, const Volume& moving) {
    EXPECT_NE(solved(name, {fixed, moving, {}, {}}, "fast"), Trust::kOk) << name;
    ++failures;
  };
  int n = 0;
  for (const auto& [a, fixed] : all)
    for (const auto& [b, other] : all)
      if (a != b && ++n % 2 == 0) expect(a + " and " + b, fixed, stretched(other, fixed.grid));
  for (const auto& [name, fixed] : all) {
    const glm::dvec3 last(fixed.grid.size - 1);
    expect(name + ", upside down", fixed,
           rearranged(fixed, [&](glm::dvec3 i) { return glm::dvec3(i.x, i.y, last.z - i.z); }));
    expect(name + ", turned by 180 degrees", fixed, rearranged(fixed, [&](glm::dvec3 i) {
             return glm::dvec3(last.x - i.x, last.y - i.y, i.z);
           }));
    Volume inverted = fixed;
    for (float& value : inverted.values) value = -value;
    expect(name + ", contrast inverted", fixed, inverted);
  }
  EXPECT_GE(failures, 50U);
}

TEST_F(VerdictOnRealData, NeverCallsWhatIsLostOkNorNoiseNorNothing) {
  size_t failures = 0;
  const auto expect = [&](const std::string& name, const Volume& fixed, const Volume& moving) {
    EXPECT_NE(solved(name, {fixed, moving, {}, {}}, "fast"), Trust::kOk) << name;
    ++failures;
  };
  for (const auto& [name, fixed] : bodies()) {
    const glm::dvec3 last(fixed.grid.size - 1);
    expect(name + ", out of the picture", fixed, rearranged(fixed, [&](glm::dvec3 i) {
             return glm::dvec3(i.x + 0.6 * last.x, i.y, i.z);
           }));
    expect(name + ", 1.7 times as large", fixed,
           rearranged(fixed, [&](glm::dvec3 i) { return 0.5 * last + 0.6 * (i - 0.5 * last); }));
    double sum = 0.0, squares = 0.0;
    for (const float value : fixed.values) {
      sum += double(value);
      squares += double(value) * double(value);
    }
    const auto count = double(fixed.values.size());
    const double mean = sum / count, sd = std::sqrt(squares / count - mean * mean);
    Volume noise = fixed, empty = fixed;
    for (size_t v = 0; v < noise.values.size(); ++v) {
      noise.values[v] = float(mean + sd * texture::gaussian_like(7, v));
      empty.values[v] = float(mean);
    }
    expect(name + " and noise", fixed, noise);
    expect(name + " and nothing", fixed, empty);
    expect("nothing and " + name, empty, fixed);
  }
  EXPECT_GE(failures, 40U);
}

/// Fields that do not belong to their frames, or have other units or axes; the verdict is without a
/// way back.
TEST_F(VerdictOnRealData, NeverCallsAGivenFieldOkThatIsWrongByAVoxel) {
  std::map<std::string, KnownPair> pairs = {{"lung", lung()}};
  for (const char* name : kKit) pairs[name] = kit(name);
  size_t failures = 0;
  const auto expect = [&](const std::string& name, const KnownPair& pair, const Field& u) {
    const Trust trust = given(name, u, pair);
    if (error_ < 1.0) return;
    EXPECT_NE(trust, Trust::kOk) << name;
    ++failures;
  };
  for (const auto& [name, pair] : pairs) {
    expect(name + ", none", pair, still_field(pair.fixed.grid));
    expect(name + ", negated", pair, scaled(pair.truth, glm::vec3(-1.0F)));
    expect(name + ", doubled", pair, scaled(pair.truth, glm::vec3(2.0F)));
    expect(name + ", halved", pair, scaled(pair.truth, glm::vec3(0.5F)));
    expect(name + ", in RAS", pair, scaled(pair.truth, {-1.0F, -1.0F, 1.0F}));
    Field swapped = pair.truth;
    for (glm::vec3& u : swapped.u_mm) u = {u.z, u.y, u.x};
    expect(name + ", axes swapped", pair, swapped);
    auto other = std::next(pairs.find(name));
    if (other == pairs.end()) other = pairs.begin();
    // The other pair's field, resampled to this grid and scaled to its voxels.
    Field foreign = still_field(pair.fixed.grid);
    const Field& from = other->second.truth;
    const glm::dvec3 step = glm::dvec3(from.grid.size - 1) / glm::dvec3(pair.fixed.grid.size - 1);
    const double scale = pair.fixed.grid.finest_mm() / other->second.fixed.grid.finest_mm();
    for (int k = 0; k < foreign.grid.size.z; ++k)
      for (int j = 0; j < foreign.grid.size.y; ++j)
        for (int i = 0; i < foreign.grid.size.x; ++i)
          foreign.u_mm[foreign.grid.offset(i, j, k)] =
              glm::vec3(scale * sample(from, step * glm::dvec3(i, j, k)));
    expect(name + ", of " + other->first, pair, foreign);
  }
  EXPECT_GE(failures, 60U);
}

}  // namespace
}  // namespace palpate
