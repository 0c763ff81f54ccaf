// How well settings of the motion engine do on data that they were not chosen on: every pair with
// known motion (kit, lung, made), every preset and every candidate setting; and, for the choice
// between the candidates, what it gives for an anatomy when it is made on all others. The same once
// more for pairs of large motion.

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>

#include "bench_commit.h"
#include "compute/motion/quality_folds.h"
#include "compute/vulkan/context.h"
#include "tests/lab/bench/anatomies.h"
#include "tests/lab/bench/settings_by_name.h"
#include "tests/lab/bench/tools.h"
#include "tests/lab/report/page.h"
#include "tests/lab/studies/reliability.h"
#include "tests/lab/studies/warm_pair.h"

namespace {

using namespace palpate;
using namespace palpate::bench;

struct Wishes {
  std::string data = PALPATE_SHARED_DATA;
  std::string device, csv, markdown, only, report;
  std::vector<std::string> presets = {"fast", "balanced", "best"};
  std::vector<std::string> candidates;
  int runs = 0;
  bool confidence = false;
};

/// A preset, changed by one candidate's settings.
struct Variant {
  std::string preset, settings;
  MotionOptions options;
  std::string name() const { return settings.empty() ? preset : preset + " " + settings; }
};

/// What a variant found for a pair, errors in voxels of the finest axis.
struct Score {
  double error = 0.0, own_error = 0.0;
  std::optional<double> border;
  size_t folded = 0;
  double seconds = 0.0;
  Reliability reliability;  ///< empty unless wished for
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

std::vector<Variant> variants_of(const Wishes& wishes) {
  std::vector<std::string> settings = {""};
  settings.insert(settings.end(), wishes.candidates.begin(), wishes.candidates.end());
  std::vector<Variant> all;
  for (const std::string& preset : wishes.presets) {
    for (const std::string& each : settings) {
      const auto options = motion_preset(preset);
      if (!options) throw Mismatch("There is no preset \"" + preset + "\".");
      all.push_back({preset, each, *options});
      change(all.back().options, each);
    }
  }
  return all;
}

/// A first run makes the kernels ready and gives the field; timed runs follow, all variants by
/// turns, so that a disturbance hits them alike.
Measured measure(const std::shared_ptr<vulkan::Context>& context, const CaseSource& source,
                 const std::vector<Variant>& variants, const Wishes& wishes) {
  const int runs = wishes.runs;
  const KnownCase pair = source.make();
  const double finest = pair.fixed.grid.finest_mm();
  Measured result{source.anatomy, source.name, {}};
  std::vector<std::unique_ptr<studies::WarmPair>> warm;
  for (const Variant& variant : variants) {
    warm.push_back(std::make_unique<studies::WarmPair>(context, pair.fixed.grid, variant.options));
    const studies::PairRun run = warm.back()->run(pair.fixed, pair.moving);
    Score score;
    score.error = mean_error_mm(run.field, pair, pair.mask) / finest;
    score.own_error = mean_error_own_voxels(run.field, pair, pair.mask);
    if (pair.border) score.border = mean_error_mm(run.field, pair, *pair.border) / finest;
    score.folded = folds(resampled(run.field, pair.fixed.grid)).folded;
    score.seconds = run.total_s();
    if (wishes.confidence)
      score.reliability =
          reliability_of(run.field, run.confidence, pair.truth, &pair.mask, kRightVoxels * finest);
    result.scores.push_back(score);
    if (runs == 0) warm.back().reset();
  }
  std::vector<std::vector<double>> seconds(variants.size());
  for (int k = 0; k < runs; ++k)
    for (size_t v = 0; v < variants.size(); ++v)
      seconds[v].push_back(warm[v]->run(pair.fixed, pair.moving).total_s());
  if (runs > 0)
    for (size_t v = 0; v < variants.size(); ++v) result.scores[v].seconds = median(seconds[v]);
  return result;
}

Table pairs_table(const std::string& title, const std::vector<Variant>& variants,
                  const std::vector<Measured>& all, int runs) {
  Table table;
  table.title = title;
  table.note = fmt::format(
      "Endpoint error: mean in the pair's mask, voxels of the finest axis; the same with each axis "
      "in its own voxels; mean about the border of sliding pairs. {}",
      runs ? fmt::format("Seconds: medians of {}, warm, by turns.", runs)
           : "Seconds: one run, which compiled its kernels.");
  table.columns = {{"pair", "pair"},
                   {"setting", "setting"},
                   {"error_voxels", "error"},
                   {"error_own_voxels", "own axes"},
                   {"border_voxels", "border"},
                   {"folds", "folds"},
                   {"seconds", "s"}};
  for (const Measured& pair : all) {
    for (size_t v = 0; v < variants.size(); ++v) {
      const Score& s = pair.scores[v];
      table.rows.push_back({words(pair.pair), words(variants[v].name()), number(s.error, 4),
                            number(s.own_error, 4), s.border ? number(*s.border, 3) : nothing(),
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

/// For each preset and anatomy: the candidate with the smallest geometric mean over all other
/// anatomies, and what it gives for this one.
Table left_out_table(const std::string& title, const std::vector<Variant>& variants,
                     const std::vector<Measured>& all) {
  Table table;
  table.title = title;
  table.note =
      "The candidate that is best on all other anatomies (geometric mean over them), and its error "
      "on the one that is left out, beside the preset as it is and the best candidate for it "
      "alone.";
  table.columns = {{"preset", "preset"},      {"left_out", "left out"}, {"chosen", "chosen"},
                   {"error_voxels", "error"}, {"as_it_is", "as it is"}, {"best_here", "best here"}};
  std::vector<std::map<std::string, double>> errors;
  for (size_t v = 0; v < variants.size(); ++v) errors.push_back(by_anatomy(all, v));
  for (size_t begin = 0; begin < variants.size();) {
    size_t end = begin;
    while (end < variants.size() && variants[end].preset == variants[begin].preset) ++end;
    GeometricMean chosen_mean, preset_mean, best_mean;
    for (const auto& [left_out, preset_error] : errors[begin]) {
      size_t chosen = begin;
      double smallest = INFINITY, best = INFINITY;
      for (size_t v = begin; v < end; ++v) {
        GeometricMean others;
        for (const auto& [anatomy, error] : errors[v])
          if (anatomy != left_out) others.add(error);
        if (others.value() < smallest) {
          smallest = others.value();
          chosen = v;
        }
        best = std::min(best, errors[v].at(left_out));
      }
      const double error = errors[chosen].at(left_out);
      chosen_mean.add(error);
      preset_mean.add(preset_error);
      best_mean.add(best);
      const std::string& settings = variants[chosen].settings;
      table.rows.push_back({words(variants[begin].preset), words(left_out),
                            words(settings.empty() ? "as it is" : settings), number(error, 4),
                            number(preset_error, 4), number(best, 4)});
    }
    table.rows.push_back({words(variants[begin].preset), words("geometric mean"), words(""),
                          number(chosen_mean.value(), 4), number(preset_mean.value(), 4),
                          number(best_mean.value(), 4)});
    begin = end;
  }
  return table;
}

/// Calibration of confidence for a variant: for every anatomy, its pairs alike; and for all
/// anatomies alike.
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
  for (size_t v = 0; v < variants.size(); ++v) {
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

/// The reliability diagrams as a page.
Result<std::string> report_of(const std::vector<Variant>& variants,
                              const std::vector<Measured>& all, const Conditions& about) {
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
  for (size_t v = 0; v < variants.size(); ++v) {
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

int fail(const std::string& why) {
  fmt::print(stderr, "anatomy_bench: {}\n", why);
  return 2;
}

bool write(const std::string& path, const std::string& text) {
  if (path.empty()) return true;
  std::ofstream file(path);
  file << text;
  file.close();
  return bool(file);
}

int run(const Wishes& wishes) {
  const std::vector<Variant> variants = variants_of(wishes);
  vulkan::ContextOptions options;
  options.device = wishes.device;
  const auto context = vulkan::Context::open(options);
  if (!context) return fail(context.error().message);
  const OtherLoad others;
  std::vector<Table> tables;
  const auto measure_all = [&](const std::vector<CaseSource>& sources, const std::string& kind) {
    std::vector<Measured> all;
    for (const CaseSource& source : sources) {
      if (source.name.find(wishes.only) == std::string::npos &&
          source.anatomy.find(wishes.only) == std::string::npos)
        continue;
      all.push_back(measure(*context, source, variants, wishes));
      for (size_t v = 0; v < variants.size(); ++v)
        fmt::print("{:26} {:.4f} {}\n", source.name, all.back().scores[v].error,
                   variants[v].name());
      std::fflush(stdout);
    }
    if (all.empty()) return all;
    tables.push_back(pairs_table("Every pair" + kind, variants, all, wishes.runs));
    tables.push_back(summary_table("Every anatomy" + kind, variants, all));
    if (!wishes.candidates.empty())
      tables.push_back(left_out_table("Leaving one anatomy out" + kind, variants, all));
    return all;
  };
  const std::vector<Measured> usual = measure_all(known_cases(wishes.data), "");
  if (wishes.confidence && !usual.empty())
    for (Table& table : reliability_tables(variants, usual)) tables.push_back(std::move(table));
  measure_all(large_motion_cases(wishes.data), " of large motion");
  if (tables.empty()) return fail("There is no pair named like \"" + wishes.only + "\".");
  tables[0].note += others.sentence();
  for (const Table& table : tables) fmt::print("{}", plain_text(table));

  const vulkan::DeviceInfo& info = (*context)->info();
  const Conditions about{info.name, info.driver, kBenchCommit,
                         fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))), 0};
  std::string page =
      fmt::format("# Accuracy on every anatomy\n\nDevice {}, driver {}, commit {}, {}.\n",
                  about.device, about.driver, about.commit, about.date);
  for (const Table& table : tables) page += markdown(table);
  if (!write(wishes.csv, csv(about, tables)))
    return fail("The file " + wishes.csv + " could not be written: choose another place.");
  if (!write(wishes.markdown, page))
    return fail("The file " + wishes.markdown + " could not be written: choose another place.");
  if (!wishes.report.empty()) {
    const auto report = report_of(variants, usual, about);
    if (!report) return fail(report.error().message);
    if (!write(wishes.report, *report))
      return fail("The file " + wishes.report + " could not be written: choose another place.");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Wishes wishes;
  CLI::App app(
      "Accuracy of the motion presets on every anatomy with known motion, and of settings that are "
      "chosen with one anatomy left out");
  app.add_option("data", wishes.data,
                 "Folder that holds kit/ and lung/ (default: " + wishes.data + ")");
  app.add_option("--gpu,--device", wishes.device,
                 "Number or part of the name of the Vulkan device");
  app.add_option("--presets", wishes.presets, "Presets (default: fast,balanced,best)")
      ->delimiter(',');
  app.add_option("--candidate", wishes.candidates,
                 "Settings to choose from beside the preset's own, as \"window0=5 damping=0.12\"; "
                 "may be given several times")
      ->allow_extra_args(false);
  app.add_option("--only", wishes.only, "Pairs or anatomies whose name holds this");
  app.add_option("--runs", wishes.runs, "Timed runs after the first, of which the median counts")
      ->check(CLI::Range(0, 100));
  app.add_flag(
      "--confidence", wishes.confidence,
      "Also say how well confidence is calibrated: how much of what has confidence c is right");
  app.add_option("--report", wishes.report,
                 "Draw that as a diagram into this HTML file (needs gnuplot)")
      ->needs("--confidence");
  app.add_option("--csv", wishes.csv, "Write all numbers to this file");
  app.add_option("--markdown", wishes.markdown, "Write the tables to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(wishes);
  } catch (const vulkan::Failure& failure) {
    return fail(failure.error().message);
  } catch (const Mismatch& mismatch) {
    return fail(mismatch.what());
  } catch (const std::bad_alloc&) {
    return fail("The host has too little memory for this.");
  }
}
