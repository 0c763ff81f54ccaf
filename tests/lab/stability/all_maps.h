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

/// A map that can be made.
struct MapMaker {
  std::string group;  ///< "motion", "back-tracking", "loop"
  std::string doing;  ///< for a progress bar
  double seconds;     ///< about what it takes beside the others, quick or not
  std::function<StabilityMap(const Making&)> make;
};

/// The maps of a group, or of all where it is empty, in the order of a report. The context is only
/// used by the group "motion"; it may be null for the others.
std::vector<MapMaker> maps_of(const std::string& group,
                              const std::shared_ptr<vulkan::Context>& context);

inline constexpr const char* kGroups[] = {"motion", "back-tracking", "loop"};

}  // namespace palpate::stability
