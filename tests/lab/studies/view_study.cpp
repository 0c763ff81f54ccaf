#include "tests/lab/studies/view_study.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <tuple>

#include <fmt/format.h>

#include "tests/lab/report/plot.h"
#include "tests/lab/studies/measuring.h"
#include "tests/lab/studies/motion_statements.h"
#include "tests/lab/studies/view_shot.h"

namespace palpate::studies {
namespace {

constexpr double kReferenceRate = 8.0;

const char* const kSteps = "palpate, by samples per voxel";
const char* const kNoSkip = "palpate, nothing skipped";
const char* const kDefault = "palpate, the default";
const char* const kAllPixels = "palpate, rays of all pixels";
const char* const kHalf = "palpate, every second pixel";
const char* const kMoving = "palpate, moving";
const char* const kSmaller = "palpate, fewer pixels";

/// The fastest picture of a look that is good enough, and of how many. `ours`: palpate's plain
/// method, else a peer's.
struct FastestGood {
  const ViewMeasure* measure = nullptr;
  int of = 0;
};

FastestGood fastest_good(const std::vector<ViewMeasure>& all, const std::string& look, bool ours) {
  FastestGood best;
  for (const ViewMeasure& m : all) {
    if (m.look != look || m.quality_db < kEnoughDb || m.family == kSmaller) continue;
    if ((m.family == kSteps || m.family == kHalf) != ours ||
        (!ours && m.family.starts_with("palpate")))
      continue;
    ++best.of;
    if (!best.measure || m.time_ms < best.measure->time_ms) best.measure = &m;
  }
  return best;
}

const ViewMeasure* find(const std::vector<ViewMeasure>& all, const std::string& look,
                        const std::string& family) {
  for (const ViewMeasure& m : all)
    if (m.look == look && m.family == family) return &m;
  return nullptr;
}

/// palpate's plain method at the rate and size of another one.
const ViewMeasure* plain_beside(const std::vector<ViewMeasure>& all, const ViewMeasure& other) {
  for (const ViewMeasure& m : all)
    if (m.look == other.look && m.family == kSteps &&
        m.samples_per_voxel == other.samples_per_voxel)
      return &m;
  return nullptr;
}

report::Chart chart_of(const std::vector<ViewMeasure>& all, const std::string& look) {
  report::Chart chart;
  chart.title = "Picture quality against time: " + look + " look";
  chart.x = {"A stereo picture (ms)", true, {}, {}};
  double least = kEnoughDb;
  for (const ViewMeasure& m : all)
    if (m.look == look) least = std::min(least, m.quality_db);
  chart.y = {"Quality, PSNR (dB)", false, 5.0 * std::floor(least / 5.0 - 1.0), {}};
  for (const ViewMeasure& m : all) {
    if (m.look != look) continue;
    auto found = std::find_if(chart.series.begin(), chart.series.end(),
                              [&](const report::Series& s) { return s.name == m.family; });
    if (found == chart.series.end()) {
      const bool line = m.family == kSteps;
      found = chart.series.insert(
          chart.series.end(),
          {m.family, {}, line ? report::Line::kStraight : report::Line::kNone, {}, {}});
    }
    found->points.push_back(
        {m.time_ms, m.quality_db,
         m.family == kSmaller ? fmt::format("{} pixels", m.pixels)
                              : fmt::format("{:g}", m.samples_per_voxel),
         true,
         fmt::format("{}\n{:g} samples per voxel, {} x {} pixels\n{:.1f} ms, "
                     "{:.1f} dB",
                     m.family, m.samples_per_voxel, m.pixels, m.pixels, m.time_ms, m.quality_db)});
  }
  chart.guides = {{false, kEnoughDb, "40 dB: no difference to be seen"}};
  return chart;
}

/// One picture series of a look: if time runs out, the last ones are left out.
struct Way {
  const char* family;
  double rate;
};

/// The reference comes first, then other methods, then other rates: the coarsest first, because a
/// peer is compared with the fastest picture of sufficient quality.
std::vector<Way> ways_of(bool quick) {
  std::vector<Way> ways = {{kSteps, 1.0},  {kMoving, 1.0},  {kSmaller, 1.0},
                           {kNoSkip, 1.0}, {kDefault, 0.5}, {kAllPixels, 1.0}};
  for (const double rate : quick ? std::vector{0.25, 0.5, 2.0}
                                 : std::vector{0.125, 0.25, 0.5, 2.0, 0.35, 0.7, 4.0, 1.4})
    ways.push_back({kSteps, rate});
  for (const double rate : quick ? std::vector{0.5} : std::vector{0.125, 0.5, 0.7, 1.0})
    ways.push_back({kHalf, rate});
  return ways;
}

int rank(const ViewMeasure& m) {
  return m.family == kSteps ? 0 : m.family == kNoSkip ? 1 : m.family == kMoving ? 2 : 3;
}

/// Draws one look until end_s; adds to `all`, and to `left_out` the series without time.
class LookStudy {
 public:
  LookStudy(const StudyRun& run, bool dense, double end_s)
      : run_(run),
        look_(view_look(dense)),
        volume_(beating(run.quick ? 128 : 256)),
        pixels_(run.quick ? 256 : 512),
        runs_(run.quick ? 2 : 3),
        end_s_(end_s) {}

