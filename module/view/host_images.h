#pragma once

#include <vulkan/vulkan.h>

#include <array>

#include "compute/volume/result.h"
#include "compute/vulkan/buffer.h"
#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"
#include "module/view/picture.h"

namespace palpate {

/// A host's images, which a picture is drawn into: what the host has drawn hides the volumes behind
/// it, and is visible through those in front of it. They belong to the renderer's device, were
/// drawn on its queue before, have the picture's size and one sample, and can be source and target
/// of transfers.
struct HostImages {
  /// Formats that can be used: 8 bits of R, G, B and A in either order, _SRGB or _UNORM. Their
  /// bytes are taken as encoded for a display in either case.
  static bool takes_colour(VkFormat format);
  /// D32_SFLOAT, D32_SFLOAT_S8_UINT, X8_D24_UNORM_PACK32, D24_UNORM_S8_UINT; stencils stay as they
  /// are.
  static bool takes_depth(VkFormat format);

  struct OfEye {
    VkImage colour = VK_NULL_HANDLE;
    uint32_t colour_layer = 0;
    VkImage depth = VK_NULL_HANDLE;  ///< none: all that the host has drawn is behind the volumes
    uint32_t depth_layer = 0;
  };
  std::array<OfEye, 2> eyes;
  VkFormat colour_format = VK_FORMAT_UNDEFINED, depth_format = VK_FORMAT_UNDEFINED;
  /// In which they are, and are left.
  VkImageLayout colour_layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  VkImageLayout depth_layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
  /// 1 / z, 1/m, of the values 0 and 1 of the depth images, z along the eye's axis: {1 / near, 1 /
  /// far} usually, {0, 1 / near} for reversed depth without end.
  double inverse_depth_0 = 0.0, inverse_depth_1 = 0.0;
  bool writes_depth = false;  ///< where a volume takes half of the light, its depth goes there
};

namespace view {

/// kBadInput, in a sentence, for images that can not be drawn into.
Status check(const HostImages& images, int eyes);

/// The bits of raycast.comp's kBackdrop for these images.
uint32_t backdrop_bits(const HostImages& images);

/// Records the copies of the host's colours, and behind them its depths, into a buffer of 2 x 4
/// bytes per pixel and eye.
void record_from(const HostImages& images, int eyes, PictureSize size, vulkan::Recorder& recorder,
                 const vulkan::Buffer& backdrop);

/// Records the copies of the picture into the host's images.
void record_into(const HostImages& images, int eyes, PictureSize size, vulkan::Recorder& recorder,
                 const vulkan::Buffer& colour, const vulkan::Buffer& depth);

}  // namespace view
}  // namespace palpate
