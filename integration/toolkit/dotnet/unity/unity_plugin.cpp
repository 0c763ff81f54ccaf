// Unity's Vulkan device for palpate, and palpate's pictures in Unity's cameras.
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include "integration/toolkit/dotnet/unity/palpate_unity.h"
#include "integration/toolkit/dotnet/unity/unity_tables.h"

namespace palpate::unity {
namespace {

/// Functions of the Vulkan driver behind the plugin's own.
struct Driver {
  PFN_vkGetInstanceProcAddr get_instance_function;
  PFN_vkGetDeviceProcAddr get_device_function;
  PFN_vkCreateInstance create_instance;
  PFN_vkCreateDevice create_device;
  PFN_vkGetPhysicalDeviceFeatures get_features;
  PFN_vkQueueSubmit submit;
  PFN_vkQueueSubmit2 submit_2;
  PFN_vkQueueBindSparse bind_sparse;
  PFN_vkQueueWaitIdle wait_queue;
  PFN_vkDeviceWaitIdle wait_device;
  PFN_vkQueuePresentKHR present;
};

/// One plugin in one process: Unity's functions have no argument of ours.
struct Plugin {
  GraphicsTable* graphics = nullptr;
  VulkanTable* vulkan = nullptr;
  int event = 0;
  Driver driver{};
  VkDevice device = VK_NULL_HANDLE;  ///< that was made with what palpate needs
  bool writes_without_format = false, has_extended_formats = false;
  bool is_started = false;
  /// Held during every use of a queue: by Unity's through our functions, by palpate's through
  /// PalVulkan.
  std::mutex queue;
  std::string error;
};
Plugin plugin;

void lock_queue(void*) {
  plugin.queue.lock();
}
void unlock_queue(void*) {
  plugin.queue.unlock();
}

// ---- Vulkan functions that Unity gets instead of the driver's ----

VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                    const VkAllocationCallbacks* allocator, VkInstance* instance) {
  // palpate needs Vulkan 1.2; a program that asks for an older version does not get its functions.
  VkInstanceCreateInfo raised = *info;
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  if (info->pApplicationInfo) application = *info->pApplicationInfo;
  application.apiVersion = std::max(application.apiVersion, uint32_t(VK_API_VERSION_1_2));
  raised.pApplicationInfo = &application;
  VkResult result = plugin.driver.create_instance(&raised, allocator, instance);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
    result = plugin.driver.create_instance(info, allocator, instance);
  if (result != VK_SUCCESS) return result;
  const auto get = plugin.driver.get_instance_function;
  plugin.driver.create_device =
      reinterpret_cast<PFN_vkCreateDevice>(get(*instance, "vkCreateDevice"));
  plugin.driver.get_features = reinterpret_cast<PFN_vkGetPhysicalDeviceFeatures>(
      get(*instance, "vkGetPhysicalDeviceFeatures"));
  plugin.driver.get_device_function =
      reinterpret_cast<PFN_vkGetDeviceProcAddr>(get(*instance, "vkGetDeviceProcAddr"));
  return result;
}

VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                  const VkAllocationCallbacks* allocator, VkDevice* device) {
  VkPhysicalDeviceFeatures offered{};
  plugin.driver.get_features(physical, &offered);
  // Features stand in one of two places: in the chain, or in the member.
  VkPhysicalDeviceFeatures2* chained = nullptr;
  for (auto* next = static_cast<const VkBaseInStructure*>(info->pNext); next; next = next->pNext)
    if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2)
      chained = reinterpret_cast<VkPhysicalDeviceFeatures2*>(const_cast<VkBaseInStructure*>(next));
  VkDeviceCreateInfo changed = *info;
  VkPhysicalDeviceFeatures wanted{};
  if (chained) wanted = chained->features;
  if (!chained && info->pEnabledFeatures) wanted = *info->pEnabledFeatures;
  const VkPhysicalDeviceFeatures asked = wanted;
  wanted.shaderStorageImageWriteWithoutFormat |= offered.shaderStorageImageWriteWithoutFormat;
  wanted.shaderStorageImageExtendedFormats |= offered.shaderStorageImageExtendedFormats;
  if (chained)
    chained->features = wanted;
  else
    changed.pEnabledFeatures = &wanted;
  const VkResult result = plugin.driver.create_device(physical, &changed, allocator, device);
  if (chained) chained->features = asked;
  if (result != VK_SUCCESS) return result;

  plugin.device = *device;
  plugin.writes_without_format = wanted.shaderStorageImageWriteWithoutFormat;
  plugin.has_extended_formats = wanted.shaderStorageImageExtendedFormats;
  const auto take = [&]<class Function>(Function& function, const char* name) {
    function = reinterpret_cast<Function>(plugin.driver.get_device_function(*device, name));
  };
  Driver& driver = plugin.driver;
  take(driver.submit, "vkQueueSubmit");
  take(driver.submit_2, "vkQueueSubmit2");
  if (!driver.submit_2) take(driver.submit_2, "vkQueueSubmit2KHR");
  take(driver.bind_sparse, "vkQueueBindSparse");
  take(driver.wait_queue, "vkQueueWaitIdle");
  take(driver.wait_device, "vkDeviceWaitIdle");
  take(driver.present, "vkQueuePresentKHR");
  return result;
}

