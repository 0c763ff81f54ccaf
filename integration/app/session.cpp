#include "integration/app/session.h"

#include <fmt/format.h>

namespace palpate::app {

void add_device_options(CLI::App& command, DeviceOptions& options) {
  command
      .add_option("--device", options.device,
                  "Vulkan device, by number or part of its name (see 'palpate devices')")
      ->type_name("NAME");
  command
      .add_option("--memory-cap", options.memory_cap_mb,
                  "Use no more device memory than this, in MB; larger work is cut into slabs")
      ->type_name("MB")
      ->check(CLI::PositiveNumber);
}

Result<std::shared_ptr<vulkan::Context>> open_device(const DeviceOptions& options,
                                                     Console& console) {
  vulkan::ContextOptions wanted;
  wanted.device = options.device;
  wanted.memory_cap_bytes = uint64_t(options.memory_cap_mb * 1e6);
  auto context = vulkan::Context::open(wanted);
  if (context) {
    const vulkan::DeviceInfo& info = (*context)->info();
    console.say(fmt::format("Device    {} ({})", info.name, info.kind));
  }
  return context;
}

}  // namespace palpate::app
