#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "compute/volume/sequence.h"
#include "integration/app/commands.h"
#include "integration/app/exit_code.h"
#include "integration/app/info/contents.h"
#include "integration/app/progress.h"
#include "integration/app/series_option.h"
#include "integration/app/summary.h"
#include "integration/files/frames.h"
#include "integration/files/raster/raster.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

struct InfoCommand {
  std::vector<fs::path> inputs;
  bool json = false;
};

/// The range over all frames.
struct SampleRange {
  float low = 0.0F, high = 0.0F;
  double mean = 0.0;
  size_t not_finite = 0;
};

SampleRange range_of(const std::vector<Values>& values) {
  SampleRange range;
  size_t finite = 0;
  for (const Values& v : values) {
    range.not_finite += v.not_finite;
    const size_t count = v.count - v.not_finite;
    if (count == 0) continue;
    range.low = finite ? std::min(range.low, v.low) : v.low;
    range.high = finite ? std::max(range.high, v.high) : v.high;
    range.mean += v.mean * double(count);
    finite += count;
  }
  if (finite > 0) range.mean /= double(finite);
  return range;
}

std::string times_text(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t k = 1; k < times.size(); ++k) steps.push_back(times[k] - times[k - 1]);
  const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
  const bool even = *most - *least <= 1e-3 * *most;
  return fmt::format(
      "{:.4g} to {:.4g} s, {} s apart", times.front(), times.back(),
      even ? fmt::format("{:.4g}", *least) : fmt::format("{:.4g} to {:.4g}", *least, *most));
}

std::string values_text(const Contents& contents) {
  const SampleRange range = range_of(contents.values);
  const bool lengths = contents.components == 3 && contents.kind != "picture";
  // For labels the mean has no meaning; for a mask it is its share.
  const auto& first = contents.values.front();
  if (contents.kind == "mask")
    return fmt::format("{:g}; {:.3g} % of the voxels are not 0",
                       fmt::join(first.different, " and "), 100.0 * range.mean / range.high);
  if (contents.kind == "labels") return fmt::format("{:g}", fmt::join(first.different, ", "));
  std::string text = fmt::format("{}{:.6g} to {:.6g}, mean {:.6g}", lengths ? "lengths from " : "",
                                 range.low, range.high, range.mean);
  text += range.not_finite ? fmt::format(", {} not finite", range.not_finite)
                           : std::string(", all finite");
  return text;
}

void print(const Contents& contents, Console& console) {
  const auto line = [&](const std::string& label, const std::string& text) {
    if (!text.empty()) console.say(fmt::format("{:<9} {}", label, text));
  };
  line("File", contents.path.string());
  line("Is", contents.what);
  line("Format", contents.format);
  if (contents.grid) {
    const Grid& grid = *contents.grid;
    const Grid stored = files::as_in_file(grid);
    const glm::dvec3 edges = grid.spacing_mm * glm::dvec3(grid.size), at = stored.origin_mm;
    line("Size", fmt::format("{}, {:.4g} x {:.4g} x {:.4g} mm in all", files::grid_text(grid),
                             edges.x, edges.y, edges.z));
    const double oblique = oblique_degrees(grid);
    line("Axes", fmt::format("{}{}{}; the first voxel at ({:.6g}, {:.6g}, {:.6g}) mm LPS",
                             axes_letters(stored), grid.j_reversed_in_file ? ", left-handed" : "",
                             oblique > 0.0 ? fmt::format(", oblique by {:.1f} degrees", oblique)
                                           : std::string(),
                             at.x, at.y, at.z));
  }
  if (contents.times_s.size() > 1)
    line("Times", times_text(contents.times_s));
  else if (contents.kind == "sequence")
    line("Times",
         fmt::format("not known: all frames are played in {:.3g} s; --fps of 'palpate feel' "
                     "and 'palpate motion' says otherwise",
                     double(contents.frames) * assumed_times(contents.frames)[1]));
  if (!contents.values.empty()) line("Values", values_text(contents));
  if (contents.folds)
    line("Folds", fmt::format("{}, smallest determinant {:.3f}", folds_text(*contents.folds),
                              contents.folds->min_det));
  if (contents.memory_bytes > 0.0)
    line("Memory", bytes_text(contents.memory_bytes) + " for all of it, as 32-bit numbers");
  for (const auto& [label, text] : contents.more) line(label, text);
  line("Use", contents.use);
  for (const std::string& problem : contents.problems) line("Problem", problem);
}

