#pragma once

#include <memory>
#include <optional>

#include "compute/vulkan/recorder.h"
#include "module/view/eye.h"

namespace palpate {

/// The renderer's colours in the bytes of another image format. OpenXR and Vulkan take values of
/// formats that are not _SRGB for linear, so for these the encoding is removed: with 8 bits dark
/// parts then show bands. One thread at a time. Errors: kDeviceFailed, kOutOfMemory.
class Repacker {
 public:
  /// Formats that a picture can be handed over in: 8 bits of R, G, B and A in either order, _SRGB
  /// or _UNORM, and R16G16B16A16_SFLOAT.
  static bool can(VkFormat format);
  /// Bytes are handed over as the renderer made them.
  static bool needless(VkFormat format) { return format == VK_FORMAT_R8G8B8A8_SRGB; }

  /// `format` is one that it can(); `most` is the largest picture, of so many eyes.
  static Result<std::unique_ptr<Repacker>> make(std::shared_ptr<vulkan::Context> context,
                                                VkFormat format, PictureSize most, int eyes);
  ~Repacker();

  /// Submits the work, after what was submitted before; does not wait. `colours`: as
  /// VolumeRenderer::colour(), of all the eyes.
  Status start(const vulkan::Buffer& colours, PictureSize size);
  /// Rows tight, the eyes one after the other; to be copied under the renderer's rules.
  const vulkan::Buffer& repacked() const { return repacked_; }
  VkFormat format() const { return format_; }
  uint64_t pixel_bytes() const;

 private:
  Repacker(std::shared_ptr<vulkan::Context> context, VkFormat format, PictureSize most, int eyes);

  std::shared_ptr<vulkan::Context> context_;
  VkFormat format_;
  int eyes_;
  vulkan::Kernel kernel_;
  vulkan::Buffer repacked_;
  std::unique_ptr<vulkan::Recorder> recorder_;
};

}  // namespace palpate
