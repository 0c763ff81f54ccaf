#pragma once

#include <CLI/CLI.hpp>
#include <future>
#include <memory>
#include <string>

#include "compute/vulkan/context.h"
#include "integration/app/progress.h"

namespace palpate::app {

/// The choice of the compute device on the command line.
struct DeviceOptions {
  std::string device;
  double memory_cap_mb = 0.0;
  bool old_spelling = false;  ///< --device was used instead of --gpu
};

/// Adds --gpu.
void add_gpu_option(CLI::App& command, DeviceOptions& options);

/// Adds --gpu and --memory-cap, for commands without a force device. There --device, which is the
/// force device everywhere else, is still accepted as the old name of --gpu.
void add_device_options(CLI::App& command, DeviceOptions& options);

using OpenedContext = Result<std::shared_ptr<vulkan::Context>>;

/// Opens the device on another thread, in parallel to work that does not need it yet.
std::future<OpenedContext> begin_open_device(const DeviceOptions& options);

/// Waits for the device and prints which one it is; with --verbose also its properties.
OpenedContext open_device(std::future<OpenedContext> opening, const DeviceOptions& options,
                          Console& console);
OpenedContext open_device(const DeviceOptions& options, Console& console);

}  // namespace palpate::app
