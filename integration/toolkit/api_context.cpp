// Contexts, errors, and conversion of the host's grids and samples.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "integration/files/raster/raster.h"
#include "integration/toolkit/handles.h"
#include "integration/toolkit/options.h"

namespace palpate::toolkit {
namespace {

// No destructor: the library can then be unloaded while threads live that have used it.
thread_local std::array<char, 1024> last_error{};

PalResult result_of(ErrorKind kind) noexcept {
  switch (kind) {
    case ErrorKind::kBadInput:
    case ErrorKind::kNotFinite:
      return PAL_BAD_INPUT;
    case ErrorKind::kBadOutput:
      return PAL_BAD_OUTPUT;
    case ErrorKind::kNoDevice:
      return PAL_NO_DEVICE;
    case ErrorKind::kDeviceFailed:
      return PAL_DEVICE_FAILED;
    case ErrorKind::kOutOfMemory:
      return PAL_OUT_OF_MEMORY;
    case ErrorKind::kCancelled:
      return PAL_CANCELLED;
  }
  return PAL_INTERNAL;
}

template <class Sample>
void converted(const void* samples, std::vector<float>& values) {
  const auto* const from = static_cast<const Sample*>(samples);
  std::transform(from, from + values.size(), values.begin(),
                 [](Sample sample) { return float(sample); });
}

}  // namespace

PalResult failed(PalResult result, std::initializer_list<std::string_view> parts) noexcept {
  size_t length = 0;
  for (const std::string_view part : parts) {
    const size_t taken = std::min(part.size(), last_error.size() - 1 - length);
    std::memcpy(last_error.data() + length, part.data(), taken);
    length += taken;
  }
  last_error[length] = '\0';
  return result;
}

PalResult failed(const Error& error) noexcept {
  return failed(result_of(error.kind), {error.message});
}

PalResult refused_handle(const char* what) noexcept {
  return failed(PAL_BAD_INPUT, {"The ", what, " is NULL, or was closed"});
}

Result<Grid> grid_of(const PalGrid& grid) {
  // A direction of another length would be a second spacing.
  constexpr double kUnitTolerance = 1e-3;
  files::Placement placement;
  const bool has_direction = std::any_of(std::begin(grid.direction), std::end(grid.direction),
                                         [](double d) { return d != 0.0; });
  for (int a = 0; a < 3; ++a) {
    placement.size[a] = double(grid.size[a]);
    placement.spacing_mm[a] = grid.spacing_mm[a];
    placement.origin_mm[a] = grid.origin_mm[a];
    for (int row = 0; row < 3 && has_direction; ++row)
      placement.axes[a][row] = grid.direction[3 * row + a];
    const double length = glm::length(placement.axes[a]);
    if (std::isfinite(length) && std::abs(length - 1.0) > kUnitTolerance)
      return Error{ErrorKind::kBadInput,
                   fmt::format("PalGrid has a direction of length {:.4g} along axis {}, but "
                               "directions have length 1: put the spacing into spacing_mm",
                               length, a)};
  }
  if (const auto good = files::make_grid("PalGrid", placement)) return good;
  return Error{ErrorKind::kBadInput,
               fmt::format("A grid of {} x {} x {} samples, {:.4g} x {:.4g} x {:.4g} mm apart, can "
                           "not be: it needs samples, positive spacings, and perpendicular axes, "
                           "all finite",
                           grid.size[0], grid.size[1], grid.size[2], grid.spacing_mm[0],
                           grid.spacing_mm[1], grid.spacing_mm[2])};
}

void fill_grid(PalGrid& to, const Grid& from) {
  const Grid grid = files::as_in_file(from);
  for (int a = 0; a < 3; ++a) {
    to.size[a] = uint32_t(grid.size[a]);
    to.spacing_mm[a] = grid.spacing_mm[a];
    to.origin_mm[a] = grid.origin_mm[a];
    for (int row = 0; row < 3; ++row) to.direction[3 * row + a] = grid.direction[a][row];
  }
}

Result<Volume> volume_of(const Grid& grid, PalSampleType type, const void* samples) {
  if (!samples) return Error{ErrorKind::kBadInput, "A frame has no samples"};
  Volume volume{grid, std::vector<float>(grid.count())};
  switch (type) {
    case PAL_FLOAT32:
      converted<float>(samples, volume.values);
      break;
    case PAL_FLOAT64:
      converted<double>(samples, volume.values);
      break;
    case PAL_INT8:
      converted<int8_t>(samples, volume.values);
      break;
    case PAL_UINT8:
      converted<uint8_t>(samples, volume.values);
      break;
    case PAL_INT16:
      converted<int16_t>(samples, volume.values);
      break;
    case PAL_UINT16:
      converted<uint16_t>(samples, volume.values);
      break;
    case PAL_INT32:
      converted<int32_t>(samples, volume.values);
      break;
    case PAL_UINT32:
      converted<uint32_t>(samples, volume.values);
      break;
    default:
      return Error{ErrorKind::kBadInput, "A sample type that palpate.h does not name"};
  }
  const auto wrong = std::find_if_not(volume.values.begin(), volume.values.end(),
                                      [](float value) { return std::isfinite(value); });
  if (wrong != volume.values.end())
    return Error{ErrorKind::kBadInput,
                 "A frame holds values that are not finite: replace them first"};
  files::reverse_j(grid, volume.values.data(), 1);
  return volume;
}

namespace {

/// Opens a device. `log`: of the context that is being opened.
Result<std::shared_ptr<vulkan::Context>> opened(const PalContextInfo& info,
                                                const ContextContent& log) {
  if (!info.vulkan) {
    vulkan::ContextOptions options;
    if (info.device) options.device = info.device;
    options.memory_cap_bytes = info.memory_cap_bytes;
    return vulkan::Context::open(options);
  }
  const PalVulkan& host = *info.vulkan;
  vulkan::SharedDevice shared;
  shared.instance = static_cast<VkInstance>(host.instance);
  shared.physical_device = static_cast<VkPhysicalDevice>(host.physical_device);
  shared.device = static_cast<VkDevice>(host.device);
  shared.queue = static_cast<VkQueue>(host.queue);
  shared.queue_family = host.queue_family;
  shared.has_extended_formats = host.has_extended_formats != 0;
  if (host.lock_queue)
    shared.lock_queue = [host]() -> Status {
      const Thrown thrown = call_host("lock_queue", [&] { host.lock_queue(host.user); });
      if (!thrown) return Nothing{};
      return Error{ErrorKind::kDeviceFailed,
                   std::string("locking the host's queue (") + thrown.sentence() + ")"};
    };
  if (host.unlock_queue)
    shared.unlock_queue = [host, log] {
      // The work has already been submitted, so it continues.
      if (const Thrown thrown = call_host("unlock_queue", [&] { host.unlock_queue(host.user); }))
        log.say(thrown.sentence());
    };
  return vulkan::Context::share(shared, info.memory_cap_bytes);
}

PalResult open_context(const PalContextInfo* given, PalContext** context) {
  if (!context) return failed(PAL_BAD_INPUT, {"The argument that takes the context is NULL"});
  PalContextInfo info;
  if (const PalResult read = taken(given, offsetof(PalContextInfo, device), "PalContextInfo", info);
      read != PAL_OK)
    return read;
  if (info.version >> 16 != PAL_VERSION_MAJOR ||
      (info.version >> 8 & 0xffU) > uint32_t(PAL_VERSION_MINOR))
    return failed(PAL_BAD_VERSION,
                  {"The program was compiled for another version of palpate than this library is: "
                   "set version to PAL_VERSION, and install the library of that version"});
  PalVulkan vulkan;
  if (info.vulkan) {
    if (const PalResult read =
            taken(info.vulkan, offsetof(PalVulkan, has_extended_formats), "PalVulkan", vulkan);
        read != PAL_OK)
      return read;
    info.vulkan = &vulkan;
  }
  if (const Status flags = check_flags("PalContextInfo", info.flags, PAL_CONTEXT_NO_GPU); !flags)
    return failed(flags.error());
  const files::NumberRange memory = files::in_unit(files::kDeviceMemory_mb, 1e6, "bytes");
  if (const Status cap = check_field("memory_cap_bytes", double(info.memory_cap_bytes), memory);
      !cap)
    return failed(cap.error());
  auto content = std::make_shared<ContextContent>();
  content->log = info.log;
  content->user = info.user;
  if (!(info.flags & PAL_CONTEXT_NO_GPU)) {
    auto device = opened(info, *content);
    if (!device) return failed(device.error());
    content->device = std::move(*device);
    content->device_name = content->device->info().name;
  }
  *context = reinterpret_cast<PalContext*>(Handle<ContextContent>::make(std::move(content)));
  return PAL_OK;
}

}  // namespace
}  // namespace palpate::toolkit

