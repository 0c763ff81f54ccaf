#include "module/xr/swapchains.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace palpate::xr {
namespace {

constexpr XrSwapchainUsageFlags kShared =
    XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT | XR_SWAPCHAIN_USAGE_SAMPLED_BIT;
constexpr XrDuration kPatience = 1'000'000'000;  // ns: far more than any frame, less than a hang

Outcome<std::vector<int64_t>> offered_formats(const OpenXrSession& session) {
  constexpr const char* kCall = "xrEnumerateSwapchainFormats";
  uint32_t count = 0;
  XrResult result = xrEnumerateSwapchainFormats(session.handle(), 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  std::vector<int64_t> offered(count);
  result = xrEnumerateSwapchainFormats(session.handle(), count, &count, offered.data());
  if (XR_FAILED(result)) return problem_of(kCall, result);
  offered.resize(count);
  return offered;
}

/// The first takes the renderer's bytes as they are, the second swapped. What is not _SRGB is taken
/// as linear, for which 8 bits are too few in dark parts, so half floats are preferred.
constexpr std::array kColours{VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB,
                              VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R8G8B8A8_UNORM,
                              VK_FORMAT_B8G8R8A8_UNORM};

/// The first format of our list that is offered. The runtime's order suits a renderer that can draw
/// into any format; ours suits the bytes of our pictures.
template <size_t n>
std::optional<VkFormat> first(const std::array<VkFormat, n>& ours,
                              const std::vector<int64_t>& offered) {
  for (const VkFormat format : ours)
    if (std::find(offered.begin(), offered.end(), int64_t(format)) != offered.end()) return format;
  return std::nullopt;
}

Problem no_format(const std::vector<int64_t>& offered) {
  std::string numbers;
  for (const int64_t format : offered)
    numbers += (numbers.empty() ? "" : ", ") + std::to_string(format);
  return {Trouble::kUnsupported,
          "The OpenXR runtime offers no picture format that palpate can fill, which are 8-bit "
          "colour and R16G16B16A16_SFLOAT (it offers " +
              (numbers.empty() ? "none at all" : "these VkFormat numbers: " + numbers) +
              "): choose another runtime with XR_RUNTIME_JSON.",
          "xrEnumerateSwapchainFormats", XR_SUCCESS};
}

VkExtent2D scaled(const XrViewConfigurationView& view, const System& system, double scale) {
  const auto one = [&](uint32_t recommended, uint32_t view_max, uint32_t system_max) {
    const uint32_t most = system_max ? std::min(view_max, system_max) : view_max;
    const double wanted = std::round(double(recommended) * scale);
    return uint32_t(std::clamp(wanted, 1.0, std::max(1.0, double(most))));
  };
  return {one(view.recommendedImageRectWidth, view.maxImageRectWidth, system.max_width),
          one(view.recommendedImageRectHeight, view.maxImageRectHeight, system.max_height)};
}

}  // namespace

Outcome<VkFormat> colour_format(const OpenXrSession& session) {
  const auto offered = offered_formats(session);
  if (!offered) return offered.error();
  const auto format = first(kColours, *offered);
  if (!format) return no_format(*offered);
  return *format;
}

Outcome<Swapchain> Swapchain::make_colour(const OpenXrSession& session, VkFormat format,
                                          VkExtent2D size, uint32_t layers) {
  return make(session, format, size, layers, kShared | XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT);
}

Outcome<Swapchain> Swapchain::make(const OpenXrSession& session, VkFormat format, VkExtent2D size,
                                   uint32_t layers, XrSwapchainUsageFlags usage) {
  XrSwapchainCreateInfo create{XR_TYPE_SWAPCHAIN_CREATE_INFO};
  create.usageFlags = usage;
  create.format = int64_t(format);
  create.sampleCount = 1;
  create.width = size.width;
  create.height = size.height;
  create.faceCount = 1;
  create.arraySize = layers;
  create.mipCount = 1;
  Swapchain made(session.context());
  made.format_ = format;
  made.size_ = size;
  {
    const auto queue = made.context_->hold_queue();
    const Done created =
        done("xrCreateSwapchain", xrCreateSwapchain(session.handle(), &create, made.handle_.out()));
    if (!created) return created.error();
  }
  const Done known = made.enumerate();
  if (!known) return known.error();
  return made;
}

Done Swapchain::enumerate() {
  constexpr const char* kCall = "xrEnumerateSwapchainImages";
  uint32_t count = 0;
  XrResult result = xrEnumerateSwapchainImages(handle(), 0, &count, nullptr);
  if (XR_FAILED(result)) return problem_of(kCall, result);
  std::vector<XrSwapchainImageVulkan2KHR> images(count, {XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR});
  result = xrEnumerateSwapchainImages(handle(), count, &count,
                                      reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data()));
  if (XR_FAILED(result)) return problem_of(kCall, result);
  for (const XrSwapchainImageVulkan2KHR& image : images) images_.push_back(image.image);
  return Nothing{};
}

