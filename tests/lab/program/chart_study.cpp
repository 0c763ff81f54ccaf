#include "tests/lab/program/chart_study.h"

#include <algorithm>
#include <iterator>

#include "compute/vulkan/context.h"
#include "integration/app/choice/front_file.h"
#include "tests/lab/program/peers.h"
#include "tests/lab/studies/feel_section.h"
#include "tests/lab/studies/motion_section.h"
#include "tests/lab/studies/scene_study.h"

namespace palpate::app {
namespace {

/// A pair to measure, and how much is measured on it.
struct Pair {
  studies::MotionCase known;
  bool few = false;  ///< only the settings and peers that differ most

  /// Of the time.
  double weight() const { return few ? 0.3 : 1.0; }
};

/// The pairs to measure: synthetic ones first, then real ones, then the user's own. All settings
/// and peers run on the project's most realistic pair and on the user's, so that each is measured
/// at least once.
Result<std::vector<Pair>> pairs_of(const ChartJob& job) {
  // The user's pair may be refused, so it is read before the others are made.
  std::optional<studies::MotionCase> own;
  if (job.own) {
    auto read = bench::read_own_pair(*job.own);
    if (!read) return read.error();
    own = std::move(*read);
  }
  std::vector<Pair> pairs;
  pairs.push_back({studies::heart_case(job.run.quick ? 64 : 128), job.run.quick});
  auto ct = bench::read_known_ct(job.data / "lung");
  if (!ct) return ct.error();
  if (*ct) {
    pairs.back().few = true;
    pairs.push_back({job.run.quick ? studies::halved(**ct) : std::move(**ct), job.run.quick});
    if (job.run.quick)
      pairs.back().known.name = "Real chest CT in known motion, halved to " +
                                studies::grid_text(pairs.back().known.fixed.grid);
  }
  if (own) pairs.push_back({std::move(*own), job.run.quick});
  return pairs;
}

/// All settings and peers on one pair, which gets its share of the time that is left for `weight`
/// (its own and that of the pairs after it).
studies::MotionMeasures measured(const ChartJob& job, const Pair& pair, double weight,
                                 std::vector<std::string>& missing) {
  studies::StudyRun run = job.run;
  run.end_s = studies::now_s() + run.left_s() * pair.weight() / weight;
  auto methods = studies::palpate_methods(run, pair.few);
  missing.clear();
  auto peers = motion_peers(pair.few, missing);
  // Presets, then peers, then variations: if time runs out, the least important are missing.
  const auto rest = std::find_if(methods.begin(), methods.end(),
                                 [](const auto& method) { return !method->is_preset(); });
  methods.insert(rest, std::move_iterator(peers.begin()), std::move_iterator(peers.end()));
  return studies::measure_motion(run, pair.known, std::move(methods));
}

Result<report::Section> motion(const ChartJob& job) {
  auto pairs = pairs_of(job);
  if (!pairs) return pairs.error();
  std::vector<std::string> missing;
  std::vector<studies::MotionMeasures> measures;
  double whole = 0.0, done = 0.0;
  for (const Pair& pair : *pairs) whole += pair.weight();
  for (const Pair& pair : *pairs) {
    if (job.run.stop.stop_requested()) break;
    ChartJob part = job;
    part.run.progress = [&](double share, const std::string& doing) {
      job.run.tell((done + share * pair.weight()) / whole, doing);
    };
    measures.push_back(measured(part, pair, whole - done, missing));
    done += pair.weight();
  }
  auto section = studies::motion_section(measures);
  if (!section) return section.error();
  for (const std::string& sentence : missing)
    section->parts.push_back(report::Note{sentence, true});
  // The front for this machine comes from the largest pair that is not the user's own.
  if (!job.run.stop.stop_requested()) {
    const auto& known = measures[job.own ? measures.size() - 2 : measures.size() - 1];
    const Status kept = write_front(
        studies::front_of(known, job.run.context->info().name, "palpate " PALPATE_VERSION));
    if (!kept) job.console->say(kept.error().message);
  }
  return section;
}

Result<report::Section> feel(const ChartJob& job) {
  return studies::feel_section(studies::measure_feel(job.run));
}

Result<report::Section> view(const ChartJob& job) {
  std::vector<std::string> missing;
  // The peer first, with half of the time at most: a comparison is worth more than one more rate.
  studies::StudyRun peers = job.run;
  peers.end_s = studies::now_s() + 0.5 * job.run.left_s();
  job.run.tell(0.0, "view: VTK");
  auto others = view_peer(peers, missing);
  studies::StudyRun ours = job.run;
  ours.progress = [&](double share, const std::string& doing) {
    job.run.tell(0.3 + 0.7 * share, doing);
  };
  auto measures = studies::measure_view(ours, missing);
  std::move(others.begin(), others.end(), std::back_inserter(measures));
  return studies::view_section(measures, missing);
}

Result<report::Section> scene(const ChartJob& job) {
  return studies::scene_section(studies::measure_scene(job.run));
}

}  // namespace

const std::vector<ChartStudy>& chart_studies() {
  static const std::vector<ChartStudy> studies = {
      {"motion", "seconds against error: every preset, other settings, other programs", 12.0, true,
       motion},
      {"feel", "microseconds of a haptic frame against its force error", 0.5, true, feel},
      {"view", "milliseconds of a stereo picture against its quality", 2.5, true, view},
      {"scene", "cost against what is in the scene", 1.5, true, scene},
  };
  return studies;
}

}  // namespace palpate::app