using namespace palpate::toolkit;

uint32_t pal_version(void) {
  return PAL_VERSION;
}

const char* pal_result_name(PalResult result) {
  switch (result) {
    case PAL_OK:
      return "PAL_OK";
    case PAL_NOT_YET:
      return "PAL_NOT_YET";
    case PAL_END:
      return "PAL_END";
    case PAL_BAD_INPUT:
      return "PAL_BAD_INPUT";
    case PAL_BAD_OUTPUT:
      return "PAL_BAD_OUTPUT";
    case PAL_NO_DEVICE:
      return "PAL_NO_DEVICE";
    case PAL_DEVICE_FAILED:
      return "PAL_DEVICE_FAILED";
    case PAL_OUT_OF_MEMORY:
      return "PAL_OUT_OF_MEMORY";
    case PAL_CANCELLED:
      return "PAL_CANCELLED";
    case PAL_BAD_VERSION:
      return "PAL_BAD_VERSION";
    case PAL_INTERNAL:
      return "PAL_INTERNAL";
  }
  return "no PalResult";
}

const char* pal_last_error(void) {
  return last_error.data();
}

PalResult pal_context_open(const PalContextInfo* info, PalContext** context) {
  return guarded([&] { return open_context(info, context); });
}

PalResult pal_context_close(PalContext** context) {
  return guarded([&] {
    closed(of(taken_out_of(context)));
    return PAL_OK;
  });
}

const char* pal_context_device(const PalContext* context) {
  const Use use(of(context));
  return use ? use->device_name.c_str() : "";
}