VkResult VKAPI_CALL submit(VkQueue queue, uint32_t count, const VkSubmitInfo* infos,
                           VkFence fence) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.submit(queue, count, infos, fence);
}
VkResult VKAPI_CALL submit_2(VkQueue queue, uint32_t count, const VkSubmitInfo2* infos,
                             VkFence fence) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.submit_2(queue, count, infos, fence);
}
VkResult VKAPI_CALL bind_sparse(VkQueue queue, uint32_t count, const VkBindSparseInfo* infos,
                                VkFence fence) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.bind_sparse(queue, count, infos, fence);
}
VkResult VKAPI_CALL wait_queue(VkQueue queue) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.wait_queue(queue);
}
VkResult VKAPI_CALL wait_device(VkDevice device) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.wait_device(device);
}
VkResult VKAPI_CALL present(VkQueue queue, const VkPresentInfoKHR* info) {
  const std::lock_guard lock(plugin.queue);
  return plugin.driver.present(queue, info);
}

PFN_vkVoidFunction VKAPI_CALL get_instance_function(VkInstance instance, const char* name);
PFN_vkVoidFunction VKAPI_CALL get_device_function(VkDevice device, const char* name);

/// The plugin's function of that name; null: the driver's is used.
PFN_vkVoidFunction own_function(const char* name) {
  const std::pair<const char*, PFN_vkVoidFunction> all[] = {
      {"vkGetInstanceProcAddr", reinterpret_cast<PFN_vkVoidFunction>(&get_instance_function)},
      {"vkGetDeviceProcAddr", reinterpret_cast<PFN_vkVoidFunction>(&get_device_function)},
      {"vkCreateInstance", reinterpret_cast<PFN_vkVoidFunction>(&create_instance)},
      {"vkCreateDevice", reinterpret_cast<PFN_vkVoidFunction>(&create_device)},
      {"vkQueueSubmit", reinterpret_cast<PFN_vkVoidFunction>(&submit)},
      {"vkQueueSubmit2", reinterpret_cast<PFN_vkVoidFunction>(&submit_2)},
      {"vkQueueSubmit2KHR", reinterpret_cast<PFN_vkVoidFunction>(&submit_2)},
      {"vkQueueBindSparse", reinterpret_cast<PFN_vkVoidFunction>(&bind_sparse)},
      {"vkQueueWaitIdle", reinterpret_cast<PFN_vkVoidFunction>(&wait_queue)},
      {"vkDeviceWaitIdle", reinterpret_cast<PFN_vkVoidFunction>(&wait_device)},
      {"vkQueuePresentKHR", reinterpret_cast<PFN_vkVoidFunction>(&present)},
  };
  for (const auto& [known, function] : all)
    if (std::strcmp(known, name) == 0) return function;
  return nullptr;
}

PFN_vkVoidFunction VKAPI_CALL get_instance_function(VkInstance instance, const char* name) {
  const PFN_vkVoidFunction theirs = plugin.driver.get_instance_function(instance, name);
  const PFN_vkVoidFunction ours = own_function(name);
  return theirs && ours ? ours : theirs;
}

PFN_vkVoidFunction VKAPI_CALL get_device_function(VkDevice device, const char* name) {
  const PFN_vkVoidFunction theirs = plugin.driver.get_device_function(device, name);
  const PFN_vkVoidFunction ours = own_function(name);
  return theirs && ours ? ours : theirs;
}

PFN_vkGetInstanceProcAddr PALPATE_UNITY_CALL before_vulkan(PFN_vkGetInstanceProcAddr loader,
                                                           void*) {
  plugin.driver = {};
  plugin.driver.get_instance_function = loader;
  plugin.driver.create_instance =
      reinterpret_cast<PFN_vkCreateInstance>(loader(VK_NULL_HANDLE, "vkCreateInstance"));
  return plugin.driver.create_instance ? &get_instance_function : loader;
}

