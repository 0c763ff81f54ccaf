// The main task on real data: a hand rests on, strokes and circles a beating heart's wall. Places
// on the walls of heart_cine, of the breathing CT and of the heart phantom, with each way of
// feeling them: which hold, which do not, how fast the force changes, how far the felt wall is from
// the contours. A heart is also felt as by the program: without options, with segments, and as a
// scene. Deterministic except for the times: the ticks are called directly.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "integration/app/exit_code.h"
#include "integration/app/option_checks.h"
#include "integration/app/progress.h"
#include "integration/files/atomic_file.h"
#include "tests/lab/bench/hearts_runs.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/rows.h"
#include "tests/lab/report/page.h"
#include "tests/lab/report/plot.h"
#include "tests/lab/studies/measuring.h"

namespace palpate::app {
namespace {

using namespace palpate::bench;
namespace fs = std::filesystem;

/// The exit status by which ctest marks a test as skipped: data are missing.
constexpr int kExitSkipped = 77;

struct HeartCase {
  int beats = 10;
  int way_places = 12;  ///< of each wall, for strokes and circles
  double way_s = 5.0;
};

struct HeartsCommand {
  HeartsOptions options;
  HeartCase how;
  std::string only, felt_only;
  fs::path page;
  RowFiles rows;
  bool quick = false, verbose = false;
  std::vector<fs::path> walls;
};

struct PlaceResult {
  const Place* place;
  RunResult still, moving;
  /// The same path over the material while this stands still; only if the place did not hold.
  RunResult control;
  /// In motion; of the first places only.
  std::map<Way, RunResult> along;
};

struct WayResult {
  int runs = 0, fell = 0, faded = 0, met = 0;
  /// Share of the time, in all runs that met the wall.
  double weak = 0.0;
  /// Share of the time with a wall under the hand, in all runs that met it.
  double kept = 0.0;
  LargestChange change;
};

struct WallResult {
  std::string subject, wall, felt;
  const std::optional<report::Backdrop>* picture;
  std::vector<PlaceResult> places;
  std::map<Way, WayResult> ways;
  LargestChange change;
  /// Distances from the contours.
  std::vector<double> proxy_mm, carried_mm;
  /// Why others do not hold: in the control they hold, or they do not either.
  int by_motion = 0, by_wall = 0;
  /// Places that hold: on the still volume, and also in motion.
  int still = 0, both = 0;
};

void take(LargestChange& most, const LargestChange& one) {
  const double beyond_n = std::max(most.beyond_n, one.beyond_n);
  if (one.n_per_ms > most.n_per_ms) most = one;
  most.beyond_n = beyond_n;
}

std::string told(const LargestChange& change) {
  return fmt::format(
      "{:.3f} N, {:.3f} of it the hand's own way{}{}{}", change.n_per_ms,
      std::min(change.by_hand_n, change.n_per_ms), change.cause == Cause::kNone ? "" : ", ",
      change.cause == Cause::kNone ? "" : palpate::word(change.cause), change.held ? ", held" : "");
}

double mean(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x;
  return v.empty() ? std::nan("") : sum / double(v.size());
}
double p95(std::vector<double> v) {
  if (v.empty()) return std::nan("");
  std::sort(v.begin(), v.end());
  return v[size_t(0.95 * double(v.size() - 1))];
}

WallResult measure(const Subject& subject, const Wall& wall, const Felt& felt, const HeartCase& how,
                   Histogram& ticks) {
  WallResult result{
      subject.name, wall.name, felt.name, &wall.picture, {}, {}, {}, {}, {}, 0, 0, 0, 0};
  const double cycle_s = felt.volume->times.cycle_s;
  const double hold_s = std::min(how.beats * cycle_s, 12.0);
  for (const Place& place : wall.places) {
    PlaceResult one{&place, lean_on(subject, wall, felt, false, place, Way::kHold, 2.0), {}, {}};
    one.moving = lean_on(subject, wall, felt, true, place, Way::kHold, hold_s, &ticks);
    take(result.change, one.still.change);
    take(result.change, one.moving.change);
    if (one.still.outcome == Outcome::kHeld) {
      ++result.still;
      result.both += one.moving.outcome == Outcome::kHeld;
      if (one.moving.outcome != Outcome::kHeld && subject.whole) {
        one.control = lean_on(subject, wall, felt, false, place, Way::kHold, hold_s, nullptr,
                              &one.moving.meant);
        ++(one.control.outcome == Outcome::kHeld ? result.by_motion : result.by_wall);
      }
    }
    if (!wall.contours_mm.empty())
      for (const auto& [frame, at] : one.moving.proxies)
        result.proxy_mm.push_back(std::abs(wall.contours_mm[size_t(frame)]->scalar(at)));
    result.places.push_back(std::move(one));
  }
  if (felt.segments && felt.volume->whole)
    for (size_t k = 0; k < wall.contours_mm.size(); ++k)
      for (const glm::dvec3 x : wall.surface_m) {
        const auto time = felt.volume->whole->basis().at(int(k), 0.0);
        const glm::dvec3 now = x + felt.volume->whole->displacement(x, time);
        result.carried_mm.push_back(std::abs(wall.contours_mm[k]->scalar(now)));
      }
  for (const Way way : {Way::kStroke, Way::kCircle}) {
    WayResult& of = result.ways[way];
    for (size_t p = 0; p < std::min(wall.places.size(), size_t(how.way_places)); ++p) {
      const RunResult run =
          lean_on(subject, wall, felt, true, wall.places[p], way, how.way_s, &ticks);
      ++of.runs;
      of.met += run.outcome != Outcome::kNothingMet;
      of.fell += run.outcome == Outcome::kFell;
      of.faded += run.outcome == Outcome::kFaded;
      of.weak += run.weak;
      if (run.outcome != Outcome::kNothingMet) of.kept += 1.0 - run.absent;
      take(of.change, run.change);
      take(result.change, run.change);
      result.places[p].along[way] = run;
    }
    if (of.met > 0) of.weak /= of.met, of.kept /= of.met;
  }
  return result;
}

size_t bytes_per_voxel(const MovingVolume& volume) {
  const auto samples = [](const FrameData& frame) { return frame.samples().values.size(); };
  const double voxels = double(std::max<size_t>(1, samples(*volume.frames.front())));
  double bytes = 0.0;
  for (const auto& frame : volume.frames) bytes += 4.0 * double(samples(*frame));
  for (const Segment& segment : volume.segments)
    for (const auto& frame : segment.distance_mm) bytes += 4.0 * double(samples(*frame));
  for (const Motion& motion : volume.motions)
    for (const auto& step : motion.steps)
      if (step) bytes += double(step->bytes());
  if (volume.whole) bytes += double(volume.whole->bytes());
  return size_t(std::lround(bytes / voxels));
}

report::Figure map_of(const WallResult& of) {
  report::Chart chart;
  chart.title = of.subject + ", " + of.wall + ": " + of.felt;
  if (const auto& picture = *of.picture) {
    chart.x = {"towards the patient's left (mm)", false, picture->left, picture->right};
    chart.y = {"upwards (mm)", false, picture->bottom, picture->top};
    chart.behind = picture;
    chart.height_px = 560;
  } else {
    chart.x = {"angle about the wall's axis, from the hand's side (degrees)"};
    chart.y = {"along the axis (mm)"};
    chart.x.low = -180.0;
    chart.x.high = 180.0;
    chart.height_px = 360;
  }
  struct PlaceKind {
    const char* name;
    report::Mark mark;
    int colour;
  };
  if (*of.picture) {
    const Place& own = *of.places.front().place;
    chart.series.push_back({"palpate's own place",
                            {{own.x, own.y, "", false}},
                            report::Line::kNone,
                            report::Mark::kRing,
                            7});
  }
  const std::map<Outcome, PlaceKind> kinds = {
      {Outcome::kHeld, {"held", report::Mark::kCircle, 2}},
      {Outcome::kLeft, {"left by the wall", report::Mark::kTriangle, 4}},
      {Outcome::kFaded, {"weaker for a time", report::Mark::kSquare, 0}},
      {Outcome::kFell, {"fell", report::Mark::kCross, 1}},
      {Outcome::kNothingMet, {"no surface there", report::Mark::kDown, 6}}};
  for (const auto& [outcome, kind] : kinds) {
    report::Series series{kind.name, {}, report::Line::kNone, kind.mark, kind.colour};
    for (const PlaceResult& place : of.places) {
      if (place.moving.outcome != outcome) continue;
      std::string detail = fmt::format("least {:.2f} N, largest change {}", place.moving.least_n,
                                       told(place.moving.change));
      for (const auto& [way, run] : place.along)
        detail += fmt::format("\n{}: {}, {:.0f} % of the time on the wall", bench::word(way),
                              bench::word(run.outcome), 100.0 * (1.0 - run.absent));
      series.points.push_back({place.place->x, place.place->y,
                               fmt::format("still: {}", bench::word(place.still.outcome)), false,
                               detail});
    }
    if (!series.points.empty()) chart.series.push_back(std::move(series));
  }
  report::Figure figure{chart.title, "", "", {}};
  std::string id = report::file_stem(chart.title);
  std::erase(id, '-');
  const auto svg = report::drawn(chart, id);
  if (!svg) throw studies::Mismatch(svg.error().message);
  figure.svg = *svg;
  figure.caption = fmt::format("{} of {} places that hold on the still volume hold in motion.",
                               of.both, of.still);
  figure.data.title = chart.title;
  figure.data.columns = {{"angle_deg", "angle"},       {"along_mm", "along, mm"},
                         {"still", "still"},           {"moving", "moving"},
                         {"least_n", "least N"},       {"change", "N/ms"},
                         {"deepest_mm", "deepest mm"}, {"fell_at_s", "fell at s"}};
  if (*of.picture)
    figure.data.columns[0] = {"left_mm", "left, mm"}, figure.data.columns[1] = {"up_mm", "up, mm"};
  for (const PlaceResult& p : of.places)
    figure.data.rows.push_back(
        {report::number(p.place->x, 1), report::number(p.place->y, 1),
         report::words(bench::word(p.still.outcome)), report::words(bench::word(p.moving.outcome)),
         report::number(p.moving.least_n, 2), report::number(p.moving.change.n_per_ms, 3),
         report::number(p.moving.deepest_mm, 2), report::number(p.moving.fell_at_s, 2)});
  return figure;
}

report::Table empty_table() {
  return {"A hand on moving walls",
          "",
          {{"subject", "subject"},
           {"wall", "wall"},
           {"felt", "felt by"},
           {"places", "places"},
           {"still", "hold still"},
           {"moving", "of these in motion"},
           {"why", "others: wall/motion"},
           {"fell", "press: fell"},
           {"stroke_fell", "strokes fell (time behind, below 0.3 N)"},
           {"circle_fell", "circles fell (time behind, below 0.3 N)"},
           {"change", "largest change N/ms"},
           {"beyond", "more than the hand's own"},
           {"proxy_mm", "off the contour mm"},
           {"proxy_p95", "p95"},
           {"carried_mm", "all of the wall mm"},
           {"carried_p95", "p95"},
           {"tick_us", "tick us"},
           {"tail_us", "p99.99 us"},
           {"bytes", "B/voxel"}},
          {}};
}

std::vector<report::Cell> row_of(const WallResult& of, int fell, const Histogram& ticks,
                                 size_t bytes) {
  const auto way = [&](Way which) {
    const WayResult& result = of.ways.at(which);
    return report::words(
        fmt::format("{} of {} ({:.0f} %)", result.fell, result.met, 100.0 * result.weak));
  };
  return {report::words(of.subject),
          report::words(of.wall),
          report::words(of.felt),
          report::number(double(of.places.size()), 0),
          report::number(of.still, 0),
          report::number(of.both, 0),
          report::words(fmt::format("{}/{}", of.by_wall, of.by_motion)),
          report::number(fell, 0),
          way(Way::kStroke),
          way(Way::kCircle),
          report::number(of.change.n_per_ms, 3),
          report::number(of.change.beyond_n, 3),
          report::number(mean(of.proxy_mm), 2),
          report::number(p95(of.proxy_mm), 2),
          report::number(mean(of.carried_mm), 2),
          report::number(p95(of.carried_mm), 2),
          report::number(1e-3 * double(ticks.quantile_ns(0.5)), 2),
          report::number(1e-3 * double(ticks.quantile_ns(0.9999)), 1),
          report::number(double(bytes), 0)};
}

void print_places(const WallResult& of) {
  for (const PlaceResult& p : of.places) {
    std::string causes;
    for (size_t c = 1; c < p.moving.causes.size(); ++c)
      if (p.moving.causes[c])
        causes += fmt::format(" {} {}", palpate::word(Cause(c)), p.moving.causes[c]);
    fmt::print(
        "{} {:.1f} {}: still {} {:.2f} N; moving {} least {:.2f} mean {:.2f} N deepest {:.2f} mm, "
        "at {:.2f} s, control {}; change {} at {:.2f} s;{}\n",
        of.wall, p.place->x, of.felt, bench::word(p.still.outcome), p.still.least_n,
        bench::word(p.moving.outcome), p.moving.least_n, p.moving.mean_n, p.moving.deepest_mm,
        p.moving.fell_at_s, bench::word(p.control.outcome), told(p.moving.change),
        p.moving.change.at_s, causes);
  }
}

report::Table empty_table_as_felt() {
  return {"A real heart as palpate feels it",
          "Own place: the one that palpate chooses. In %: the share of the time with at least 0.3 "
          "N, also "
          "where the hand is beside the heart.",
          {{"felt", "felt by"},
           {"own_press", "own place: press %"},
           {"own_stroke", "stroke %"},
           {"own_circle", "circle %"},
           {"places", "places"},
           {"presses", "presses held"},
           {"strokes", "strokes %"},
           {"circles", "circles %"},
           {"runs", "runs"},
           {"fell", "fell"},
           {"change", "largest change N/ms"},
           {"beyond", "more than the hand's own"},
           {"contour_p95", "off the contour, p95 mm"}},
          {}};
}

std::vector<report::Cell> row_as_felt(const WallResult& of) {
  const auto share = [](double kept) { return report::number(100.0 * kept, 0); };
  int runs = 0, fell = 0, held = 0;
  for (const PlaceResult& p : of.places) {
    ++runs;
    held += p.moving.outcome == Outcome::kHeld;
    fell += p.moving.outcome == Outcome::kFell;
  }
  for (const auto& [way, result] : of.ways) runs += result.runs, fell += result.fell;
  const PlaceResult& own = of.places.front();
  return {report::words(of.felt),
          share(1.0 - own.moving.absent),
          share(1.0 - own.along.at(Way::kStroke).absent),
          share(1.0 - own.along.at(Way::kCircle).absent),
          report::number(double(of.places.size()), 0),
          report::number(held, 0),
          share(of.ways.at(Way::kStroke).kept),
          share(of.ways.at(Way::kCircle).kept),
          report::number(runs, 0),
          report::number(fell, 0),
          report::number(of.change.n_per_ms, 3),
          report::number(of.change.beyond_n, 3),
          of.proxy_mm.empty() ? report::words("-") : report::number(p95(of.proxy_mm), 2)};
}

/// Whether a wall is felt in this way: some walls are the surface of one way only, and a way with a
/// wall of its own does not feel the others.
bool is_felt(const Subject& subject, const Wall& wall, const Felt& felt) {
  if (!wall.only.empty()) return wall.only == felt.name;
  const bool has_own = std::any_of(subject.walls.begin(), subject.walls.end(),
                                   [&](const Wall& w) { return w.only == felt.name; });
  return !(has_own && felt.segments);
}

/// Adds a subject's rows and maps. Returns how often the hand passed through a segmentation's wall,
/// or a press did not hold at the place that palpate itself chooses.
int measure_subject(const HeartsCommand& command, const Subject& subject, report::Table& table,
                    report::Table& as_felt, report::Page& page) {
  report::Section section{report::file_stem(subject.name), subject.name, "", {}};
  int falls = 0;
  for (const Felt& felt : subject.felt) {
    if (felt.name.find(command.felt_only) == std::string::npos) continue;
    for (const Wall& wall : subject.walls) {
      if (!is_felt(subject, wall, felt)) continue;
      Histogram ticks;
      const WallResult of = measure(subject, wall, felt, command.how, ticks);
      int fell = 0;
      for (const PlaceResult& p : of.places) fell += p.moving.outcome == Outcome::kFell;
      if (felt.spec)
        falls += of.places.front().moving.outcome != Outcome::kHeld;
      else if (felt.segments)
        falls += fell + of.ways.at(Way::kStroke).fell + of.ways.at(Way::kCircle).fell;
      table.rows.push_back(row_of(of, fell, ticks, bytes_per_voxel(*felt.volume)));
      if (felt.spec) {
        as_felt.rows.push_back(row_as_felt(of));
        const auto held =
            std::count_if(of.places.begin(), of.places.end(),
                          [](const PlaceResult& p) { return p.moving.outcome == Outcome::kHeld; });
        section.answer += fmt::format(
            "{}{}: {} of {} presses hold; on a wall in {:.0f} % of strokes "
            "and {:.0f} % of circles.",
            section.answer.empty() ? "" : " ", of.felt, held, of.places.size(),
            100.0 * of.ways.at(Way::kStroke).kept, 100.0 * of.ways.at(Way::kCircle).kept);
      }
      if (command.verbose) print_places(of);
      if (!command.page.empty()) section.parts.push_back(map_of(of));
    }
  }
  page.sections.push_back(std::move(section));
  return falls;
}

int run(const HeartsCommand& command) {
  Console console(false, false);
  for (const fs::path& file : command.walls) fmt::print("{}", walls_in({file}));
  if (!command.walls.empty()) return kExitOk;
  if (const fs::path cine = command.options.shared / "heart_cine"; !fs::exists(cine)) {
    console.say(fmt::format("There is no {}: skipped", cine.string()));
    return kExitSkipped;
  }
  Status can = check_can_write(command.rows);
  if (can && !command.page.empty()) can = files::check_can_write_file(command.page);
  if (!can) return fail(console, can.error());
  report::Page page;
  page.title = "A hand on moving walls";
  page.lead =
      "Where a hand that leans on a wall with 1 N is held while the wall moves. On a heart as felt "
      "the "
      "hand means to be 14 mm behind the wall, and strokes and circles by 8 mm, as the simulated "
      "hand of "
      "palpate feel.";
  page.conditions = {{"Motion", command.options.preset},
                     {"Places on each wall",
                      fmt::format("{}; strokes and circles at {}", command.options.places,
                                  std::min(command.options.places, command.how.way_places))},
                     {"Beats for each press", fmt::format("{}", command.how.beats)}};
  int falls = 0;
  using Make = Subject (*)(const HeartsOptions&);
  const std::pair<const char*, Make> subjects[] = {{"felt", &heart_as_felt},
                                                   {"heart", &beating_heart},
                                                   {"lung", &breathing_lung},
                                                   {"phantom", &heart_phantom_subject}};
  Rows rows("hearts", nullptr);
  report::Table as_felt = empty_table_as_felt();
  rows.add([&] {
    report::Table all = empty_table();
    for (const auto& [name, make] : subjects)
      if (command.only.empty() || command.only == name)
        falls += measure_subject(command, make(command.options), all, as_felt, page);
    return all;
  });
  if (!as_felt.rows.empty()) rows.add([&] { return as_felt; });
  if (!command.page.empty()) {
    report::Section section{"all", "All walls", "", {}};
    if (!as_felt.rows.empty()) section.parts.push_back(report::TablePart{as_felt, false});
    section.parts.push_back(report::TablePart{rows.tables().front(), true});
    page.sections.insert(page.sections.begin(), std::move(section));
    if (const Status written = files::write_text(command.page, report::html(page)); !written)
      return fail(console, written.error());
  }
  if (const Status written = rows.write(command.rows); !written)
    return fail(console, written.error());
  return falls > 0 ? kExitInternal : kExitOk;
}

}  // namespace

Command add_hearts(CLI::App& program) {
  auto command = std::make_shared<HeartsCommand>();
  command->options.shared = "../shared/data";
  CLI::App* app = program.add_subcommand(
      "hearts",
      "Lean a hand on real beating hearts: what holds, what does not, and why. Fails if the\n"
      "wall of a segmentation lets the hand through, or a press at the place that palpate itself\n"
      "chooses; 77 if the data are not there");
  app->add_option("--data", command->options.shared, "Folder with heart_cine/ and lung/")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--keep", command->options.keep, "Keep estimated motions here between runs")
      ->type_name("DIR");
  app->add_option("--preset", command->options.preset, "Of the motion")
      ->check(one_of_the_presets())
      ->capture_default_str();
  app->add_option("--places", command->options.places, "On each wall")
      ->check(whole_number_in(1, 10000))
      ->capture_default_str();
  app->add_option("--only", command->only, "One subject")
      ->check(one_of({"felt", "heart", "lung", "phantom"}));
  app->add_option("--felt", command->felt_only, "Only ways to feel whose name contains this");
  app->add_option("--page", command->page, "The maps and tables as HTML")->type_name("FILE");
  app->add_option("--level", command->options.level, "Feel this value's surface, not Otsu's");
  app->add_option("--walls", command->walls,
                  "Only tell what the surfaces found in these files are as walls")
      ->type_name("FILE")
      ->check(an_existing_path());
  app->add_flag("--quick", command->quick,
                "The segmentation of the heart (or what --only says), few places, fast motion");
  app->add_flag("--each-place", command->verbose, "A line for each place");
  add_row_options(*app, command->rows);
  Command result{app,
                 [command] {
                   if (command->quick) {
                     command->options.preset = "fast";
                     command->options.places = 6;
                     command->how = {2, 2, 2.0};
                     if (command->only.empty()) command->only = "heart";
                     if (command->only == "heart") command->felt_only = "segmentation";
                   }
                   return measured([&] { return run(*command); });
                 },
                 {"--data", "--walls"},
                 row_outputs(),
                 {}};
  result.writes.emplace_back("--page");
  return result;
}

}  // namespace palpate::app
