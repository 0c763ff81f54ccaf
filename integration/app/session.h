#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "compute/vulkan/context.h"
#include "integration/app/progress.h"

namespace palpate::app {

/// Where to compute, as the command line says it.
struct DeviceOptions {
  std::string device;
  double memory_cap_mb = 0.0;
};

/// --device and --memory-cap.
void add_device_options(CLI::App& command, DeviceOptions& options);

/// Opens the device and says which one it is.
Result<std::shared_ptr<vulkan::Context>> open_device(const DeviceOptions& options,
                                                     Console& console);

}  // namespace palpate::app
