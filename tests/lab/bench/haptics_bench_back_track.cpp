#include "module/haptics/back_track.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "compute/volume/phantom.h"
#include "tests/lab/bench/haptics_bench.h"
#include "tests/lab/bench/haptics_bench_scenes.h"
#include "tests/support/fields.h"

namespace palpate::bench {
namespace {

using test::Random;

/// Steps and residuals of many searches.
struct Searches {
  std::array<int64_t, 65> steps{};
  int64_t count = 0, failed = 0;
  double worst_voxels = 0.0, seconds = 0.0;
  void add(const BackTrack& found, double left_voxels) {
    ++steps[size_t(std::min(found.steps, 64))];
    ++count;
    failed += !found.ok;
    worst_voxels = std::max(worst_voxels, left_voxels);
  }
  int quantile(double q) const {
    int64_t left = count;
    for (size_t s = 0; s < steps.size(); ++s)
      if ((left -= steps[s]) <= int64_t((1.0 - q) * double(count))) return int(s);
    return int(steps.size());
  }
};

struct Draw {
  double phase;
  glm::dvec3 target, start;
};

/// Points as the hand finds them: up to 1 m/s of the hand and a frame in 10 ms since the last one.
std::vector<Draw> draws(const MotionMap& map, const Grid& grid, Random& random, int count) {
  std::vector<Draw> all;
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 x = volume_from_lps(grid.lps_from_index(test::some_index(grid, random, 2.0)));
    const glm::dvec3 u = map.displacement(x);
    const double phase = random.draw(0.0, 1.0);
    all.push_back({phase, x + phase * u, x + random.vector(5e-4) + random.draw(-0.1, 0.1) * u});
  }
  return all;
}

void search_all(const MotionMap& map, const std::vector<Draw>& all, BackTracking method,
                Searches& searches) {
  std::vector<BackTrack> found(all.size());
  const double begin = now_s();
  for (size_t i = 0; i < all.size(); ++i)
    found[i] = back_track(map, all[i].phase, all[i].target, all[i].start, glm::dvec3(0.0), method);
  searches.seconds += now_s() - begin;
  for (size_t i = 0; i < all.size(); ++i) {
    // Looked at afresh: the search's own word is not taken for it.
    const glm::dvec3 there = found[i].x_m + all[i].phase * map.displacement(found[i].x_m);
    searches.add(found[i], glm::length(there - all[i].target) / map.cell_m());
  }
}

/// Smooth random fields of 24^3 samples whose largest contraction bound is q.
void contracting(const HapticsBench& bench, Findings& findings) {
  Table table{"Inverting the motion, q < 1",
              "Smooth random fields, started from the last millisecond's point: hand to 1 m/s, a "
              "frame in 10 ms. Steps: reads of the field after the first. Newton is palpate's, "
              "Picard the paper's fixed point (27), both asked for 1e-6 voxel, Picard within 64 "
              "steps.",
              {{"q", "q"},
               {"method", "method"},
               {"steps_p50", "steps p50"},
               {"steps_p999", "p99.9"},
               {"steps_most", "most"},
               {"worst_voxel", "worst residual, voxel"},
               {"not_found", "not found"},
               {"ns", "ns each"}},
              {}};
  Searches newton_all, picard_all;
  for (const double q : {0.3, 0.6, 0.9, 0.99}) {
    Searches newton, picard;
    for (uint32_t seed = 1; seed <= uint32_t(bench.part(80)); ++seed) {
      Random random(seed);
      const Grid grid = test::cube_grid(24, 1.0);
      const Field field = test::smooth_field(grid, random, random.draw(4.0, 16.0));
      const double now = MotionMap::of(field)->worst_contraction();
      const auto map = MotionMap::of(test::scaled(field, q / now));
      const std::vector<Draw> all = draws(*map, grid, random, 5000);
      search_all(*map, all, BackTracking::kNewton, newton);
      search_all(*map, all, BackTracking::kPicard, picard);
    }
    const auto add = [&](const char* name, const Searches& s, Searches& sum) {
      table.rows.push_back(
          {number(q, 2), words(name), number(s.quantile(0.5), 0), number(s.quantile(0.999), 0),
           number(s.quantile(1.0), 0), words(fmt::format("{:.1e}", s.worst_voxels)),
           number(double(s.failed), 0), number(1e9 * s.seconds / double(s.count), 0)});
      for (size_t i = 0; i < s.steps.size(); ++i) sum.steps[i] += s.steps[i];
      sum.count += s.count;
      sum.failed += s.failed;
      sum.worst_voxels = std::max(sum.worst_voxels, s.worst_voxels);
    };
    add("Newton", newton, newton_all);
    add("Picard", picard, picard_all);
  }
  findings.details.push_back(table);
  findings.goals.push_back({"back-tracking where q < 1: largest residual", "falls back to a guess",
                            "voxel", 1e-3, 1e-5, newton_all.worst_voxels, 7,
                            fmt::format("Picard {:.1e}", picard_all.worst_voxels)});
  findings.goals.push_back({"back-tracking where q < 1: steps at p99.9",
                            "",
                            "steps",
                            4.0,
                            {},
                            double(newton_all.quantile(0.999)),
                            0,
                            fmt::format("Picard {} (of 64 at most)", picard_all.quantile(0.999))});
}

/// Rough and folded fields: is an answer ever called good that is none?
void folded(const HapticsBench& bench, Findings& findings) {
  int64_t unflagged = 0, refused = 0, count = 0;
  for (uint32_t seed = 1; seed <= uint32_t(bench.part(400)); ++seed) {
    Random random(seed);
    const Grid grid = test::cube_grid(12, 1.0);
    const Field rough = test::rough_field(grid, random, random.draw(0.5, 4.0));
    const Field smooth = test::scaled(test::smooth_field(grid, random, 5.0), random.draw(1.0, 5.0));
    const auto map = MotionMap::of(seed % 2 ? rough : smooth);
    for (const Draw& draw : draws(*map, grid, random, 2000)) {
      const BackTrack found = back_track(*map, draw.phase, draw.target, draw.start);
      const double left =
          glm::length(found.x_m + draw.phase * map->displacement(found.x_m) - draw.target);
      const glm::dmat3 m = glm::dmat3(1.0) + draw.phase * map->sample(found.x_m).jacobian;
      const bool good = left <= 1e-3 * map->cell_m() && glm::determinant(m) > 0.0;
      unflagged += found.ok && !good;
      refused += !found.ok;
      ++count;
    }
  }
  findings.goals.push_back(
      {"q >= 1 or folded: wrong points passed off as right", "unresolved", "", 0.0, 0.0,
       double(unflagged), 0,
       fmt::format("of {} searches in rough and folded fields; {} refused", count, refused)});
}

/// The beating shell whose material also runs along its surface, in its third step so unevenly that
/// it runs through itself: turned about an axis by much * sin(6 longitude). Its frames, which know
/// no longitude, are right all the same, so that all that is felt of it is the fold's own doing.
std::shared_ptr<const MovingVolume> folding_shell(Random& random, glm::dvec3 axis) {
  constexpr int kFrames = 4, kStep = 2;
  const Grid grid = test::shell_grid(1.0);
  auto volume = std::make_shared<MovingVolume>(*test::shell(kFrames, 2.0));
  const glm::dvec3 east = glm::normalize(glm::cross(axis, glm::dvec3(0.3, 0.5, -0.8)));
  const glm::dvec3 north = glm::cross(axis, east);
  const double much = random.draw(0.2, 0.4);
  Field field = shell_truth(grid, kStep, kStep + 1, kFrames);
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = grid.lps_from_index({i, j, k});
        glm::vec3& u = field.u_mm[grid.offset(i, j, k)];
        const double longitude = std::atan2(glm::dot(x, north), glm::dot(x, east));
        const glm::dquat turn = glm::angleAxis(much * std::sin(6.0 * longitude), axis);
        u = glm::vec3(turn * (x + glm::dvec3(u)) - x);
      }
  volume->motions.front().steps[kStep] = MotionMap::of(field);
  if (volume->motions.front().steps[kStep]->folded_cells() == 0)
    throw Mismatch("The folding field does not fold: it would prove nothing.");
  return volume;
}

