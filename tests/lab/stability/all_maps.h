#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/lab/stability/map.h"

namespace palpate::vulkan {
class Context;
}

namespace palpate::stability {

/// A function that makes a map.
struct MapMaker {
  std::string group;  ///< "motion", "back-tracking", "loop"
  std::string doing;  ///< for a progress bar
  /// Its approximate time relative to the others, for quick and full runs.
  double seconds;
  std::function<StabilityMap(const Making&)> make;
};

/// The maps of a group, or all if it is empty, in the order of a report. Only the group "motion"
/// uses the context; it may be null for the others.
std::vector<MapMaker> maps_of(const std::string& group,
                              const std::shared_ptr<vulkan::Context>& context);

inline constexpr const char* kGroups[] = {"motion", "back-tracking", "loop"};

}  // namespace palpate::stability