// ---- events of Unity ----

void PALPATE_UNITY_CALL on_graphics(GraphicsEvent event) {
  if (event == GraphicsEvent::kShutdown) {
    plugin.is_started = false;
    plugin.device = VK_NULL_HANDLE;
  }
  if (event != GraphicsEvent::kInitialize || plugin.graphics->renderer() != kRendererVulkan) return;
  plugin.is_started = true;
  // Images are accessed outside of a render pass. The queue is asked for when their layouts are
  // known: inside an event that has it, no image may be accessed.
  const EventNeeds needs{EventNeeds::kOutside, EventNeeds::kNoQueue,
                         EventNeeds::kPreviousFrameSubmitted | EventNeeds::kChangesState};
  plugin.vulkan->configure_event(plugin.event, &needs);
}

void finish(PalUnityPicture& picture, PalResult result, const char* sentence) {
  picture.result = result;
  std::snprintf(picture.sentence, sizeof picture.sentence, "%s", sentence);
  std::atomic_ref(picture.is_done).store(1, std::memory_order_release);
}

/// The library that the script has loaded, under whatever name its file has. The plugin is not
/// linked with it: Unity loads plugins in no particular order.
template <class Function>
Function* function_of_palpate(const char* name) {
#ifdef _WIN32
  const HMODULE library = GetModuleHandleW(L"palpate.dll");
  using Any = void (*)();
  return library ? reinterpret_cast<Function*>(reinterpret_cast<Any>(GetProcAddress(library, name)))
                 : nullptr;
#else
  void* library = nullptr;
  for (const char* file : {"libpalpate.so.0", "libpalpate.so"})
    if (!library) library = dlopen(file, RTLD_NOW | RTLD_NOLOAD);
  if (!library) return nullptr;
  auto* const found = reinterpret_cast<Function*>(dlsym(library, name));
  dlclose(library);  // counted down: the script keeps it
  return found;
#endif
}

/// While Unity does not use its queue, and after what it drew.
void PALPATE_UNITY_CALL draw_picture(int, void* data) {
  PalUnityPicture& picture = *static_cast<PalUnityPicture*>(data);
  auto* const render = function_of_palpate<decltype(pal_view_render)>("pal_view_render");
  auto* const last_error = function_of_palpate<decltype(pal_last_error)>("pal_last_error");
  if (!render || !last_error)
    return finish(picture, PAL_INTERNAL, "palpate's library is not loaded in this process");
  const PalResult result = render(picture.view, picture.eyes, picture.eye_count, picture.width,
                                  picture.height, picture.ahead_s, &picture.images);
  finish(picture, result, result < PAL_OK ? last_error() : "");
}

/// On Unity's render thread: brings the images into layouts that are known, and draws when Unity's
/// commands so far are on the queue.
void PALPATE_UNITY_CALL on_picture(int event, void* data) {
  if (event != plugin.event || !data) return;
  PalUnityPicture& picture = *static_cast<PalUnityPicture*>(data);
  if (picture.size != sizeof picture || picture.eye_count < 1 || picture.eye_count > 2)
    return finish(picture, PAL_BAD_INPUT, "The picture's size or number of eyes is wrong");
  if (!plugin.is_started)
    return finish(picture, PAL_NO_DEVICE, "Unity has no Vulkan device any more");
  PalImages& images = picture.images;
  images = {};
  images.size = sizeof images;
  images.writes_depth = picture.writes_depth;
  images.colour_layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  images.depth_layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
  images.inverse_depth_0 = picture.inverse_depth_0;
  images.inverse_depth_1 = picture.inverse_depth_1;
  picture.width = picture.height = 0;
  // Accesses an image of an eye; false if it is not one that palpate can draw into.
  const auto access = [&](void* buffer, uint32_t layout, uint64_t& handle, uint32_t& format) {
    constexpr VkImageUsageFlags kCopied =
        VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    UnityImage image{};
    if (!buffer || !plugin.vulkan->access_buffer_texture(
                       buffer, nullptr, VkImageLayout(layout), VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                       VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT,
                       TextureAccess::kBarrier, &image))
      return false;
    const bool is_first = picture.width == 0;
    if (is_first) {
      picture.width = image.extent.width;
      picture.height = image.extent.height;
    }
    const bool same_format = format == 0 || format == uint32_t(image.format);
    handle = uint64_t(image.image);
    format = uint32_t(image.format);
    return (image.usage & kCopied) == kCopied && image.samples == VK_SAMPLE_COUNT_1_BIT &&
           image.extent.width == picture.width && image.extent.height == picture.height &&
           same_format;
  };
  for (uint32_t e = 0; e < picture.eye_count; ++e) {
    images.colour_layer[e] = picture.colour_layer[e];
    images.depth_layer[e] = picture.depth_layer[e];
    if (!access(picture.colour[e], images.colour_layout, images.colour[e], images.colour_format))
      return finish(picture, PAL_BAD_INPUT,
                    "The colour image of an eye can not be drawn into: it must have one sample per "
                    "pixel, allow transfers, and be as large as that of the other eye");
    if (picture.depth[e] &&
        !access(picture.depth[e], images.depth_layout, images.depth[e], images.depth_format))
      return finish(picture, PAL_BAD_INPUT,
                    "The depth image of an eye can not be used: it must have one sample per pixel, "
                    "allow transfers, and be as large as the colour image");
  }
  plugin.vulkan->access_queue(&draw_picture, event, data, true);
}