/// A hand that strokes a shell of which one step folds: what is felt of that.
void folded_hand(const HapticsBench& bench, Findings& findings) {
  double worst = 0.0, worst_paper = 0.0;
  int64_t held = 0, wrong = 0, ticks = 0;
  for (uint32_t seed = 1; seed <= uint32_t(bench.quick ? 8 : 80); ++seed) {
    Random random(seed);
    const glm::dvec3 axis = glm::normalize(random.vector(1.0) + glm::dvec3(1e-6));
    const auto data = folding_shell(random, glm::normalize(lps_from_volume(axis)));
    SceneSpec spec = test::shell_spec(20.0, 0.0, 600.0);
    test::Hand hand(spec, {data}, bare());
    spec.volumes.front().back_tracking = BackTracking::kPicard;
    PaperHand paper(spec, {data});
    const glm::dvec3 across =
        glm::normalize(glm::cross(axis, random.vector(1.0) + glm::dvec3(1e-6)));
    glm::dvec3 last(0.0), last_paper(0.0);
    for (int i = 0; i < 4000; ++i) {
      const double r = std::max(0.0225, 0.037 - 2e-5 * i);
      // Along the way in which the material folds, at 15 mm/s.
      const glm::dvec3 along = glm::angleAxis(5e-4 * i, axis) * across;
      const TickOutput out = hand.to(r * along), other = paper.to(r * along);
      held += out.held;
      wrong += !out.held && out.residual_m > 1e-6;
      ++ticks;
      worst = std::max(worst, glm::length(out.wanted_n - last));
      worst_paper = std::max(worst_paper, glm::length(other.wanted_n - last_paper));
      last = out.wanted_n;
      last_paper = other.wanted_n;
    }
  }
  if (held == 0) throw Mismatch("No fold came under the hand: the row would prove nothing.");
  findings.goals.push_back(
      {"a folding field under a hand: force change in a ms",
       "",
       "N",
       0.05,
       {},
       worst,
       4,
       fmt::format("the paper's loop {:.2f}; {} of {} frames held, {} not flagged", worst_paper,
                   held, ticks, wrong)});
}

