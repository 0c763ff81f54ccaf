// The results with the targets.
#include <cmath>
#include <optional>

#include "tests/lab/bench/motion_tables.h"

namespace palpate::bench {
namespace {

struct Target {
  const char* what;
  const char* measure;  ///< in MotionBench::found
  double reach, aim;
  bool more_is_better;
  int digits;
};

constexpr Target kTargets[] = {
    {"times sooner at the best peer's error", "sooner", 15, 40, true, 1},
    {"classic per iteration, times ITK's Demons", "classic rate", 2, 5, true, 2},
    {"real CT, endpoint error mean, voxel", "error mean", 0.15, 0.10, false, 3},
    {"real CT, endpoint error p95, voxel", "error p95", 0.45, 0.30, false, 3},
    {"more error with gain and bias, %", "gain increase", 10, 3, false, 1},
    {"sliding: error in the organ, voxel", "organ", 0.8, 0.3, false, 2},
    {"sliding: error in the wall, voxel", "wall", 0.8, 0.3, false, 2},
    {"heart, error on the shell, voxel", "heart", 0.1, 0.03, false, 3},
    {"voxels with det <= 0, all data", "folds", 0, 0, false, 0},
    {"inverse consistency mean, voxel", "inverse mean", 0.1, 0.02, false, 3},
    {"inverse consistency p99, voxel", "inverse p99", 0.5, 0.1, false, 3},
    {"peak device memory, bytes per voxel", "bytes", 32, 16, false, 1},
    {"drift after one cycle, voxel", "drift", 0.3, 0.05, false, 3},
};

const char* judged(const Target& target, double value) {
  const auto meets = [&](double limit) {
    return target.more_is_better ? value >= limit : value <= limit;
  };
  return meets(target.aim) ? "aim" : meets(target.reach) ? "reach" : "short";
}

}  // namespace

Table targets_table(const MotionBench& bench) {
  Table table;
  table.title = "Targets";
  table.note =
      "What each setting meets: aim, reach, or short of both. classic is the paper's method, as a "
      "baseline: only its rate is a target.";
  table.columns = {{"what", "what"}, {"reach", "reach"}, {"aim", "aim"}};
  const std::string ours[] = {"fast", "balanced", "best", "classic"};
  for (const std::string& who : ours) {
    table.columns.push_back({who, who});
    table.columns.push_back({who + "_meets", "meets"});
  }
  table.columns.push_back({"peer", "best peer"});
  for (const Target& target : kTargets) {
    const auto digits = [](double limit) { return limit == std::floor(limit) ? 0 : 2; };
    std::vector<Cell> row = {words(target.what), number(target.reach, digits(target.reach)),
                             number(target.aim, digits(target.aim))};
    const auto found = bench.found.find(target.measure);
    const auto value_of = [&](const std::string& who) -> std::optional<double> {
      if (found == bench.found.end() || !found->second.contains(who)) return std::nullopt;
      return found->second.at(who);
    };
    for (const std::string& who : ours) {
      const auto value = value_of(who);
      const bool asked = who != "classic" || std::string(target.measure) == "classic rate";
      row.push_back(value ? number(*value, target.digits) : nothing());
      row.push_back(value && asked ? words(judged(target, *value)) : nothing());
    }
    const auto peer = value_of("peer");
    row.push_back(peer ? number(*peer, target.digits) : nothing());
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace palpate::bench
