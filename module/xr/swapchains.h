#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "compute/vulkan/context.h"
#include "module/xr/session.h"

namespace palpate::xr {

/// Images shared with the compositor. Move-only. Calls that may use the queue lock it.
class Swapchain {
 public:
  /// layers: one per view of a picture.
  static Outcome<Swapchain> make(const OpenXrSession& session, VkFormat format, VkExtent2D size,
                                 uint32_t layers, XrSwapchainUsageFlags usage);
  /// Of colour pictures, in a format that colour_format() gives.
  static Outcome<Swapchain> make_colour(const OpenXrSession& session, VkFormat format,
                                        VkExtent2D size, uint32_t layers);
  ~Swapchain();
  Swapchain(Swapchain&&) = default;
  Swapchain& operator=(Swapchain&&) = delete;

  /// Acquires the next image and waits until the compositor no longer uses it; none if that takes
  /// longer than a second. In both cases the image stays acquired until release().
  Outcome<std::optional<VkImage>> acquire();
  Done release();
  bool acquired() const { return acquired_; }
  /// It was acquired and its wait has succeeded: only then may it be released.
  bool waited() const { return waited_; }

  XrSwapchain handle() const { return handle_.get(); }
  VkFormat format() const { return format_; }
  VkExtent2D size() const { return size_; }

 private:
  explicit Swapchain(vulkan::Context& context) : context_(&context) {}
  Done enumerate();

  vulkan::Context* context_;
  XrHandle<XrSwapchain, xrDestroySwapchain> handle_;
  std::vector<VkImage> images_;
  VkFormat format_ = VK_FORMAT_UNDEFINED;
  VkExtent2D size_{};
  uint32_t index_ = 0;
  bool acquired_ = false, waited_ = false;
};

/// The first that the runtime offers of R8G8B8A8_SRGB, B8G8R8A8_SRGB, R16G16B16A16_SFLOAT and the
/// 8-bit _UNORM ones; kUnsupported if none is.
Outcome<VkFormat> colour_format(const OpenXrSession& session);

/// Sixth in the life cycle: colour, and depth where the runtime takes it.
struct Swapchains {
  Swapchain color;
  std::optional<Swapchain> depth;
  std::vector<VkExtent2D> eyes;       ///< what of the images each view fills
  std::vector<VkExtent2D> gaze_eyes;  ///< the same while the second pair follows the gaze

  /// Sizes are the recommended ones times view_scale, within what the runtime can.
  static Outcome<Swapchains> make(const OpenXrSession& session, const System& system, bool depth,
                                  double view_scale);
};

}  // namespace palpate::xr
