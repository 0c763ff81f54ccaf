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
  bool old_spelling = false;  ///< --device instead of --gpu
};

/// --gpu.
void add_gpu_option(CLI::App& command, DeviceOptions& options);

/// --gpu and --memory-cap, for commands without a force device: --device, which is the force device
/// in all others, once meant --gpu there and still does.
void add_device_options(CLI::App& command, DeviceOptions& options);

/// Opens the device and says which one it is, and with --verbose what it can do.
Result<std::shared_ptr<vulkan::Context>> open_device(const DeviceOptions& options,
                                                     Console& console);

}  // namespace palpate::app