/// Where the same still hand holds the material after many beats.
void drift(const HapticsBench& bench, Findings& findings) {
  const int beats = int(bench.part(1000));
  const auto data = test::shell(4, 4.0, test::Made::kSampled);
  double worst = 0.0;
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    test::Hand hand(test::shell_spec(20.0, 0.5, 600.0), {data}, bare());
    Random random(seed);
    const glm::dvec3 along = glm::normalize(random.vector(1.0) + glm::dvec3(1e-6));
    glm::dvec3 early(0.0), proxy(0.0);
    for (int i = 0; i < 1000 * (beats + 5); ++i) {
      // It comes in, strokes a little so that friction holds it aslant, and stays.
      const double r = std::max(0.023, 0.037 - 2e-5 * i);
      const glm::dvec3 aside(0.0, 1e-6 * std::min(i, 1500), 0.0);
      proxy = hand.to(r * along + aside).proxy_m;
      if (i == 5000 - 1) early = proxy;
    }
    worst = std::max(worst, glm::length(proxy - early) / 1e-3);
  }
  findings.goals.push_back(
      {fmt::format("drift of a still hand after {} beats", beats), "accumulates", "voxel", 0.5,
       0.05, worst, 5, "exactly cyclic field, 1 mm; the proxy in the world, held by friction"});
}

}  // namespace

Findings back_track_rows(const HapticsBench& bench) {
  Findings findings;
  contracting(bench, findings);
  folded(bench, findings);
  folded_hand(bench, findings);
  drift(bench, findings);
  return findings;
}

}  // namespace palpate::bench
