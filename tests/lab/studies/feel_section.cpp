#include "tests/lab/studies/feel_section.h"

#include <algorithm>

#include <fmt/format.h>

#include "tests/lab/report/plot.h"
#include "tests/lab/studies/fit.h"

namespace palpate::studies {
namespace {

using report::Mark;
using report::number;
using report::Series;
using report::words;

constexpr const char* kOurs = "palpate";
constexpr const char* kPaper = "the paper's loop";
constexpr double kPeriodUs = 1000.0;

/// Table I of Lundin Palmerius et al. 2008, microseconds on their two Xeons of 2 GHz.
constexpr double kPaperStillUs = 36.0, kPaperTransformsUs = 45.0, kPaperBothUs = 660.0;

std::vector<FeelSetting> settings_of(bool quick) {
  std::vector<FeelSetting> settings = {
      {"static", kOurs, false, Moves::kNothing},
      {"transforms", kOurs, false, Moves::kTransform},
      {"transforms and moving data", kOurs, false, Moves::kBoth},
      {"static", kPaper, true, Moves::kNothing, BackTracking::kPicard},
      {"transforms", kPaper, true, Moves::kTransform, BackTracking::kPicard},
      {"transforms and moving data", kPaper, true, Moves::kBoth, BackTracking::kPicard},
      {"fixed point", "palpate, other settings", false, Moves::kBoth, BackTracking::kPicard}};
  for (const double field_mm : {2.0, 4.0, 8.0})
    settings.push_back({fmt::format("field of {:g} mm", field_mm), "palpate, other settings", false,
                        Moves::kBoth, BackTracking::kNewton, 1.0, field_mm});
  if (!quick)
    settings.push_back({"data and field of 2 mm", "palpate, other settings", false, Moves::kBoth,
                        BackTracking::kNewton, 2.0, 2.0});
  return settings;
}

const FeelMeasure* find(const FeelMeasures& all, const std::string& family,
                        const std::string& name) {
  for (const FeelMeasure& m : all.settings)
    if (m.setting.family == family && m.setting.name == name) return &m;
  return nullptr;
}

report::Table settings_table(const FeelMeasures& all) {
  report::Table table{
      "One haptic frame and its force",
      "A sphere of data at 1 mm, stroked at up to 100 mm/s; its exact force is known at every "
      "moment. The paper's own times (its Table I): 36, 45 and 660 us on two Xeons of 2 GHz.",
      {{"family", "loop"},
       {"setting", "scene"},
       {"median_us", "median, us"},
       {"p99_us", "99 %, us"},
       {"force_error_rms_n", "force error RMS, N"},
       {"force_error_most_n", "most, N"},
       {"field_megabytes", "fields, MB"},
       {"paper_us", "the paper's machine, us"}},
      {}};
  for (const FeelMeasure& m : all.settings) {
    const bool paper = m.setting.paper;
    const double there = m.setting.moves == Moves::kNothing     ? kPaperStillUs
                         : m.setting.moves == Moves::kTransform ? kPaperTransformsUs
                                                                : kPaperBothUs;
    table.rows.push_back({words(m.setting.family), words(m.setting.name), number(m.median_us, 2),
                          number(m.p99_us, 2), number(m.rms_n, 4), number(m.most_n, 3),
                          number(m.field_megabytes, 1),
                          paper ? number(there, 0) : report::nothing()});
  }
  return table;
}

Result<report::Part> force_figure(const FeelMeasures& all) {
  report::Chart chart;
  chart.title = "Force error against the time of a haptic frame";
  chart.x = {"One haptic frame, median (us)", true, {}, {}};
  chart.y = {"Force error, root mean square (N)", true, {}, {}};
  for (const FeelMeasure& m : all.settings) {
    auto found = std::find_if(chart.series.begin(), chart.series.end(),
                              [&](const Series& s) { return s.name == m.setting.family; });
    if (found == chart.series.end())
      found = chart.series.insert(chart.series.end(), Series{m.setting.family, {}, {}, {}, {}});
    found->points.push_back({m.median_us, m.rms_n, m.setting.name, true,
                             fmt::format("{}\n{:.2f} us, {:.4f} N RMS, {:.3f} N at most",
                                         m.setting.family, m.median_us, m.rms_n, m.most_n)});
  }
  auto svg = drawn(chart, "feelforce");
  if (!svg) return svg.error();
  return report::Part(report::Figure{
      chart.title, std::move(*svg),
      "Both loops are built from the same parts and run in turn on this machine. A frame may take "
      "1000 us. The paper's loop needs a soft surface; each is held against its own exact force.",
      settings_table(all)});
}

Result<report::Part> inversion_figure(const FeelMeasures& all) {
  report::Chart chart;
  chart.title = "Inverting the motion: fixed point against Newton";
  chart.x = {"One inversion (us)", true, {}, {}};
  // Below a femtometre it is rounding.
  chart.y = {"What is left, root mean square (um)", true, 1e-9, {}};
  Series picard{"the paper's fixed point, by steps", {}, report::Line::kStraight, Mark::kCircle, 1};
  report::Table table{
      chart.title,
      "",
      {{"method", "method"}, {"steps", "steps"}, {"time_us", "us"}, {"left_um", "left, um"}},
      {}};
  const auto add = [&](Series& series, const char* method, const InversionMeasure& m) {
    series.points.push_back({m.time_us, m.residual_um,
                             fmt::format("{} step{}", m.steps, m.steps == 1 ? "" : "s"), true});
    table.rows.push_back(
        {words(method), number(m.steps, 0), number(m.time_us, 3), number(m.residual_um, 6)});
  };
  for (const InversionMeasure& m : all.picard) add(picard, "fixed point", m);
  Series newton{"palpate's Newton", {}, {}, Mark::kSquare, 0};
  add(newton, "Newton", all.newton);
  chart.series = {picard, newton};
  auto svg = drawn(chart, "feelinversion");
  if (!svg) return svg.error();
  return report::Part(report::Figure{
      chart.title, std::move(*svg),
      "At seeded places of the beating heart's field, late in a step, where the motion is longest.",
      table});
}

Result<report::Part> load_figure(const FeelMeasures& all) {
  report::Chart chart;
  chart.title = "Modes and volumes";
  chart.x = {"Modes altogether (1)", false, 0.0, {}};
  chart.y = {"One haptic frame, median (us)", false, 0.0, {}};
  report::Table table{
      chart.title, "", {{"volumes", "volumes"}, {"modes", "modes"}, {"median_us", "us"}}, {}};
  for (const auto& load : all.loads) {
    const std::string name =
        load.volumes == 1 ? "1 volume" : fmt::format("{} volumes", load.volumes);
    auto found = std::find_if(chart.series.begin(), chart.series.end(),
                              [&](const Series& s) { return s.name == name; });
    if (found == chart.series.end())
      found = chart.series.insert(chart.series.end(),
                                  Series{name, {}, report::Line::kStraight, {}, {}});
    found->points.push_back(
        {double(load.modes), load.median_us, fmt::format("{:.2f} us", load.median_us)});
    table.rows.push_back(
        {number(load.volumes, 0), number(load.modes, 0), number(load.median_us, 2)});
  }
  auto svg = drawn(chart, "feelload");
  if (!svg) return svg.error();
  return report::Part(report::Figure{
      chart.title, std::move(*svg),
      "Beating hearts of 128^3 voxels whose transforms move too; every second mode guides along "
      "the gradient, the others are walls.",
      table});
}

}  // namespace

FeelMeasures measure_feel(const StudyRun& run) {
  FeelMeasures all;
  const auto settings = settings_of(run.quick);
  const int strokes = run.quick ? 1 : 10, places = run.quick ? 5000 : 20000;
  const auto more = [&] { return !run.stop.stop_requested(); };
  for (size_t n = 0; n < settings.size() && more(); ++n) {
    run.tell(0.6 * double(n) / double(settings.size()), "feel: " + settings[n].name);
    all.settings.push_back(feel(settings[n], strokes));
  }
  run.tell(0.6, "feel: inverting the motion");
  for (const int steps : {1, 2, 4, 8, 16, 32})
    if (more()) all.picard.push_back(picard_inversion(steps, places));
  all.newton = newton_inversion(places);
  for (const int volumes : {1, 2, 4}) {
    for (const int modes : {1, 2, 4, 8}) {
      if (!more() || modes % volumes != 0) continue;
      run.tell(0.7 + 0.05 * volumes + 0.01 * modes, "feel: modes and volumes");
      all.loads.push_back(
          {volumes, modes,
           hearts_us(volumes, modes / volumes, Moves::kBoth, run.quick ? 4000 : 40000)});
    }
  }
  return all;
}

std::vector<std::string> feel_sentences(const FeelMeasures& all) {
  std::vector<std::string> sentences;
  const auto* still = find(all, kOurs, "static");
  const auto* transforms = find(all, kOurs, "transforms");
  const auto* both = find(all, kOurs, "transforms and moving data");
  const auto* paper = find(all, kPaper, "transforms and moving data");
  if (still && transforms && both) {
    sentences.push_back(
        fmt::format("Where a hand strokes a shell, a haptic frame takes {:.2g} us for still data, "
                    "{:.2g} us with a moving transform, and {:.2g} us when the data move too: "
                    "{:.2g} % of the millisecond that it may take.",
                    still->median_us, transforms->median_us, both->median_us,
                    100.0 * both->median_us / kPeriodUs));
  }
  if (both && paper) {
    const bool less = both->rms_n <= paper->rms_n;
    sentences.push_back(fmt::format(
        "With moving data its force is off by {:.2g} N (root mean square), the paper's loop by "
        "{:.2g} N in {:.2g} us: palpate has {:.2g} times {} error.",
        both->rms_n, paper->rms_n, paper->median_us,
        less ? paper->rms_n / both->rms_n : both->rms_n / paper->rms_n, less ? "less" : "more"));
  }
  if (both) {
    // The coarsest field that increases the error of the force by a tenth at most.
    const FeelMeasure* coarse = nullptr;
    for (const FeelMeasure& m : all.settings)
      if (m.setting.data_mm == both->setting.data_mm &&
          m.setting.field_mm > both->setting.field_mm && m.rms_n <= 1.1 * both->rms_n &&
          (!coarse || m.setting.field_mm > coarse->setting.field_mm))
        coarse = &m;
    sentences.push_back(
        coarse
            ? fmt::format("A field of {:g} mm does as well as one of {:g} mm: {:.2g} N in {:.2g} "
                          "us, and {:.2g} MB instead of {:.2g} MB.",
                          coarse->setting.field_mm, both->setting.field_mm, coarse->rms_n,
                          coarse->median_us, coarse->field_megabytes, both->field_megabytes)
            : fmt::format("No field coarser than {:g} mm gives as exact a force.",
                          both->setting.field_mm));
  }
  if (!all.picard.empty() && all.newton.time_us > 0.0) {
    const auto as_good =
        std::find_if(all.picard.begin(), all.picard.end(), [&](const InversionMeasure& m) {
          return m.residual_um <= std::max(all.newton.residual_um, 0.001);
        });
    sentences.push_back(
        as_good == all.picard.end()
            ? fmt::format(
                  "Newton inverts the motion to within {:.2g} um in {} steps; {} steps of the "
                  "fixed point leave {:.2g} um.",
                  all.newton.residual_um, all.newton.steps, all.picard.back().steps,
                  all.picard.back().residual_um)
            : fmt::format(
                  "Newton inverts the motion to within {:.2g} um in {} steps and {:.2g} us; the "
                  "fixed point needs {} steps or fewer and {:.2g} us to come within a "
                  "nanometre or as near.",
                  all.newton.residual_um, all.newton.steps, all.newton.time_us, as_good->steps,
                  as_good->time_us));
  }
  std::vector<std::pair<double, double>> one;
  for (const auto& load : all.loads)
    if (load.volumes == 1) one.emplace_back(load.modes, load.median_us);
  if (one.size() > 1)
    sentences.push_back(fmt::format("Each further mode on a moving volume adds {:.2g} us.",
                                    line_through(one).slope));
  return sentences;
}

Result<report::Section> feel_section(const FeelMeasures& all) {
  report::Section section{"feel", "Feel: microseconds against force error", "", {}};
  for (const std::string& sentence : feel_sentences(all))
    section.answer += (section.answer.empty() ? "" : " ") + sentence;
  for (const auto& make : {force_figure, inversion_figure, load_figure}) {
    auto part = make(all);
    if (!part) return part.error();
    section.parts.push_back(std::move(*part));
  }
  section.parts.insert(section.parts.begin() + 1, report::TablePart{settings_table(all), false});
  return section;
}

}  // namespace palpate::studies
