#include "integration/app/chart/chart_study.h"

#include "compute/vulkan/context.h"
#include "integration/app/chart/front_file.h"
#include "integration/app/chart/peers.h"
#include "integration/studies/feel_section.h"
#include "integration/studies/motion_section.h"
#include "integration/studies/scene_study.h"

namespace palpate::app {
namespace {

/// The pairs to measure on: made first, then real, then the user's own.
Result<std::vector<studies::MotionCase>> pairs_of(const ChartJob& job) {
  std::vector<studies::MotionCase> pairs;
  pairs.push_back(studies::heart_case(job.run.quick ? 64 : 128));
  auto ct = read_known_ct(job.data / "lung");
  if (!ct) return ct.error();
  if (*ct) {
    pairs.push_back(job.run.quick ? studies::halved(**ct) : std::move(**ct));
    if (job.run.quick)
      pairs.back().name =
          "Real chest CT in known motion, halved to " + studies::grid_text(pairs.back().fixed.grid);
  }
  if (job.own) {
    auto own = read_own_pair(*job.own);
    if (!own) return own.error();
    pairs.push_back(std::move(*own));
  }
  return pairs;
}

Result<report::Section> motion(const ChartJob& job) {
  auto pairs = pairs_of(job);
  if (!pairs) return pairs.error();
  std::vector<std::string> missing;
  std::vector<studies::MotionMeasures> measures;
  for (size_t n = 0; n < pairs->size() && !job.run.stop.stop_requested(); ++n) {
    studies::StudyRun part = job.run;
    part.progress = [&](double share, const std::string& doing) {
      job.run.tell((double(n) + share) / double(pairs->size()), doing);
    };
    auto methods = studies::palpate_methods(part);
    missing.clear();
    for (auto& peer : motion_peers(part.quick, missing)) methods.push_back(std::move(peer));
    measures.push_back(studies::measure_motion(part, (*pairs)[n], std::move(methods),
                                               {.peers_back = !part.quick}));
  }
  auto section = studies::motion_section(measures);
  if (!section) return section.error();
  for (const std::string& sentence : missing)
    section->parts.push_back(report::Note{sentence, true});
  // The largest pair that is not the user's own speaks for this machine.
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
  auto measures = studies::measure_view(job.run);
  std::vector<std::string> missing;
  for (auto& row : view_peer(job.run.quick, missing)) measures.push_back(std::move(row));
  return studies::view_section(measures, missing);
}

Result<report::Section> scene(const ChartJob& job) {
  return studies::scene_section(studies::measure_scene(job.run));
}

}  // namespace

const std::vector<ChartStudy>& chart_studies() {
  static const std::vector<ChartStudy> studies = {
      {"motion", "seconds against error: every preset, other settings, other programs", 10.0, true,
       motion},
      {"feel", "microseconds of a haptic frame against its force error", 1.5, true, feel},
      {"view", "milliseconds of a stereo picture against its quality", 2.5, true, view},
      {"scene", "cost against what is in the scene", 1.5, true, scene},
  };
  return studies;
}

}  // namespace palpate::app
