#include "integration/app/feel_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "compute/volume/portable.h"
#include "integration/app/feel_run.h"
#include "integration/app/progress.h"
#include "integration/app/session_flags.h"
#include "module/scene/segment_modes.h"

namespace palpate::app {
namespace {

constexpr charts::Color kForce{0.80, 0.24, 0.16}, kWanted{0.93, 0.69, 0.55},
    kDepth{0.13, 0.42, 0.62}, kPhase{0.25, 0.50, 0.30};

double us(int64_t ns) {
  return double(ns) * 1e-3;
}

std::string cause_line(const CauseTime& cause) {
  const std::string why =
      cause.fault != DeviceFault::kNone ? with_flags(sentence(cause.fault)) : sentence(cause.cause);
  return fmt::format("  {:<15} {:>7.2f} s, first at {:.2f} s: {}\n", word(cause.cause),
                     cause.seconds, cause.from_s, why);
}

/// Intervals of ticks with one cause, except none and the usual start.
std::vector<charts::Span> spans_of(const std::vector<TickRow>& rows) {
  std::vector<charts::Span> spans;
  Cause running = Cause::kNone;
  for (const TickRow& row : rows) {
    if (row.cause != running && row.cause != Cause::kNone)
      spans.push_back({row.time_s, row.time_s, word(row.cause)});
    running = row.cause;
    if (running != Cause::kNone) spans.back().to = row.time_s + row.dt_s;
  }
  return spans;
}

}  // namespace

std::string segment_text(const Segment& segment, const VolumeSpec& volume) {
  const SegmentsSpec& spec = volume.segments;
  std::string text = fmt::format("Segment   {}, colour {:.2g} {:.2g} {:.2g}", segment.name,
                                 segment.colour.r, segment.colour.g, segment.colour.b);
  const auto part = std::find_if(spec.parts.begin(), spec.parts.end(),
                                 [&](const SegmentSpec& of) { return of.name == segment.name; });
  if (part == spec.parts.end()) return text;
  if (!part->felt) return text + ": not felt as a wall";
  text +=
      fmt::format(": a wall of {:.3g} N, {:.4g} N/m", part->strength_n, part->stiffness_n_per_m);
  const glm::dvec3 scale = volume.transform.scale;
  const double size = portable::cube_root(scale.x * scale.y * scale.z);
  const WallHold holds = wall_hold(*segment.distance_mm.front(), *part, size);
  if (holds.force_n < 0.95 * part->strength_n)
    text += fmt::format("; at {} a tenth of it is at most {:.2g} mm thick and holds {:.2g} N",
                        size == 1.0 ? "its own size" : fmt::format("{:.2g} of its size", size),
                        1e3 * holds.thickness_m, holds.force_n);
  return text;
}

std::vector<std::string> scene_lines(const LoadedScene& scene, bool live) {
  std::vector<std::string> lines;
  for (size_t v = 0; v < scene.data.size(); ++v) {
    const MovingVolume& volume = *scene.data[v];
    const size_t frames = volume.times.times_s.size();
    const bool missing =
        std::any_of(scene.missing.begin(), scene.missing.end(),
                    [&](const MissingMotion& motion) { return motion.volume == v; });
    const bool stands = volume.whole && volume.whole->largest_u_m() == 0.0;
    if (live) {
      lines.push_back(
          fmt::format("Volume    {}: live; the first frame stands still until the next "
                      "one comes",
                      volume.name));
      continue;
    }
    std::string motion = ", with its motion";
    if (missing)
      motion = ", still at first: its motion is estimated while you feel it";
    else if (stands)
      motion = fmt::format(", of which frame {} stands still", volume.whole->reference());
    else if (volume.whole)
      motion = fmt::format(", with one motion for all of them: frame {} is carried",
                           volume.whole->reference());
    else if (volume.motions.empty())
      motion = ", frame by frame";
    lines.push_back(fmt::format("Volume    {}: {}", volume.name,
                                frames == 1 ? "one frame, which stands still"
                                            : fmt::format("{} frames in {:.3g} s{}", frames,
                                                          volume.times.length_s(), motion)));
    for (const Segment& segment : volume.segments)
      lines.push_back(segment_text(segment, scene.spec.volumes[v]));
  }
  return lines;
}

std::vector<std::string> notes_of(const LoadedScene& scene) {
  std::vector<std::string> notes;
  for (const Note& note : scene.notes) notes.push_back(note_text(note));
  for (const auto& volume : scene.data)
    if (const auto note = times_note(*volume, !scene.from_sequence))
      notes.push_back(note_text(*note));
  return notes;
}

std::string motion_text(const LiveMotion& motion) {
  if (motion.is_done()) return {};
  const LiveMotion::Progress now = motion.progress();
  const bool begins = !motion.can_move() && motion.finds_whole() && now.steps_known == 0;
  std::string text = now.steps_known == now.steps ? "one motion for the whole sequence"
                     : begins                     ? "coarse motion"
                              : fmt::format("motion {} of {} steps", now.steps_known, now.steps);
  if (motion.has_coarse()) text = "refining: " + text;
  return now.left_s < 0.0 ? text : text + ", " + duration_text(now.left_s) + " left";
}

const char* state_text(const TickOutput& tick) {
  return tick.cause != Cause::kNone ? word(tick.cause)
         : tick.command.in_contact  ? "touching"
                                    : "free";
}

std::string work_text(double hand_work_j) {
  const double size_j = std::abs(hand_work_j);
  return fmt::format("the force did {:.2f} {} of work on the hand{}",
                     size_j < 1.0 ? 1e3 * size_j : size_j, size_j < 1.0 ? "mJ" : "J",
                     hand_work_j < 0.0 ? ", against its motion" : "");
}

std::string live_text(const TickOutput& tick, const ServoStatistics& statistics, double seconds) {
  const uint64_t ticks = statistics.ticks.load();
  const double mean_ns = statistics.period.mean_ns();
  const char* state = state_text(tick);
  return fmt::format(
      "{:7.1f} s  {:5.0f} Hz  {:5.2f} N  phase {:5.2f}  {}{}", seconds,
      mean_ns > 0.0 && ticks > 1 ? 1e9 / mean_ns : 0.0, glm::length(tick.command.force_n),
      tick.first.frame + tick.first.phase, state,
      tick.cause == Cause::kDevice ? fmt::format(": {}", with_flags(sentence(tick.fault))) : "");
}

std::string summary_text(const FeelNumbers& n, const ServoStatistics& statistics,
                         const ServoReport& report, const EnergyLedger& energy) {
  std::string text = fmt::format(
      "\nFelt      {:.1f} s, of which {:.1f} s touching: {:.2f} N on average, {:.2f} N at most,\n"
      "          the hand up to {:.1f} mm behind the surface; no change above {:.3f} N per ms\n",
      n.seconds, n.touched_s, n.mean_force_n, n.most_force_n, 1e3 * n.deepest_m,
      n.steepest_n_per_ms);
  if (n.late_ticks > 0)
    text += fmt::format(
        "          without {} late tick{}: up to {:.1f} ms after the last one, where the force "
        "changed by {:.3f} N at most\n",
        n.late_ticks, n.late_ticks == 1 ? "" : "s", 1e3 * n.latest_s, n.late_change_n);
  if (n.most_newton_steps > 0)
    text += fmt::format(
        "Motion    inverted in {} steps at most, to {:.2g} um; {} ticks with a frozen point\n",
        n.most_newton_steps, 1e6 * n.worst_residual_m, n.frozen);
  text += fmt::format(
      "Energy    the scene gave {:.2f} mJ to the spring and took {:.2f} mJ; {:.2f} mJ were "
      "refused\n"
      "          {}\n",
      1e3 * energy.put_in_j, 1e3 * energy.dissipated_j, 1e3 * energy.refused_j,
      work_text(n.hand_work_j));
  text += fmt::format(
      "Loop      {} ticks; period median {:.0f}, p99.9 {:.0f}, most {:.0f} us\n"
      "          tick median {:.2f}, p99.99 {:.1f} us; device median {:.1f} us; {} periods "
      "missed\n",
      statistics.ticks.load(), us(statistics.period.quantile_ns(0.5)),
      us(statistics.period.quantile_ns(0.999)), us(statistics.period.most_ns()),
      us(statistics.tick.quantile_ns(0.5)), us(statistics.tick.quantile_ns(0.9999)),
      us(statistics.device.quantile_ns(0.5)), statistics.all_misses());
  for (int m = 0; m < kMissCauses; ++m)
    if (const uint64_t misses = statistics.misses[size_t(m)].load())
      text += fmt::format("          {} because of {}\n", misses, word(MissCause(m)));
  text += fmt::format("System    {}", report.kernel);
  for (const ServoReport::Item& item : report.items)
    text += fmt::format("; {}{}", item.obtained ? "" : "no ", item.what);
  text += "\n";
  for (const ServoReport::Item& item : report.items)
    if (!item.obtained) text += "          " + item.sentence + "\n";
  if (!n.causes.empty()) {
    text += "When the force was not the scene's\n";
    for (const CauseTime& cause : n.causes) text += cause_line(cause);
  }
  if (!n.held.empty()) {
    text += "What held the force back\n";
    for (const running::LimiterTime& of : n.held)
      text += fmt::format("  {:<15} {:>7.2f} s, {:.2f} N at most: {}\n", word(of.limiter),
                          of.seconds, of.most_n, sentence(of.limiter));
  }
  return text;
}

std::string tubes_text(const ReleasedTubes& tubes) {
  const auto kept =
      std::count_if(tubes.begin(), tubes.end(), [](const ReleasedTube& tube) { return tube.kept; });
  return fmt::format("Tubes     {} stream tube{}, {} of them kept", tubes.size(),
                     tubes.size() == 1 ? "" : "s", kept);
}

std::string periods_text(const ServoStatistics& statistics) {
  return fmt::format("period median {:.0f}, p99.9 {:.0f}, most {:.0f} us in {} ticks",
                     us(statistics.period.quantile_ns(0.5)),
                     us(statistics.period.quantile_ns(0.999)), us(statistics.period.most_ns()),
                     statistics.ticks.load());
}

nlohmann::json serving_json(const running::ConnectedSession& run, const web::HttpsServer* page) {
  const auto scene = run.session->scene();
  const MovingVolume& first = *scene->volumes.front().data;
  nlohmann::json json = {{"event", "serving"},
                         {"volume", first.name},
                         {"frames", first.times.times_s.size()},
                         {"length_s", first.times.length_s()},
                         {"live", run.live != nullptr}};
  if (run.server) json["port"] = run.server->port();
  if (page) {
    json["page"] = page->page_addresses();
    json["page_sha256"] = page->fingerprint();
  }
  return json;
}

nlohmann::json served_json(const running::ConnectedSession& run) {
  nlohmann::json json = {{"event", "ended"}};
  if (run.server) {
    json["messages_sent"] = run.server->server().sent();
    json["messages_missed"] = run.server->server().missed();
  }
  if (run.live) {
    const openigtlink::ClientNumbers& arrived = run.live->arrived();
    const LiveNumbers numbers = run.live->numbers();
    json["live"] = {{"images", arrived.images},
                    {"transforms", arrived.transforms},
                    {"refused", arrived.refused},
                    {"followed", numbers.felt},
                    {"delay_median_s", numbers.delay_median_s},
                    {"cycle_s", numbers.cycle_s}};
  }
  return json;
}

charts::Timeline feel_timeline(const std::string& title, const FeelNumbers& n,
                               const std::vector<TickRow>& rows) {
  charts::Timeline timeline;
  timeline.title = title;
  timeline.subtitle = fmt::format(
      "{:.1f} s, {:.1f} s touching: {:.2f} N on average, {:.2f} N at most, up to {:.1f} mm deep",
      n.seconds, n.touched_s, n.mean_force_n, n.most_force_n, 1e3 * n.deepest_m);
  charts::Strip force{
      "force, N", {{"the scene's", {}, kWanted}, {"to the hand", {}, kForce, 2.0}}, spans_of(rows)};
  charts::Strip depth{"behind the surface, mm", {{"", {}, kDepth, 2.0}}, {}};
  charts::Strip phase{"frame and phase", {{"", {}, kPhase, 1.6}}, {}};
  force.share = 2.0;
  phase.share = 0.6;
  double last = rows.empty() ? 0.0 : rows.front().pointer;
  bool moves = false;
  for (const TickRow& row : rows) {
    timeline.x.push_back(row.time_s);
    force.curves[0].values.push_back(glm::length(row.wanted_n));
    force.curves[1].values.push_back(glm::length(row.force_n));
    depth.curves[0].values.push_back(1e3 * glm::distance(row.probe_m, row.proxy_m));
    // No line is drawn from the last frame back to the first.
    const bool turned = std::abs(row.pointer - last) > 0.9;
    phase.curves[0].values.push_back(turned ? std::nan("") : row.pointer);
    moves |= row.pointer != last;
    last = row.pointer;
  }
  force.low = depth.low = 0.0;
  timeline.strips = {force, depth};
  if (moves) timeline.strips.push_back(phase);
  return timeline;
}

Status write_feel_picture(const std::string& path, const std::string& title,
                          const FeelNumbers& numbers, const std::vector<TickRow>& rows) {
  return charts::write_timeline(path, feel_timeline(title, numbers, rows));
}

}  // namespace palpate::app