nlohmann::json json_of(const Contents& contents) {
  nlohmann::json out = {
      {"file", contents.path.string()}, {"kind", contents.kind}, {"what", contents.what},
      {"format", contents.format},      {"use", contents.use},   {"problems", contents.problems}};
  if (contents.grid) {
    out["grid"] = app::json_of(*contents.grid);
    out["axes"] = axes_letters(files::as_in_file(*contents.grid));
    out["left_handed"] = contents.grid->j_reversed_in_file;
    out["oblique_degrees"] = oblique_degrees(*contents.grid);
  }
  if (contents.frames > 0) out["frames"] = contents.frames;
  if (contents.components > 0) out["components"] = contents.components;
  if (!contents.times_s.empty()) out["times_s"] = contents.times_s;
  if (!contents.values.empty()) {
    const SampleRange range = range_of(contents.values);
    out["values"] = {{"low", range.low},
                     {"high", range.high},
                     {"mean", range.mean},
                     {"not_finite", range.not_finite}};
    if (contents.kind == "labels" || contents.kind == "mask")
      out["values"]["different"] = contents.values.front().different;
  }
  if (contents.folds) out["folds"] = app::json_of(*contents.folds);
  if (contents.memory_bytes > 0.0) out["memory_bytes"] = contents.memory_bytes;
  for (const auto& [label, text] : contents.more) out["more"].push_back({label, text});
  return out;
}

/// Compares the grids, each with the first one.
void compare(const std::vector<Contents>& all, Console& console, nlohmann::json& out) {
  const Contents* first = nullptr;
  size_t same = 0, others = 0;
  for (const Contents& one : all) {
    if (!one.grid) continue;
    if (!first) {
      first = &one;
      continue;
    }
    ++others;
    const Together found = together(*first->grid, *one.grid);
    same += found.same_grid;
    out.push_back({{"file", one.path.string()},
                   {"with", first->path.string()},
                   {"same_grid", found.same_grid},
                   {"overlap", found.overlap},
                   {"difference", found.difference}});
    if (found.same_grid) continue;
    std::string difference = found.difference;
    constexpr std::string_view kFirst = "where frame 0 has";
    if (const size_t at = difference.find(kFirst); at != std::string::npos)
      difference.replace(at, kFirst.size(), fmt::format("where '{}' has", first->path.string()));
    console.say(fmt::format(
        "Grids     '{}' has {}; {}.", one.path.string(), difference,
        found.overlap > 0.0
            ? fmt::format("{:.0f} % of the first's volume lies in it", 100.0 * found.overlap)
            : fmt::format("they do not overlap in space, {:.4g} mm are between them",
                          gap_mm(*first->grid, *one.grid))));
  }
  if (others > 0 && same == others)
    console.say(fmt::format("Grids     all {} are on the same grid", others + 1));
}

int run(const InfoCommand& command) {
  Console console(false, command.json);
  std::vector<Contents> all;
  nlohmann::json files = nlohmann::json::array(), grids = nlohmann::json::array();
  int rc = kExitOk;
  for (const fs::path& input : command.inputs) {
    auto contents = contents_of(
        input, [&](double share) { console.progress(share, "reading " + input.string()); });
    console.end_progress();
    if (&input != &command.inputs.front()) console.say("");
    if (contents) {
      print(*contents, console);
      files.push_back(json_of(*contents));
      all.push_back(std::move(*contents));
    } else {
      // The properties of the readable files are still printed.
      files.push_back({{"file", input.string()}, {"error", contents.error().message}});
      rc = fail(console, contents.error());
    }
  }
  if (all.size() > 1) console.say("");
  compare(all, console, grids);
  if (command.json) {
    nlohmann::json out = {{"files", files}};
    if (!grids.empty()) out["grids"] = grids;
    fmt::print("{}\n", out.dump(2));
  }
  return rc;
}

}  // namespace

Command add_info(CLI::App& program) {
  auto command = std::make_shared<InfoCommand>();
  CLI::App* app = program.add_subcommand(
      "info", "Say what is in files, what palpate would do with it, and what is suspicious");
  app->add_option("input", command->inputs,
                  "Images, folders, fields, scenes, calibrations, recordings, tables of points")
      ->type_name("PATH")
      ->required();
  add_series_option(*app, command->inputs);
  app->add_flag("--json", command->json, "Print JSON on stdout, lines on stderr");
  return {app, [command] { return run(*command); }, {"input"}, {}, {}};
}

}  // namespace palpate::app
