// Swapchains: real images on the program's own Vulkan device.
#include <algorithm>

#include "tests/xr/runtime/world.h"

namespace palpate::test::fake {
namespace {

XrSession session_of(XrSwapchain handle) {
  const std::lock_guard lock(world().mutex);
  const auto* chain = world().find<Swapchain>(Kind::kSwapchain, id_of(handle));
  return chain ? handle_of<XrSession>(chain->parent) : XR_NULL_HANDLE;
}

Swapchain& chain_of(XrSwapchain handle) {
  return *world().find<Swapchain>(Kind::kSwapchain, id_of(handle));
}

}  // namespace

XrResult xr_EnumerateSwapchainFormats(XrSession handle, uint32_t capacity, uint32_t* count,
                                      int64_t* formats) {
  const Call call("xrEnumerateSwapchainFormats", handle);
  if (call.answered()) return call.answer();
  return enumerate(world().setup().formats, capacity, count, formats,
                   [](auto from, auto& to) { to = from; });
}

XrResult xr_CreateSwapchain(XrSession handle, const XrSwapchainCreateInfo* create,
                            XrSwapchain* made) {
  const Call call("xrCreateSwapchain", handle);
  if (call.answered()) return call.answer();
  World& w = world();
  const auto& formats = w.setup().formats;
  if (std::find(formats.begin(), formats.end(), create->format) == formats.end())
    return w.violation("xrCreateSwapchain: format", XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED);
  if (!create->width || !create->height || create->width > 8192 || create->height > 8192 ||
      create->sampleCount != 1 || create->faceCount != 1 || !create->arraySize || !create->mipCount)
    return w.violation("xrCreateSwapchain: sizes");
  Swapchain& chain = w.add<Swapchain>(Kind::kSwapchain, call.session->id);
  chain.info = *create;
  chain.images.resize(3);
  for (SwapchainImage& image : chain.images) {
    if (make_image(*call.session, *create, image) == VK_SUCCESS) continue;
    w.remove(chain.id);
    return XR_ERROR_OUT_OF_MEMORY;
  }
  *made = handle_of<XrSwapchain>(chain.id);
  return XR_SUCCESS;
}

XrResult xr_DestroySwapchain(XrSwapchain handle) {
  const Call call("xrDestroySwapchain", session_of(handle));
  if (!call.session) return call.answer();
  world().remove(id_of(handle));
  return XR_SUCCESS;
}

XrResult xr_EnumerateSwapchainImages(XrSwapchain handle, uint32_t capacity, uint32_t* count,
                                     XrSwapchainImageBaseHeader* images) {
  const Call call("xrEnumerateSwapchainImages", session_of(handle));
  if (call.answered()) return call.answer();
  bool typed = true;
  const XrResult result = enumerate(chain_of(handle).images, capacity, count,
                                    reinterpret_cast<XrSwapchainImageVulkanKHR*>(images),
                                    [&](const SwapchainImage& from, XrSwapchainImageVulkanKHR& to) {
                                      typed =
                                          typed && to.type == XR_TYPE_SWAPCHAIN_IMAGE_VULKAN_KHR;
                                      to.image = from.image;
                                    });
  return typed ? result : world().violation("xrEnumerateSwapchainImages: type");
}

XrResult xr_AcquireSwapchainImage(XrSwapchain handle, const XrSwapchainImageAcquireInfo*,
                                  uint32_t* index) {
  const Call call("xrAcquireSwapchainImage", session_of(handle));
  if (call.answered()) return call.answer();
  Swapchain& chain = chain_of(handle);
  if (chain.acquired.size() >= chain.images.size())
    return world().violation("xrAcquireSwapchainImage: all taken", XR_ERROR_CALL_ORDER_INVALID);
  *index = chain.next;
  chain.acquired.push_back(chain.next);
  chain.next = (chain.next + 1) % uint32_t(chain.images.size());
  return XR_SUCCESS;
}

XrResult xr_WaitSwapchainImage(XrSwapchain handle, const XrSwapchainImageWaitInfo* wait) {
  const Call call("xrWaitSwapchainImage", session_of(handle));
  if (call.answered()) return call.answer();
  Swapchain& chain = chain_of(handle);
  if (chain.acquired.empty() || chain.waited)
    return world().violation("xrWaitSwapchainImage: order", XR_ERROR_CALL_ORDER_INVALID);
  if (wait->type != XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO)
    return world().violation("xrWaitSwapchainImage: type");
  chain.waited = true;
  return XR_SUCCESS;
}

XrResult xr_ReleaseSwapchainImage(XrSwapchain handle, const XrSwapchainImageReleaseInfo*) {
  const Call call("xrReleaseSwapchainImage", session_of(handle));
  if (call.answered()) return call.answer();
  Swapchain& chain = chain_of(handle);
  if (chain.acquired.empty() || !chain.waited)
    return world().violation("xrReleaseSwapchainImage: order", XR_ERROR_CALL_ORDER_INVALID);
  chain.waited = false;
  chain.last_released = int(chain.acquired.front());
  chain.acquired.pop_front();
  return XR_SUCCESS;
}

}  // namespace palpate::test::fake