PalResult refuse(const char* sentence) {
  plugin.error = sentence;
  return PAL_NO_DEVICE;
}

}  // namespace
}  // namespace palpate::unity

using namespace palpate::unity;

// Unity calls these two by their names.
// NOLINTNEXTLINE(readability-identifier-naming)
PALPATE_UNITY_EXPORT void PALPATE_UNITY_CALL UnityPluginLoad(Tables* tables) {
#ifdef _WIN32
  // Unity may call its functions of Vulkan as long as it runs. (On Linux the linker says this.)
  HMODULE kept = nullptr;
  GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_PIN,
                     reinterpret_cast<LPCWSTR>(&plugin), &kept);
#endif
  plugin.graphics = static_cast<GraphicsTable*>(tables->get(kGraphicsKey));
  plugin.vulkan = static_cast<VulkanTable*>(tables->get(kVulkanKey));
  if (!plugin.graphics || !plugin.vulkan) return;
  plugin.device = VK_NULL_HANDLE;
  plugin.event = plugin.graphics->reserve_events(1);
  plugin.vulkan->add_init_hook(&before_vulkan, nullptr, 0);
  plugin.graphics->add_listener(&on_graphics);
  // Where Unity's device exists already, its event has passed.
  on_graphics(GraphicsEvent::kInitialize);
}

// NOLINTNEXTLINE(readability-identifier-naming)
PALPATE_UNITY_EXPORT void PALPATE_UNITY_CALL UnityPluginUnload() {
  if (!plugin.graphics || !plugin.vulkan) return;
  plugin.graphics->remove_listener(&on_graphics);
  plugin.vulkan->remove_init_hook(&before_vulkan);
  plugin.is_started = false;
}

PALPATE_UNITY_EXPORT PalResult palpate_unity_device(PalVulkan* vulkan) {
  if (!plugin.graphics) return refuse("The plugin was not loaded by Unity");
  if (!plugin.vulkan || plugin.graphics->renderer() != kRendererVulkan)
    return refuse("Unity does not draw with Vulkan: choose Vulkan as its graphics API");
  const UnityDevice unity = plugin.vulkan->device();
  if (!plugin.is_started || !plugin.device || unity.device != plugin.device)
    return refuse(
        "The plugin was loaded after Unity had made its Vulkan device: switch on \"Load on "
        "startup\" "
        "in its import settings and start Unity again");
  if (!plugin.writes_without_format)
    return refuse("This GPU lacks shaderStorageImageWriteWithoutFormat, which palpate needs");
  plugin.error.clear();
  *vulkan = {};
  vulkan->size = sizeof *vulkan;
  vulkan->queue_family = unity.queue_family;
  vulkan->instance = unity.instance;
  vulkan->physical_device = unity.physical;
  vulkan->device = unity.device;
  vulkan->queue = unity.queue;
  vulkan->has_extended_formats = plugin.has_extended_formats;
  vulkan->lock_queue = &lock_queue;
  vulkan->unlock_queue = &unlock_queue;
  return PAL_OK;
}

PALPATE_UNITY_EXPORT const char* palpate_unity_error(void) {
  return plugin.error.c_str();
}
PALPATE_UNITY_EXPORT void* palpate_unity_event(void) {
  return reinterpret_cast<void*>(&on_picture);
}
PALPATE_UNITY_EXPORT int palpate_unity_event_id(void) {
  return plugin.event;
}
