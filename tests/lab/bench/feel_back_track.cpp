#include <algorithm>

#include <fmt/format.h>

#include "tests/lab/bench/feel_rows.h"
#include "tests/lab/stability/searches.h"
#include "tests/lab/stability/shell.h"

namespace palpate::bench {
namespace {

using stability::Flow;
using stability::Searches;
using test::Random;

constexpr double kAnyPhase = -1.0;

/// Smooth random fields of 24^3 samples whose largest contraction bound is q.
void contracting(const FeelBench& bench, Findings& findings) {
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
      const auto map = MotionMap::of(flow_field(Flow::kWaves, q, random));
      newton += stability::searched(*map, kAnyPhase, BackTracking::kNewton, random, 5000);
      picard += stability::searched(*map, kAnyPhase, BackTracking::kPicard, random, 5000);
    }
    const auto add = [&](const char* name, const Searches& s, Searches& sum) {
      table.rows.push_back(
          {number(q, 2), words(name), number(s.quantile(0.5), 0), number(s.quantile(0.999), 0),
           number(s.quantile(1.0), 0), words(fmt::format("{:.1e}", s.worst_cells)),
           number(double(s.missed), 0), number(1e9 * s.seconds / double(s.count), 0)});
      sum += s;
    };
    add("Newton", newton, newton_all);
    add("Picard", picard, picard_all);
  }
  findings.details.push_back(table);
  findings.goals.push_back({"back-tracking where q < 1: largest residual", "falls back to a guess",
                            "voxel", 1e-3, 1e-5, newton_all.worst_cells, 7,
                            fmt::format("Picard {:.1e}", picard_all.worst_cells)});
  findings.goals.push_back({"back-tracking where q < 1: steps at p99.9",
                            "",
                            "steps",
                            4.0,
                            {},
                            double(newton_all.quantile(0.999)),
                            0,
                            fmt::format("Picard {} (of 64 at most)", picard_all.quantile(0.999))});
}

/// Rough and folded fields: is a wrong result ever reported as found? A fold on the way to the
/// result is not tested here: in a rough field it may be thinner than any step between samples.
void folded(const FeelBench& bench, Findings& findings) {
  Searches all;
  for (uint32_t seed = 1; seed <= uint32_t(bench.part(400)); ++seed) {
    Random random(seed);
    const Flow flow = seed % 2 ? Flow::kRough : Flow::kWaves;
    const double q = random.draw(1.0, 5.0);
    const auto map = MotionMap::of(flow_field(flow, q, random));
    all += stability::searched(*map, kAnyPhase, BackTracking::kNewton, random, 2000);
  }
  findings.goals.push_back({"q >= 1 or folded: wrong points passed off as right", "unresolved", "",
                            0.0, 0.0, double(all.wrong), 0,
                            fmt::format("of {} searches in rough and folded fields; {} refused",
                                        all.count, all.missed - all.unseen)});
}

/// A hand that strokes a shell with one step that folds: the force that is felt.
void folded_hand(const FeelBench& bench, Findings& findings) {
  constexpr double kHand_m_per_s = 0.015;
  double worst_n = 0.0, papers_n = 0.0;
  int flagged = 0, silent = 0, strokes = 0;
  for (uint32_t seed = 1; seed <= uint32_t(bench.quick ? 8 : 80); ++seed) {
    const double q = 1.2 + 0.3 * (seed % 5);
    const stability::Cell ours = stability::stroke_cell(q, kHand_m_per_s, true, seed);
    worst_n = std::max(worst_n, ours.value);
    flagged += ours.outcome == stability::Outcome::kFlagged;
    silent += ours.outcome == stability::Outcome::kSilent;
    papers_n = std::max(papers_n, stability::stroke_cell(q, kHand_m_per_s, false, seed).value);
    ++strokes;
  }
  if (flagged == 0) throw Mismatch("No fold came under the hand: the row would prove nothing.");
  findings.goals.push_back(
      {"a folding field under a hand: force change in a ms beyond its own way's",
       "",
       "N",
       0.05,
       {},
       worst_n,
       4,
       fmt::format("the paper's loop {:.2f}; {} of {} strokes flagged, {} failed and not flagged",
                   papers_n, flagged, strokes, silent)});
}

/// How far the material under a still hand has moved after many beats.
void drift(const FeelBench& bench, Findings& findings) {
  const int beats = int(bench.part(1000));
  const auto data = stability::shell(4, 4.0, stability::Made::kSampled);
  double worst = 0.0;
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    stability::Hand hand(stability::shell_spec(20.0, 0.5, 600.0), {data});
    Random random(seed);
    const glm::dvec3 along = random.direction();
    glm::dvec3 early(0.0), proxy(0.0);
    for (int i = 0; i < 1000 * (beats + 5); ++i) {
      // It moves in, strokes a little so that friction holds it at an angle, and stays.
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

Findings back_track_rows(const FeelBench& bench) {
  Findings findings;
  contracting(bench, findings);
  folded(bench, findings);
  folded_hand(bench, findings);
  drift(bench, findings);
  return findings;
}

}  // namespace palpate::bench
