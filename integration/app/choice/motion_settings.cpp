#include "integration/app/choice/motion_settings.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

namespace palpate::app {
namespace {

using Change = std::function<void(MotionOptions&)>;

void scale_iterations(MotionOptions& options, double by) {
  for (LevelOptions& level : options.levels)
    level.iterations = std::max(1, int(std::lround(level.iterations * by)));
}

void scale_smoothness(MotionOptions& options, double by) {
  for (LevelOptions& level : options.levels) level.smoothness *= by;
}

void scale_window(MotionOptions& options, double by) {
  for (LevelOptions& level : options.levels) level.window *= by;
}

void set_cells(MotionOptions& options, int cell) {
  for (LevelOptions& level : options.levels) level.cell = cell;
}

/// Collects settings; for a quick list drops those that are not marked as quick.
class List {
 public:
  explicit List(bool quick) : quick_(quick) {}
  void add(bool in_quick, const char* preset, const std::string& what, const char* sweep,
           const Change& change) {
    if (quick_ && !in_quick) return;
    MotionSetting setting{std::string(preset) + (what.empty() ? "" : ", " + what), sweep,
                          *motion_preset(preset)};
    if (in_quick) quick_names_.insert(setting.name);
    if (change) change(setting.options);
    const MotionOptions& o = setting.options;
    setting.careful = o.method == MotionMethod::kPalpate && o.normalise && o.search_mm > 0.0 &&
                      o.coarse_levels == 0;
    settings_.push_back(std::move(setting));
  }
  /// Presets first, then the settings of quick runs: if time runs out the last ones are left out.
  std::vector<MotionSetting> take() {
    std::stable_sort(settings_.begin(), settings_.end(),
                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
    return std::move(settings_);
  }

 private:
  int rank(const MotionSetting& setting) const {
    return setting.is_preset() ? 0 : quick_names_.contains(setting.name) ? 1 : 2;
  }

  bool quick_;
  std::set<std::string> quick_names_;
  std::vector<MotionSetting> settings_;
};

void add_levels(List& list) {
  list.add(true, "fast", "down to half resolution", "levels",
           [](MotionOptions& o) { o.finest_level = 1; });
  list.add(false, "fast", "down to a quarter of the resolution", "levels",
           [](MotionOptions& o) { o.finest_level = 2; });
  list.add(true, "balanced", "down to half resolution", "levels",
           [](MotionOptions& o) { o.finest_level = 1; });
  list.add(false, "balanced", "1 level", "levels", [](MotionOptions& o) { o.coarse_levels = 1; });
  list.add(false, "balanced", "no discrete start", "levels",
           [](MotionOptions& o) { o.search_mm = 0.0; });
}

void add_iterations(List& list) {
  list.add(true, "fast", "half the iterations", "iterations",
           [](MotionOptions& o) { scale_iterations(o, 0.5); });
  list.add(false, "fast", "1 iteration on the finest level", "iterations",
           [](MotionOptions& o) { o.levels[0].iterations = 1; });
  list.add(true, "balanced", "half the iterations", "iterations",
           [](MotionOptions& o) { scale_iterations(o, 0.5); });
  list.add(true, "balanced", "twice the iterations", "iterations",
           [](MotionOptions& o) { scale_iterations(o, 2.0); });
  list.add(false, "best", "half the iterations", "iterations",
           [](MotionOptions& o) { scale_iterations(o, 0.5); });
  list.add(false, "balanced", "no momentum", "iterations",
           [](MotionOptions& o) { o.momentum = 0.0; });
  list.add(false, "classic", "a fifth of the iterations", "iterations",
           [](MotionOptions& o) { scale_iterations(o, 0.2); });
}

void add_smoothing(List& list) {
  list.add(true, "balanced", "a quarter of the smoothing", "smoothing",
           [](MotionOptions& o) { scale_smoothness(o, 0.25); });
  list.add(true, "balanced", "four times the smoothing", "smoothing",
           [](MotionOptions& o) { scale_smoothness(o, 4.0); });
  list.add(true, "balanced", "half the window", "smoothing",
           [](MotionOptions& o) { scale_window(o, 0.5); });
  list.add(false, "balanced", "one and a half the window", "smoothing",
           [](MotionOptions& o) { scale_window(o, 1.5); });
  list.add(true, "balanced", "1 filter step", "smoothing",
           [](MotionOptions& o) { o.filter_steps = 1; });
  list.add(false, "balanced", "8 filter steps", "smoothing",
           [](MotionOptions& o) { o.filter_steps = 8; });
}

void add_rest(List& list) {
  list.add(true, "balanced", "raw intensities", "intensities",
           [](MotionOptions& o) { o.normalise = false, o.damping = 0.01; });
  list.add(true, "balanced", "every brick in every iteration", "bricks",
           [](MotionOptions& o) { o.converged = o.structure = 0.0; });
  // A vector per voxel takes minutes on a CPU; cells of 2 voxels already show the effect.
  list.add(true, "balanced", "cells of 2 voxels", "grids",
           [](MotionOptions& o) { set_cells(o, 2); });
  list.add(true, "balanced", "cells of 8 voxels", "grids",
           [](MotionOptions& o) { set_cells(o, 8); });
  list.add(false, "best", "cells of 2 voxels", "grids", [](MotionOptions& o) { set_cells(o, 2); });
  list.add(false, "balanced", "every voxel in every iteration", "bricks",
           [](MotionOptions& o) { o.checkerboard = false; });
}

}  // namespace

std::vector<MotionSetting> motion_settings(bool quick) {
  List list(quick);
  for (const std::string_view preset : kMotionPresets)
    list.add(true, std::string(preset).c_str(), "", "presets", {});
  add_levels(list);
  add_iterations(list);
  add_smoothing(list);
  add_rest(list);
  return list.take();
}

std::optional<MotionSetting> motion_setting(const std::string& name) {
  for (MotionSetting& setting : motion_settings(false))
    if (setting.name == name) return std::move(setting);
  return std::nullopt;
}

}  // namespace palpate::app
