#include "integration/app/gpu.h"

#include <fmt/format.h>

#include "integration/app/option_checks.h"
#include "integration/files/scene/option_ranges.h"

namespace palpate::app {
void add_gpu_option(CLI::App& command, DeviceOptions& options) {
  command
      .add_option("--gpu", options.device,
                  "Vulkan device, by number or part of its name (see 'palpate devices')")
      ->type_name("NAME");
}

void add_device_options(CLI::App& command, DeviceOptions& options) {
  add_gpu_option(command, options);
  // An option without a group is not listed in --help.
  command
      .add_option_function<std::string>("--device",
                                        [&options](const std::string& name) {
                                          options.device = name;
                                          options.old_spelling = true;
                                        })
      ->group("");
  command
      .add_option("--memory-cap", options.memory_cap_mb,
                  "Use no more device memory than this, in MB; larger work is cut into slabs")
      ->type_name("MB")
      ->check(number_in(files::kDeviceMemory_mb));
}

std::future<OpenedContext> begin_open_device(const DeviceOptions& options) {
  vulkan::ContextOptions wanted;
  wanted.device = options.device;
  wanted.memory_cap_bytes = uint64_t(options.memory_cap_mb * 1e6);
  return std::async(std::launch::async, [wanted] { return vulkan::Context::open(wanted); });
}

OpenedContext open_device(const DeviceOptions& options, Console& console) {
  return open_device(begin_open_device(options), options, console);
}

OpenedContext open_device(std::future<OpenedContext> opening, const DeviceOptions& options,
                          Console& console) {
  if (options.old_spelling)
    console.complain(
        "palpate: The Vulkan device is named with --gpu now; --device is the force device in all "
        "commands.");
  OpenedContext context = opening.get();
  if (context) {
    const vulkan::GpuInfo& info = (*context)->info();
    console.say(fmt::format("Device    {} ({})", info.name, info.kind));
    console.detail(fmt::format("Vulkan    {}.{}, driver {}, {} of memory, {} in one buffer at most",
                               info.api_major, info.api_minor, info.driver,
                               bytes_text(double(info.memory_bytes)),
                               bytes_text(double(info.binding_bytes))));
  }
  return context;
}

}  // namespace palpate::app
