#pragma once

#include <CLI/CLI.hpp>
#include <future>
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

using OpenedContext = Result<std::shared_ptr<vulkan::Context>>;

/// Opens the device on a thread of its own, beside what does not need it yet.
std::future<OpenedContext> begin_open_device(const DeviceOptions& options);

/// Waits for the device, and says which one it is and with --verbose what it can do.
OpenedContext open_device(std::future<OpenedContext> opening, const DeviceOptions& options,
                          Console& console);
OpenedContext open_device(const DeviceOptions& options, Console& console);

}  // namespace palpate::app
