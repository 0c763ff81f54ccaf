#pragma once

#include <memory>

#include "compute/vulkan/context.h"
#include "module/xr/system.h"

namespace palpate::xr {

struct GraphicsOptions {
  bool validation = false;
  uint64_t memory_cap_bytes = 0;
};

/// Third in the life cycle: a Vulkan device made through the runtime (XR_KHR_vulkan_enable2), which
/// adds the extensions that it needs and chooses the GPU. kUnsupported, kNoGraphics, or what the
/// calls return.
Outcome<std::shared_ptr<vulkan::Context>> make_context(const Instance& instance,
                                                       const System& system,
                                                       const GraphicsOptions& options);

/// Asks the runtime what a session needs to be asked before it is created, for a device that an
/// earlier instance of the runtime made: true if it still is the one that drives the display. False
/// also where the runtime refuses to say so.
Outcome<bool> still_drives(const Instance& instance, const System& system,
                           const vulkan::Context& context);

}  // namespace palpate::xr