  void measure(const std::function<void(double, const std::string&)>& tell,
               std::vector<ViewMeasure>& all, std::string& left_out) {
    tell(0.0, "view: reference, " + look_.name);
    const Drawn best = reference_at(pixels_);
    const auto ways = ways_of(run_.quick);
    for (size_t n = 0; n < ways.size() && !run_.stop.stop_requested(); ++n) {
      const std::string what =
          fmt::format("{}, {}, {:g} a voxel", look_.name, ways[n].family, ways[n].rate);
      // All others are compared with the plain method at one sample per voxel.
      if (n > 0 && now_s() > end_s_) {
        left_out += (left_out.empty() ? "" : "; ") + what;
        continue;
      }
      tell(double(n + 1) / double(ways.size() + 1), "view: " + what);
      all.push_back(measured(ways[n], best));
    }
  }

 private:
  Drawn drawn_at(const Shot& shot, int runs) const {
    return draw(run_.context, volume_, shot, runs, run_.stop);
  }

  Drawn reference_at(int pixels) const {
    Shot shot{look_, kReferenceRate, pixels};
    shot.smooth = 0.0;
    return drawn_at(shot, 0);
  }

  ViewMeasure measured(const Way& way, const Drawn& best) const {
    Shot shot{look_, way.rate, pixels_};
    shot.skip_empty = way.family != kNoSkip;
    shot.refines = way.family == kDefault;
    if (way.family == kAllPixels) shot.smooth = 0.0;
    if (way.family == kHalf) shot.smooth = std::numeric_limits<double>::infinity();
    shot.moving = way.family == kMoving;
    const bool smaller = way.family == kSmaller;
    if (smaller) shot.pixels /= 2;
    const Drawn drawn = drawn_at(shot, runs_);
    // In motion every picture is different: its quality is that of the still one.
    const Drawn still =
        shot.moving ? drawn_at({look_, shot.samples_per_voxel, shot.pixels}, 0) : drawn;
    const Drawn reference = smaller ? reference_at(shot.pixels) : best;
    return {look_.name,  way.family,          way.rate,
            shot.pixels, 1e3 * drawn.seconds, psnr_db(still.bytes, reference.bytes)};
  }