Swapchain::~Swapchain() {
  if (!handle_) return;
  const auto queue = context_->hold_queue();
  handle_ = {};
}

Outcome<std::optional<VkImage>> Swapchain::acquire() {
  if (!acquired_) {
    const auto queue = context_->hold_queue();
    XrSwapchainImageAcquireInfo acquire{XR_TYPE_SWAPCHAIN_IMAGE_ACQUIRE_INFO};
    const XrResult result = xrAcquireSwapchainImage(handle(), &acquire, &index_);
    if (XR_FAILED(result)) return problem_of("xrAcquireSwapchainImage", result);
    acquired_ = true;
  }
  // Not under the queue's lock: the compositor may take long, and others use the queue.
  XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO};
  wait.timeout = kPatience;
  const XrResult result = xrWaitSwapchainImage(handle(), &wait);
  if (XR_FAILED(result)) return problem_of("xrWaitSwapchainImage", result);
  if (result == XR_TIMEOUT_EXPIRED) return std::optional<VkImage>();
  waited_ = true;
  if (index_ >= images_.size())
    return problem_of("xrAcquireSwapchainImage", XR_ERROR_RUNTIME_FAILURE);
  return std::optional<VkImage>(images_[index_]);
}

Done Swapchain::release() {
  acquired_ = waited_ = false;
  const auto queue = context_->hold_queue();
  XrSwapchainImageReleaseInfo release{XR_TYPE_SWAPCHAIN_IMAGE_RELEASE_INFO};
  return done("xrReleaseSwapchainImage", xrReleaseSwapchainImage(handle(), &release));
}

Outcome<Swapchains> Swapchains::make(const OpenXrSession& session, const System& system, bool depth,
                                     double view_scale) {
  const auto format = colour_format(session);
  if (!format) return format.error();
  VkExtent2D largest{};
  const auto sizes_of = [&](const std::vector<XrViewConfigurationView>& views) {
    std::vector<VkExtent2D> sizes;
    for (const XrViewConfigurationView& view : views) {
      const VkExtent2D size = sizes.emplace_back(scaled(view, system, view_scale));
      largest = {std::max(largest.width, size.width), std::max(largest.height, size.height)};
    }
    return sizes;
  };
  const std::vector<VkExtent2D> eyes = sizes_of(system.views);
  const std::vector<VkExtent2D> gaze_eyes = sizes_of(system.gaze_views);
  const auto layers = uint32_t(eyes.size());
  auto color = Swapchain::make_colour(session, *format, largest, layers);
  if (!color) return color.error();
  Swapchains made{std::move(*color), std::nullopt, eyes, gaze_eyes};
  const auto offered = offered_formats(session);
  if (!offered) return offered.error();
  const auto depth_format = first(std::array{VK_FORMAT_D32_SFLOAT}, *offered);
  if (depth && depth_format) {
    auto chain = Swapchain::make(session, *depth_format, largest, layers,
                                 kShared | XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
    // The picture does not need depth: it is left out if the runtime offers it but can not make it.
    if (chain)
      made.depth.emplace(std::move(*chain));
    else if (chain.error().trouble == Trouble::kInstanceLost ||
             chain.error().trouble == Trouble::kSessionLost)
      return chain.error();
  }
  return made;
}

}  // namespace palpate::xr
