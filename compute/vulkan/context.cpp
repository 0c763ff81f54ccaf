#include "compute/vulkan/context.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include "compute/volume/memory.h"

namespace palpate::vulkan {
namespace {

std::string name_of(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "the host is out of memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "the device is out of memory";
    case VK_ERROR_DEVICE_LOST:
      return "the device was lost";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "the driver failed to start";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no compatible driver";
    default:
      return "VkResult " + std::to_string(int(result));
  }
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

bool has_layer(const char* wanted) {
  uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  return std::any_of(layers.begin(), layers.end(),
                     [&](const auto& layer) { return std::strcmp(layer.layerName, wanted) == 0; });
}

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

VkResult create_instance(bool validation, VkInstance* instance, DeviceMaker* maker = nullptr) {
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.pApplicationName = "palpate";
  application.apiVersion = VK_API_VERSION_1_2;
  const std::array enabled{VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  VkValidationFeaturesEXT features{VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
  features.enabledValidationFeatureCount = uint32_t(enabled.size());
  features.pEnabledValidationFeatures = enabled.data();
#ifdef VK_EXT_layer_settings
  // Newer layers consider what shaders read and write only if they are told to.
  const VkBool32 on = VK_TRUE;
  const VkLayerSettingEXT setting{kValidationLayer, "syncval_shader_accesses_heuristic",
                                  VK_LAYER_SETTING_TYPE_BOOL32_EXT, 1, &on};
  VkLayerSettingsCreateInfoEXT settings{VK_STRUCTURE_TYPE_LAYER_SETTINGS_CREATE_INFO_EXT};
  settings.settingCount = 1;
  settings.pSettings = &setting;
  features.pNext = &settings;
#endif
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  create.pApplicationInfo = &application;
  if (validation) {
    create.pNext = &features;
    create.enabledLayerCount = 1;
    create.ppEnabledLayerNames = &kValidationLayer;
    create.enabledExtensionCount = 1;
    create.ppEnabledExtensionNames = &extension;
  }
  return maker ? maker->create_instance(create, instance)
               : vkCreateInstance(&create, nullptr, instance);
}

std::vector<VkPhysicalDevice> physical_devices(VkInstance instance) {
  uint32_t count = 0;
  vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(instance, &count, devices.data());
  return devices;
}

/// The first family with compute; UINT32_MAX if none.
uint32_t compute_family(VkPhysicalDevice device) {
  uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  for (uint32_t i = 0; i < count; ++i) {
    if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return i;
  }
  return UINT32_MAX;
}

// The usage of every image of image.cpp.
constexpr VkImageUsageFlags kImageUsage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                                          VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                                          VK_IMAGE_USAGE_TRANSFER_DST_BIT;

bool writes_without_format(VkPhysicalDevice device) {
  VkPhysicalDeviceFeatures features;
  vkGetPhysicalDeviceFeatures(device, &features);
  return features.shaderStorageImageWriteWithoutFormat == VK_TRUE;
}

/// What the device can not do with 3D images of the formats of frames, masks and fields; empty if
/// it can do everything. Vulkan guarantees neither linear filtering of 32-bit formats nor writing
/// to formats with one channel.
std::string missing_with_images(VkPhysicalDevice device) {
  struct Needed {
    VkFormat format;
    const char* name;
    bool linear;
  };
  constexpr std::array kNeeded{Needed{VK_FORMAT_R8_UNORM, "r8", false},
                               Needed{VK_FORMAT_R16_SFLOAT, "r16f", true},
                               Needed{VK_FORMAT_R16G16B16A16_SFLOAT, "rgba16f", true},
                               Needed{VK_FORMAT_R32G32_SFLOAT, "rg32f", true},
                               Needed{VK_FORMAT_R32G32B32A32_SFLOAT, "rgba32f", true}};
  std::string missing;
  const auto note = [&](const char* ability, const char* name) {
    missing += (missing.empty() ? "" : ", ") + std::string(ability) + " " + name + " 3D images";
  };
  for (const Needed& needed : kNeeded) {
    VkImageFormatProperties limits;
    if (vkGetPhysicalDeviceImageFormatProperties(device, needed.format, VK_IMAGE_TYPE_3D,
                                                 VK_IMAGE_TILING_OPTIMAL, kImageUsage, 0,
                                                 &limits) != VK_SUCCESS) {
      note("reading and writing of", needed.name);
      continue;
    }
    VkFormatProperties can;
    vkGetPhysicalDeviceFormatProperties(device, needed.format, &can);
    if (needed.linear &&
        !(can.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT))
      note("linear filtering of", needed.name);
  }
  return missing;
}

/// Everything that the engine needs and this device lacks, as text; empty if it is usable.
std::string missing_from(VkPhysicalDevice device, uint32_t api_version) {
  if (api_version < VK_API_VERSION_1_2) return "Vulkan 1.2";
  if (compute_family(device) == UINT32_MAX) return "a compute queue";
  if (!writes_without_format(device)) return "shaderStorageImageWriteWithoutFormat";
  return missing_with_images(device);
}

const char* kind_of(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete GPU";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated GPU";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual GPU";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "CPU";
    default:
      return "other";
  }
}

GpuInfo describe(VkPhysicalDevice device, int index) {
  VkPhysicalDeviceDriverProperties driver{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
  VkPhysicalDeviceProperties first;
  vkGetPhysicalDeviceProperties(device, &first);
  if (first.apiVersion >= VK_API_VERSION_1_2) properties.pNext = &driver;
  vkGetPhysicalDeviceProperties2(device, &properties);
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(device, &memory);

  GpuInfo info;
  info.index = index;
  info.name = first.deviceName;
  info.driver = std::string(driver.driverName) + " " + driver.driverInfo;
  info.kind = kind_of(first.deviceType);
  info.api_major = VK_API_VERSION_MAJOR(first.apiVersion);
  info.api_minor = VK_API_VERSION_MINOR(first.apiVersion);
  for (uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) {
      info.memory_bytes = std::max(info.memory_bytes, memory.memoryHeaps[i].size);
    }
  }
  // Debian 12's lavapipe reports 2 GB of any machine.
  const uint64_t machine = machine_memory().total_bytes;
  if (first.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU && machine > 0) info.memory_bytes = machine;
  info.binding_bytes = first.limits.maxStorageBufferRange;
  info.missing = missing_from(device, first.apiVersion);
  info.usable = info.missing.empty();
  return info;
}

/// The device that the user chose by index or part of the name; otherwise the first usable GPU,
/// else the first usable device.
Result<int> choose(const std::vector<GpuInfo>& devices, const std::string& wanted) {
  std::string known;
  int best = -1;
  for (const GpuInfo& device : devices) {
    known += (known.empty() ? "" : ", ") + std::to_string(device.index) + " " + device.name +
             (device.usable ? "" : " (lacks " + device.missing + ")");
    const bool match = wanted == std::to_string(device.index) ||
                       lower(device.name).find(lower(wanted)) != std::string::npos;
    if (!match || !device.usable) continue;
    if (!wanted.empty()) return device.index;
    if (best < 0 || (devices[size_t(best)].kind == "CPU" && device.kind != "CPU"))
      best = device.index;
  }
  if (best >= 0) return best;
  if (devices.empty()) {
    return Error{ErrorKind::kNoDevice,
                 "No Vulkan driver was found: install one (Debian: mesa-vulkan-drivers has "
                 "lavapipe for any CPU)."};
  }
  return Error{
      ErrorKind::kNoDevice,
      wanted.empty()
          ? "No Vulkan device here can do what palpate needs, install a driver that can (Debian: "
            "mesa-vulkan-drivers has lavapipe for any CPU): found " +
                known + "."
          : "No usable Vulkan device matches '" + wanted + "': found " + known + "."};
}

/// The index in `devices` of the device that `maker` requires.
Result<int> choose_through(DeviceMaker& maker, VkInstance instance,
                           const std::vector<VkPhysicalDevice>& devices,
                           const std::vector<GpuInfo>& infos) {
  VkPhysicalDevice wanted = VK_NULL_HANDLE;
  const VkResult asked = maker.choose_device(instance, &wanted);
  if (asked != VK_SUCCESS) return Failure(asked, "asking which device drives the display").error();
  const auto at = std::find(devices.begin(), devices.end(), wanted);
  if (at == devices.end())
    return Error{ErrorKind::kNoDevice, "The device that drives the display is not listed here."};
  const GpuInfo& info = infos[size_t(at - devices.begin())];
  if (info.usable) return info.index;
  return Error{ErrorKind::kNoDevice, "The device that drives the display, " + info.name +
                                         ", can not do what palpate needs: it lacks " +
                                         info.missing + "."};
}

}  // namespace

Failure::Failure(VkResult result, const std::string& doing)
    : std::runtime_error(name_of(result) + " while " + doing), result_(result) {}

Error Failure::error() const {
  if (result_ == VK_ERROR_OUT_OF_DEVICE_MEMORY || result_ == VK_ERROR_OUT_OF_HOST_MEMORY) {
    return {ErrorKind::kOutOfMemory,
            std::string("Vulkan: ") + what() +
                ": crop or mask the volume, or choose a Vulkan device with more memory."};
  }
  return {ErrorKind::kDeviceFailed,
          std::string("Vulkan: ") + what() + ": try again, or choose another Vulkan device."};
}

void check(VkResult result, const char* doing) {
  if (result != VK_SUCCESS) throw Failure(result, doing);
}

std::vector<GpuInfo> list_devices() {
  VkInstance instance = VK_NULL_HANDLE;
  if (create_instance(false, &instance) != VK_SUCCESS) return {};
  std::vector<GpuInfo> found;
  for (VkPhysicalDevice device : physical_devices(instance))
    found.push_back(describe(device, int(found.size())));
  vkDestroyInstance(instance, nullptr);
  return found;
}

VkBool32 VKAPI_PTR Context::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                       VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data,
                                       void* context) {
  auto* self = static_cast<Context*>(context);
  const std::lock_guard lock(self->message_mutex_);
  self->messages_.emplace_back(data->pMessage);
  return VK_FALSE;
}

void Context::listen() {
  VkDebugUtilsMessengerCreateInfoEXT create{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
  create.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  // Without performance hints: they advise against layout GENERAL, in which our images stay because
  // each is sampled, written and copied in turn.
  create.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  create.pfnUserCallback = &Context::on_message;
  create.pUserData = this;
  auto create_messenger = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
  if (create_messenger) create_messenger(instance_, &create, nullptr, &messenger_);
}

Result<std::shared_ptr<Context>> Context::open(const ContextOptions& options) {
  std::shared_ptr<Context> self(new Context);
  self->memory_cap_ = options.memory_cap_bytes;
  const bool validation = options.validation && has_layer(kValidationLayer);
  if (create_instance(validation, &self->instance_, options.maker) != VK_SUCCESS)
    return choose({}, options.device).error();
  if (validation) self->listen();

  const std::vector<VkPhysicalDevice> devices = physical_devices(self->instance_);
  std::vector<GpuInfo> infos;
  for (VkPhysicalDevice device : devices) infos.push_back(describe(device, int(infos.size())));
  const Result<int> index = options.maker
                                ? choose_through(*options.maker, self->instance_, devices, infos)
                                : choose(infos, options.device);
  if (!index) return index.error();
  self->info_ = infos[size_t(*index)];
  self->physical_device_ = devices[size_t(*index)];
  self->queue_family_ = compute_family(self->physical_device_);
  self->read_properties();

  const float priority = 0.5F;
  VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queue.queueFamilyIndex = self->queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  // Kernels write images without naming a format, so that one kernel serves fp16 and fp32 images.
  VkPhysicalDeviceFeatures features{};
  features.shaderStorageImageWriteWithoutFormat = VK_TRUE;
  VkPhysicalDeviceFeatures offered;
  vkGetPhysicalDeviceFeatures(self->physical_device_, &offered);
  features.shaderStorageImageExtendedFormats = offered.shaderStorageImageExtendedFormats;
  self->loads_extended_formats_ = offered.shaderStorageImageExtendedFormats == VK_TRUE;
  VkDeviceCreateInfo create{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
  create.pEnabledFeatures = &features;
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  const VkResult created =
      options.maker ? options.maker->create_device(self->physical_device_, create, &self->device_)
                    : vkCreateDevice(self->physical_device_, &create, nullptr, &self->device_);
  if (created != VK_SUCCESS) return Failure(created, "opening " + self->info_.name).error();
  vkGetDeviceQueue(self->device_, self->queue_family_, 0, &self->queue_);
  return self;
}

Result<std::shared_ptr<Context>> Context::share(const SharedDevice& shared,
                                                uint64_t memory_cap_bytes) {
  if (!shared.instance || !shared.physical_device || !shared.device || !shared.queue)
    return Error{
        ErrorKind::kBadInput,
        "A shared Vulkan device needs an instance, a physical device, a device and a queue."};
  if (bool(shared.lock_queue) != bool(shared.unlock_queue))
    return Error{
        ErrorKind::kBadInput,
        "A shared Vulkan queue needs both a way to lock it and one to unlock it, or none."};
  std::shared_ptr<Context> self(new Context);
  self->shared_ = true;
  self->memory_cap_ = memory_cap_bytes;
  self->info_ = describe(shared.physical_device, 0);
  if (!self->info_.usable)
    return Error{ErrorKind::kNoDevice, "The shared device, " + self->info_.name +
                                           ", can not do what palpate needs: it lacks " +
                                           self->info_.missing + "."};
  self->instance_ = shared.instance;
  self->physical_device_ = shared.physical_device;
  self->device_ = shared.device;
  self->queue_ = shared.queue;
  self->queue_family_ = shared.queue_family;
  self->lock_queue_ = shared.lock_queue;
  self->unlock_queue_ = shared.unlock_queue;
  self->loads_extended_formats_ = shared.has_extended_formats;
  self->read_properties();
  return self;
}

void Context::read_properties() {
  VkPhysicalDeviceMaintenance3Properties largest{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES};
  VkPhysicalDeviceProperties2 all{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &largest, {}};
  vkGetPhysicalDeviceProperties2(physical_device_, &all);
  limits_ = all.properties.limits;
  is_cpu_ = all.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  largest_image_ = largest.maxMemoryAllocationSize;
  // llvmpipe makes no larger ones, and does not say so.
  if (is_cpu_) largest_image_ = std::min(largest_image_, uint64_t(1) << 30);
  vkGetPhysicalDeviceMemoryProperties(physical_device_, &memory_);
}

Context::~Context() {
  // Objects created on a shared device have already waited for their own work.
  if (shared_) return;
  if (device_) {
    vkDeviceWaitIdle(device_);
    vkDestroyDevice(device_, nullptr);
  }
  if (messenger_) {
    auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
    if (destroy) destroy(instance_, messenger_, nullptr);
  }
  if (instance_) vkDestroyInstance(instance_, nullptr);
}

uint64_t Context::memory_budget_bytes() const {
  // Nine tenths: drivers and other programs need the rest.
  const uint64_t own = is_cpu_ ? memory_for_cpu_work() : 0;
  const uint64_t whole = own > 0 ? own : info_.memory_bytes / 10 * 9;
  return memory_cap_ ? std::min(whole, memory_cap_) : whole;
}

VkDeviceMemory Context::allocate(const VkMemoryRequirements& needed, MemoryKind kind) {
  const bool counted = kind == MemoryKind::kDevice;
  if (counted && memory_cap_ && memory_used_ + needed.size > memory_cap_) {
    throw Failure(VK_ERROR_OUT_OF_DEVICE_MEMORY, "reserving device memory under the given cap");
  }
  constexpr VkMemoryPropertyFlags kMapped =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const VkMemoryPropertyFlags wanted =
      counted ? VkMemoryPropertyFlags(VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT) : kMapped;
  VkMemoryPropertyFlags preferred = wanted;
  // Reading back through uncached memory is an order of magnitude slower.
  if (kind == MemoryKind::kHostVisible) preferred |= VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  if (kind == MemoryKind::kFilledByHost) preferred |= VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  for (const VkMemoryPropertyFlags flags : {preferred, wanted}) {
    for (uint32_t type = 0; type < memory_.memoryTypeCount; ++type) {
      if (!(needed.memoryTypeBits >> type & 1U)) continue;
      if ((memory_.memoryTypes[type].propertyFlags & flags) != flags) continue;
      VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
      allocate.allocationSize = needed.size;
      allocate.memoryTypeIndex = type;
      VkDeviceMemory memory = VK_NULL_HANDLE;
      const VkResult reserved = vkAllocateMemory(device_, &allocate, nullptr, &memory);
      // The part of the device's memory that the host can write may be small: then use host memory.
      if (reserved == VK_ERROR_OUT_OF_DEVICE_MEMORY && flags != wanted) continue;
      check(reserved, "reserving device memory");
      if (!counted) return memory;
      const uint64_t used = memory_used_ += needed.size;
      uint64_t peak = memory_peak_;
      while (used > peak && !memory_peak_.compare_exchange_weak(peak, used)) {
      }
      return memory;
    }
  }
  throw Failure(VK_ERROR_OUT_OF_DEVICE_MEMORY, "looking for a fitting kind of memory");
}

void Context::release(VkDeviceMemory memory, uint64_t bytes, MemoryKind kind) {
  vkFreeMemory(device_, memory, nullptr);
  if (kind == MemoryKind::kDevice) memory_used_ -= bytes;
}

void Context::submit(VkCommandBuffer commands, VkFence fence) {
  VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  const std::lock_guard lock(queue_mutex_);
  if (lock_queue_)
    if (const Status locked = lock_queue_(); !locked)
      throw Failure(VK_ERROR_UNKNOWN, locked.error().message);
  const VkResult submitted = vkQueueSubmit(queue_, 1, &submit, fence);
  if (unlock_queue_) unlock_queue_();
  check(submitted, "submitting work");
}

std::vector<std::string> Context::validation_messages() const {
  const std::lock_guard lock(message_mutex_);
  return messages_;
}

}  // namespace palpate::vulkan
