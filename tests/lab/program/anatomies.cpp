// How accurate settings of the motion engine are on data that were not used to choose them: every
// pair with known motion (kit, lung, synthetic), every preset and every candidate setting. Then,
// for each anatomy the result of a choice between the candidates that was made on all others. The
// same again for pairs of large motion. ITK's Demons for comparison, chosen in the same way.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>

#include "compute/motion/quality_folds.h"
#include "compute/vulkan/context.h"
#include "integration/app/exit_code.h"
#include "integration/app/gpu.h"
#include "integration/app/option_checks.h"
#include "integration/files/atomic_file.h"
#include "tests/lab/bench/anatomies.h"
#include "tests/lab/bench/settings_by_name.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/program/commands.h"
#include "tests/lab/program/peers.h"
#include "tests/lab/program/rows.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/motion_contender.h"
#include "tests/lab/studies/reliability.h"

namespace palpate::app {
namespace {

using namespace palpate::bench;
namespace fs = std::filesystem;

struct AnatomiesCommand {
  fs::path data = "../shared/data", page;
  std::string only;
  std::vector<std::string> presets = {"fast", "balanced", "best"};
  std::vector<std::string> candidates;
  int runs = 0;
  bool leave_one_out = false, peers = false, no_sizes = false, no_large = false, confidence = false,
       quick = false;
  DeviceOptions device;
  RowFiles rows;
};

constexpr const char* kItk = "ITK";

/// A preset changed by one candidate's settings, or ITK with one of its filters.
struct Variant {
  std::string preset, settings;
  std::function<std::unique_ptr<PairMethod>()> make;
  std::string name() const { return settings.empty() ? preset : preset + " " + settings; }
};

/// The result of a variant for a pair, errors in voxels of the finest axis.
struct Score {
  double error = 0.0;
  std::optional<double> border;
  size_t folded = 0;
  double seconds = 0.0;
  /// Empty unless requested.
  Reliability reliability;
  std::optional<Radii> radii;
};

struct Measured {
  std::string anatomy, pair;
  std::vector<Score> scores;  ///< one per variant
};

class GeometricMean {
 public:
  void add(double value) {
    sum_ += std::log(value);
    ++count_;
  }
  double value() const { return count_ ? std::exp(sum_ / count_) : NAN; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

std::vector<Variant> variants_of(const AnatomiesCommand& command,
                                 const std::shared_ptr<vulkan::Context>& context) {
  std::vector<std::string> settings = {""};
  settings.insert(settings.end(), command.candidates.begin(), command.candidates.end());
  std::vector<Variant> all;
  for (const std::string& preset : command.presets) {
    for (const std::string& each : settings) {
      const auto options = motion_preset(preset);
      if (!options)
        throw Mismatch("There is no preset '" + preset + "': name fast, balanced, best.");
      MotionSetting setting{preset + " " + each, "anatomies", *options};
      change(setting.options, each);
      all.push_back({preset, each, [=] { return palpate_method(context, setting); }});
    }
  }
  if (!command.peers) return all;
  for (const ItkFilter& filter : kItkFilters) {
    const char* iterations = command.quick ? kItkFew : kItkLong;
    if (!itk_peer(filter, iterations))
      throw Mismatch("ITK's program palpate_itk_peer is not beside palpate-lab: build it too.");
    all.push_back(
        {kItk, filter.name, [&filter, iterations] { return itk_peer(filter, iterations); }});
  }
  return all;
}

PairResult run_once(PairMethod& method, const KnownCase& pair) {
  auto result = method.run(pair.fixed, pair.moving);
  if (!result) throw Mismatch(method.name() + ": " + result.error().message);
  return std::move(*result);
}

/// A first run compiles the kernels and gives the field; timed runs follow, alternating between all
/// variants, so that a disturbance affects them equally. Peers run once.
Measured measure(const CaseSource& source, const std::vector<Variant>& variants,
                 const AnatomiesCommand& command) {
  const KnownCase pair = source.make();
  const double finest = pair.fixed.grid.finest_mm();
  Measured result{source.anatomy, source.name, {}};
  std::vector<std::unique_ptr<PairMethod>> methods;
  std::vector<std::vector<double>> seconds(variants.size());
  for (size_t v = 0; v < variants.size(); ++v) {
    methods.push_back(variants[v].make());
    const PairResult found = run_once(*methods[v], pair);
    Score score;
    score.error = mean_error_mm(found.field, pair, pair.mask) / finest;
    if (pair.border) score.border = mean_error_mm(found.field, pair, *pair.border) / finest;
    score.folded = folds(resampled(found.field, pair.fixed.grid)).folded;
    score.seconds = found.seconds;
    if (command.confidence && found.confidence) {
      score.reliability = reliability_of(found.field, *found.confidence, pair.truth, &pair.mask,
                                         kRightVoxels * finest);
      score.radii =
          radii_of(found.field, found.confidence->deviation, pair.truth, pair.mask, finest);
    }
    result.scores.push_back(score);
    if (command.runs == 0 || methods[v]->runs_once()) methods[v].reset();
  }
  for (int k = 0; k < command.runs; ++k)
    for (size_t v = 0; v < variants.size(); ++v)
      if (methods[v]) seconds[v].push_back(run_once(*methods[v], pair).seconds);
  for (size_t v = 0; v < variants.size(); ++v)
    if (!seconds[v].empty()) result.scores[v].seconds = median(seconds[v]);
  return result;
}

Table pairs_table(const std::string& title, const std::vector<Variant>& variants,
                  const std::vector<Measured>& all, int runs) {
  Table table;
  table.title = title;
  table.note = fmt::format(
      "Endpoint error: mean in the pair's mask, voxels of the finest axis; the same about the "
      "border "
      "of sliding pairs. {}",
      runs ? fmt::format("Seconds: medians of {}, warm, by turns.", runs)
           : "Seconds: one run, which compiled its kernels.");
  table.columns = {{"pair", "pair"},          {"setting", "setting"},
                   {"error_voxels", "error"}, {"border_voxels", "border"},
                   {"folds", "folds"},        {"seconds", "s"}};
  for (const Measured& pair : all) {
    for (size_t v = 0; v < variants.size(); ++v) {
      const Score& s = pair.scores[v];
      table.rows.push_back({words(pair.pair), words(variants[v].name()), number(s.error, 4),
                            s.border ? number(*s.border, 3) : nothing(),
                            number(double(s.folded), 0), number(s.seconds, 2)});
    }
  }
  return table;
}

/// Geometric mean of a variant's errors over the pairs of each anatomy.
std::map<std::string, double> by_anatomy(const std::vector<Measured>& all, size_t v) {
  std::map<std::string, GeometricMean> means;
  for (const Measured& pair : all) means[pair.anatomy].add(pair.scores[v].error);
  std::map<std::string, double> result;
  for (const auto& [anatomy, mean] : means) result[anatomy] = mean.value();
  return result;
}

Table summary_table(const std::string& title, const std::vector<Variant>& variants,
                    const std::vector<Measured>& all) {
  Table table;
  table.title = title;
  table.note =
      "Geometric means of the errors, voxels of the finest axis: over the pairs of each anatomy, "
      "over all pairs of the kit's images, over the anatomies. Folds and seconds: sums.";
  table.columns = {{"setting", "setting"}};
  const std::map<std::string, double> first = by_anatomy(all, 0);
  for (const auto& [anatomy, error] : first) table.columns.push_back({anatomy, anatomy});
  for (const char* name : {"kit", "anatomies", "folds", "seconds"})
    table.columns.push_back({name, name});
  for (size_t v = 0; v < variants.size(); ++v) {
    std::vector<Cell> row = {words(variants[v].name())};
    GeometricMean anatomies, kit;
    for (const auto& [anatomy, error] : by_anatomy(all, v)) {
      row.push_back(number(error, 4));
      anatomies.add(error);
    }
    double folded = 0.0, seconds = 0.0;
    for (const Measured& pair : all) {
      if (pair.anatomy != "lung" && pair.anatomy != "shell" && pair.anatomy != "made")
        kit.add(pair.scores[v].error);
      folded += double(pair.scores[v].folded);
      seconds += pair.scores[v].seconds;
    }
    row.push_back(number(kit.value(), 4));
    row.push_back(number(anatomies.value(), 4));
    row.push_back(number(folded, 0));
    row.push_back(number(seconds, 1));
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Of the variants of one preset: the one with the smallest geometric mean over all anatomies
/// except one.
size_t chosen_without(const std::string& left_out, size_t begin, size_t end,
                      const std::vector<std::map<std::string, double>>& errors) {
  size_t chosen = begin;
  double smallest = INFINITY;
  for (size_t v = begin; v < end; ++v) {
    GeometricMean others;
    for (const auto& [anatomy, error] : errors[v])
      if (anatomy != left_out) others.add(error);
    if (others.value() < smallest) {
      smallest = others.value();
      chosen = v;
    }
  }
  return chosen;
}

Table left_out_table(const std::string& title, const std::vector<Variant>& variants,
                     const std::vector<Measured>& all) {
  Table table;
  table.title = title;
  table.note =
      "What is best on all other anatomies (geometric mean over them), and its error on the one "
      "that "
      "is left out, beside the preset as it is and the best candidate for it alone. ITK: the "
      "filter "
      "that is chosen in the same way.";
  table.columns = {{"preset", "preset"},     {"left_out", "left out"},
                   {"chosen", "chosen"},     {"error_voxels", "error"},
                   {"as_it_is", "as it is"}, {"best_here", "best here"},
                   {"itk_voxels", kItk},     {"itk_chosen", "its filter"}};
  std::vector<std::map<std::string, double>> errors;
  for (size_t v = 0; v < variants.size(); ++v) errors.push_back(by_anatomy(all, v));
  size_t itk = 0;
  while (itk < variants.size() && variants[itk].preset != kItk) ++itk;
  const bool peers = itk < variants.size();
  for (size_t begin = 0; begin < itk;) {
    size_t end = begin;
    while (end < itk && variants[end].preset == variants[begin].preset) ++end;
    GeometricMean chosen_mean, preset_mean, best_mean, itk_mean;
    for (const auto& [left_out, preset_error] : errors[begin]) {
      const size_t chosen = chosen_without(left_out, begin, end, errors);
      double best = INFINITY;
      for (size_t v = begin; v < end; ++v) best = std::min(best, errors[v].at(left_out));
      const double error = errors[chosen].at(left_out);
      chosen_mean.add(error);
      preset_mean.add(preset_error);
      best_mean.add(best);
      const std::string& settings = variants[chosen].settings;
      table.rows.push_back({words(variants[begin].preset), words(left_out),
                            words(settings.empty() ? "as it is" : settings), number(error, 4),
                            number(preset_error, 4), number(best, 4), nothing(), nothing()});
      if (!peers) continue;
      const size_t filter = chosen_without(left_out, itk, variants.size(), errors);
      itk_mean.add(errors[filter].at(left_out));
      table.rows.back()[6] = number(errors[filter].at(left_out), 4);
      table.rows.back()[7] = words(variants[filter].settings);
    }
    table.rows.push_back({words(variants[begin].preset), words("geometric mean"), words(""),
                          number(chosen_mean.value(), 4), number(preset_mean.value(), 4),
                          number(best_mean.value(), 4),
                          peers ? number(itk_mean.value(), 4) : nothing(), nothing()});
    begin = end;
  }
  return table;
}

/// Calibration of confidence for a variant: for every anatomy, with equal weight of its pairs; and
/// for all anatomies, with equal weights.
std::vector<NamedReliability> reliability_by_anatomy(const std::vector<Measured>& all, size_t v) {
  std::map<std::string, Reliability> anatomies;
  for (const Measured& pair : all) anatomies[pair.anatomy].add_evenly(pair.scores[v].reliability);
  Reliability whole;
  for (const auto& [anatomy, reliability] : anatomies) whole.add_evenly(reliability);
  std::vector<NamedReliability> named = {{"all anatomies", whole}};
  named.insert(named.end(), anatomies.begin(), anatomies.end());
  return named;
}

std::vector<Table> reliability_tables(const std::vector<Variant>& variants,
                                      const std::vector<Measured>& all) {
  std::vector<Table> tables;
  for (size_t v = 0; v < variants.size() && variants[v].preset != kItk; ++v) {
    std::vector<NamedReliability> rows;
    double errors = 0.0;
    for (const Measured& pair : all) {
      rows.emplace_back(pair.pair, pair.scores[v].reliability);
      errors += pair.scores[v].reliability.calibration_error() / double(all.size());
    }
    for (NamedReliability& anatomy : reliability_by_anatomy(all, v))
      rows.push_back(std::move(anatomy));
    tables.push_back(reliability_table(rows, "Calibration of confidence: " + variants[v].name()));
    tables.back().note += fmt::format(" Mean of the pairs' calibration errors: {:.3f}.", errors);
  }
  return tables;
}

std::vector<Table> radii_tables(const std::vector<Variant>& variants,
                                const std::vector<Measured>& all) {
  std::vector<Table> tables;
  for (size_t v = 0; v < variants.size() && variants[v].preset != kItk; ++v) {
    std::vector<std::pair<std::string, Radii>> rows;
    for (const Measured& pair : all) rows.emplace_back(pair.pair, *pair.scores[v].radii);
    tables.push_back(radii_table(rows, "Radius of 95 %: " + variants[v].name()));
  }
  return tables;
}

/// The reliability diagrams as a page.
Result<std::string> page_of(const std::vector<Variant>& variants, const std::vector<Measured>& all,
                            const report::Conditions& about) {
  Page page;
  page.conditions = {{"Device", about.device},
                     {"Driver", about.driver},
                     {"Commit", about.commit},
                     {"Date", about.date}};
  page.title = "Calibration of confidence";
  page.lead =
      "Confidence is meant as a share: of the voxels to which it gives c, a share of c should be "
      "within half a voxel of the truth.";
  const std::vector<Table> tables = reliability_tables(variants, all);
  for (size_t v = 0; v < tables.size(); ++v) {
    const std::string id = fmt::format("confidence{}", v);
    const Chart chart = reliability_chart(reliability_by_anatomy(all, v), tables[v].title);
    auto svg = drawn(chart, id);
    if (!svg) return svg.error();
    Section section{id, variants[v].name(), "", {}};
    section.parts.emplace_back(Figure{chart.title, std::move(*svg), tables[v].note, tables[v]});
    page.sections.push_back(std::move(section));
  }
  return html(page);
}

/// Pairs that are reported together.
struct Kind {
  /// As it is after "Every pair"; empty: the usual ones.
  std::string name;
  std::vector<CaseSource> (*cases)(const fs::path& data);
};

std::vector<Kind> kinds_of(const AnatomiesCommand& command) {
  std::vector<Kind> kinds = {{"", known_cases}};
  if (!command.no_sizes) kinds.push_back({" in other sizes", sized_cases});
  if (!command.no_large) kinds.push_back({" of large motion", large_motion_cases});
  return kinds;
}

/// Pairs or anatomies whose name contains the requested text.
std::vector<CaseSource> sources_of(const AnatomiesCommand& command, const Kind& kind) {
  auto sources = kind.cases(command.data);
  std::erase_if(sources, [&](const CaseSource& source) {
    return source.name.find(command.only) == std::string::npos &&
           source.anatomy.find(command.only) == std::string::npos;
  });
  return sources;
}

std::vector<Measured> measure_all(const std::vector<CaseSource>& sources,
                                  const std::vector<Variant>& variants,
                                  const AnatomiesCommand& command, Console& console) {
  std::vector<Measured> all;
  for (const CaseSource& source : sources) {
    console.progress(double(all.size()) / double(sources.size()), source.name);
    all.push_back(measure(source, variants, command));
  }
  console.end_progress();
  return all;
}

int run(const AnatomiesCommand& command) {
  Console console(false, false, Steps::kLines);
  Status can = check_can_write(command.rows);
  if (can && !command.page.empty()) can = files::check_can_write_file(command.page);
  if (!can) return fail(console, can.error());
  const auto context = open_device(command.device, console);
  if (!context) return fail(console, context.error());
  const std::vector<Variant> variants = variants_of(command, *context);
  Rows rows("anatomies", context->get());
  std::vector<Measured> usual;
  for (const Kind& kind : kinds_of(command)) {
    const std::vector<CaseSource> sources = sources_of(command, kind);
    if (sources.empty()) continue;
    std::vector<Measured> all;
    rows.add([&] {
      all = measure_all(sources, variants, command, console);
      return pairs_table("Every pair" + kind.name, variants, all, command.runs);
    });
    rows.add({summary_table("Every anatomy" + kind.name, variants, all)});
    if (command.leave_one_out)
      rows.add({left_out_table("Leaving one anatomy out" + kind.name, variants, all)});
    if (kind.name.empty()) usual = std::move(all);
  }
  if (rows.tables().empty())
    return fail(console, {ErrorKind::kBadInput,
                          "There is no pair named like '" + command.only + "': leave --only out"});
  if (command.confidence && !usual.empty()) {
    rows.add(reliability_tables(variants, usual));
    rows.add(radii_tables(variants, usual));
  }
  if (!command.page.empty()) {
    const auto page = page_of(variants, usual, rows.about());
    if (!page) return fail(console, page.error());
    if (const Status written = files::write_text(command.page, *page); !written)
      return fail(console, written.error());
  }
  const Status written = rows.write(command.rows);
  return written ? int(kExitOk) : fail(console, written.error());
}

}  // namespace

Command add_anatomies(CLI::App& program) {
  auto command = std::make_shared<AnatomiesCommand>();
  CLI::App* app = program.add_subcommand(
      "anatomies", "Measure the motion presets on every anatomy with known motion");
  app->add_option("--data", command->data, "Folder with kit/ and lung/")
      ->type_name("DIR")
      ->capture_default_str();
  app->add_option("--presets", command->presets, "Presets")->delimiter(',')->capture_default_str();
  app->add_option("--candidate", command->candidates,
                  "Settings to choose from beside the preset's own, as \"window0=5 damping=0.12\"; "
                  "may be given several times")
      ->allow_extra_args(false);
  app->add_flag(
      "--leave-one-out", command->leave_one_out,
      "What each anatomy gets when the choice is made on all others, ITK's Demons beside");
  app->add_flag("--peers", command->peers, "ITK's Demons beside");
  app->add_flag("--no-sizes", command->no_sizes, "Leave the pairs in other sizes out");
  app->add_flag("--no-large", command->no_large, "Leave the pairs of large motion out");
  app->add_option("--only", command->only, "Pairs or anatomies whose name holds this");
  app->add_option("--runs", command->runs, "Timed runs after the first, of which the median counts")
      ->check(whole_number_in(0, 100))
      ->capture_default_str();
  app->add_flag("--quick", command->quick,
                "The preset fast on the smallest synthetic heart: does it work?");
  app->add_flag("--confidence", command->confidence,
                "Also say how well confidence is calibrated: how much of what has confidence c is "
                "right");
  app->add_option("--page", command->page,
                  "Draw that as diagrams on this HTML page (needs python3-matplotlib)")
      ->type_name("FILE")
      ->needs("--confidence");
  add_device_options(*app, command->device);
  add_row_options(*app, command->rows);
  Command result{app,
                 [command] {
                   command->peers |= command->leave_one_out;
                   if (command->quick) {
                     command->presets = {"fast"};
                     command->only = "shell_48";
                   }
                   return measured([&] { return run(*command); });
                 },
                 {"--data"},
                 row_outputs(),
                 {}};
  result.writes.emplace_back("--page");
  return result;
}

}  // namespace palpate::app