  const StudyRun& run_;
  const Look look_;
  const std::shared_ptr<const MovingVolume> volume_;
  const int pixels_, runs_;
  const double end_s_;
};

}  // namespace

report::Table view_table(const std::vector<ViewMeasure>& all) {
  report::Table table{"Pictures in stereo",
                      "Two eyes; PSNR against the same picture with 8 samples per voxel.",
                      {{"look", "look"},
                       {"family", "way"},
                       {"samples_per_voxel", "samples per voxel"},
                       {"pixels", "pixels a side"},
                       {"time_ms", "ms"},
                       {"quality_db", "PSNR, dB"}},
                      {}};
  for (const ViewMeasure& m : all)
    table.rows.push_back({report::words(m.look), report::words(m.family),
                          report::number(m.samples_per_voxel, 2), report::number(m.pixels, 0),
                          report::number(m.time_ms, 1), report::number(m.quality_db, 1)});
  return table;
}

std::vector<ViewMeasure> measure_view(const StudyRun& run, std::vector<std::string>& missing) {
  std::vector<ViewMeasure> all;
  std::string left_out;
  for (const bool dense : {false, true}) {
    if (run.stop.stop_requested()) return all;
    // Half of the time for each look.
    const double end_s = now_s() + run.left_s() * (dense ? 1.0 : 0.5);
    LookStudy(run, dense, end_s)
        .measure(
            [&](double share, const std::string& doing) { run.tell(0.5 * (share + dense), doing); },
            all, left_out);
  }
  // In the plots a line connects the rates in order.
  std::stable_sort(all.begin(), all.end(), [](const ViewMeasure& a, const ViewMeasure& b) {
    return std::tuple(a.look == "dense", rank(a), a.samples_per_voxel) <
           std::tuple(b.look == "dense", rank(b), b.samples_per_voxel);
  });
  if (!left_out.empty())
    missing.push_back(
        fmt::format("The time was over before all was drawn (more: --minutes). Left "
                    "out: {}.",
                    left_out));
  return all;
}

std::vector<std::string> view_sentences(const std::vector<ViewMeasure>& all) {
  std::vector<std::string> sentences;
  for (const char* look : {"sparse", "dense"}) {
    const auto [good, good_of] = fastest_good(all, look, true);
    if (good) {
      sentences.push_back(fmt::format(
          "The {} {} stereo picture of {} x {} pixels that can not be told from the best one "
          "(it has {:.0f} dB) takes {}.",
          good_of > 1 ? "fastest" : "only", look, good->pixels, good->pixels, good->quality_db,
          time_text(1e-3 * good->time_ms)));
    }
    if (const auto [peer, peer_of] = fastest_good(all, look, false); peer && good)
      sentences.push_back(fmt::format(
          "{} takes {} for its {} that is good enough too ({:.0f} dB), {:.2g} "
          "times as long.",
          peer->family, time_text(1e-3 * peer->time_ms), peer_of > 1 ? "fastest" : "only one",
          peer->quality_db, peer->time_ms / good->time_ms));
    for (const auto& [family, what] :
         {std::pair(kNoSkip, "Without skipping what is empty"), {kMoving, "While it moves"}}) {
      const ViewMeasure* other = find(all, look, family);
      const ViewMeasure* plain = other ? plain_beside(all, *other) : nullptr;
      if (plain)
        sentences.push_back(fmt::format("{} a {} one takes {:.2g} times as long.", what, look,
                                        other->time_ms / plain->time_ms));
    }
  }
  return sentences;
}

Result<report::Section> view_section(const std::vector<ViewMeasure>& all,
                                     const std::vector<std::string>& missing) {
  report::Section section{"view", "View: milliseconds against picture quality", "", {}};
  for (const std::string& sentence : view_sentences(all))
    section.answer += (section.answer.empty() ? "" : " ") + sentence;
  for (const char* look : {"sparse", "dense"}) {
    const report::Chart chart = chart_of(all, look);
    auto svg = drawn(chart, std::string("view") + look);
    if (!svg) return svg.error();
    section.parts.push_back(report::Figure{
        chart.title, std::move(*svg),
        "Further left is faster, further up is better. Labels: samples per voxel along a ray.",
        view_table(all)});
  }
  section.parts.push_back(report::TablePart{view_table(all), true});
  for (const std::string& sentence : missing) section.parts.push_back(report::Note{sentence, true});
  return section;
}

}  // namespace palpate::studies
