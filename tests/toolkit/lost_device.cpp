#include "tests/toolkit/lost_device.h"

#include <dlfcn.h>
#include <vulkan/vulkan.h>

#include <mutex>
#include <set>

namespace {

std::mutex mutex;
bool next_is_lost = false;
std::set<VkQueue> lost;

bool is_lost(VkQueue queue) {
  const std::lock_guard lock(mutex);
  if (next_is_lost) lost.insert(queue);
  next_is_lost = false;
  return lost.contains(queue);
}

/// Looked up in the loader's file: a Python module loads the loader in a scope of its own, in which
/// RTLD_NEXT finds nothing.
template <class Function>
Function loaders(const char* name) {
  return reinterpret_cast<Function>(::dlsym(::dlopen("libvulkan.so.1", RTLD_NOW), name));
}

}  // namespace

extern "C" {

void lose_vulkan_device() {
  const std::lock_guard lock(mutex);
  next_is_lost = true;
}

VKAPI_ATTR VkResult VKAPI_CALL vkQueueSubmit(VkQueue queue, uint32_t count,
                                             const VkSubmitInfo* submits, VkFence fence) {
  static const auto submit = loaders<PFN_vkQueueSubmit>("vkQueueSubmit");
  static const auto idle = loaders<PFN_vkQueueWaitIdle>("vkQueueWaitIdle");
  if (!is_lost(queue)) return submit(queue, count, submits, fence);
  // A lost device must have finished its work before it returns the error.
  idle(queue);
  return VK_ERROR_DEVICE_LOST;
}

VKAPI_ATTR void VKAPI_CALL vkGetDeviceQueue(VkDevice device, uint32_t family, uint32_t index,
                                            VkQueue* queue) {
  static const auto get = loaders<PFN_vkGetDeviceQueue>("vkGetDeviceQueue");
  get(device, family, index, queue);
  // A new device may have its queue at the address of a lost one's.
  const std::lock_guard lock(mutex);
  lost.erase(*queue);
}

}  // extern "C"
