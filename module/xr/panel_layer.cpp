#include "module/xr/panel_layer.h"

#include <glm/gtc/packing.hpp>

#include "compute/vulkan/tried.h"

namespace palpate::xr {
namespace {

/// Writes opaque pixels, R in the lowest byte and sRGB, in the bytes of a format of
/// colour_format(): what is not _SRGB takes linear values.
void write_as(VkFormat format, const std::vector<uint32_t>& colours, std::span<uint32_t> words) {
  const bool blue_first = format == VK_FORMAT_B8G8R8A8_SRGB || format == VK_FORMAT_B8G8R8A8_UNORM;
  const bool encoded = format == VK_FORMAT_R8G8B8A8_SRGB || format == VK_FORMAT_B8G8R8A8_SRGB;
  const bool halves = format == VK_FORMAT_R16G16B16A16_SFLOAT;
  for (size_t i = 0; i < colours.size(); ++i) {
    const glm::vec3 light = encoded ? glm::vec3(0.0F) : light_of(colours[i]);
    if (halves) {
      words[2 * i] = glm::packHalf2x16({light.r, light.g});
      words[2 * i + 1] = glm::packHalf2x16({light.b, 1.0F});
      continue;
    }
    const uint32_t c = encoded ? colours[i] : glm::packUnorm4x8({light, 1.0F});
    const uint32_t red = c & 0xffU, blue = c >> 16 & 0xffU;
    words[i] = blue_first ? 0xff000000U | red << 16 | (c & 0xff00U) | blue : c | 0xff000000U;
  }
}

uint64_t pixel_bytes(VkFormat format) {
  return format == VK_FORMAT_R16G16B16A16_SFLOAT ? 8 : 4;
}

}  // namespace

Outcome<std::optional<XrCompositionLayerQuad>> PanelLayer::show(const OpenXrSession& session,
                                                                const HangingPanel& panel) {
  const Picture& pixels = *panel.pixels;
  if (panel.pixels != shown_) {
    Done done = prepare(session, pixels);
    if (done) done = upload(pixels);
    if (!done) return done.error();
    if (!chain_->acquired()) shown_ = panel.pixels;
  }
  if (!shown_) return std::optional<XrCompositionLayerQuad>();
  XrCompositionLayerQuad quad{XR_TYPE_COMPOSITION_LAYER_QUAD};
  quad.eyeVisibility = XR_EYE_VISIBILITY_BOTH;
  quad.subImage = {chain_->handle(), {{0, 0}, {pixels.width, pixels.height}}, 0};
  quad.size = {float(panel.width_m), float(panel.width_m * pixels.height / pixels.width)};
  return std::optional(quad);
}

/// The images and the buffer, for pictures of this size.
Done PanelLayer::prepare(const OpenXrSession& session, const Picture& pixels) {
  const VkExtent2D size{uint32_t(pixels.width), uint32_t(pixels.height)};
  if (chain_ && chain_->size().width == size.width && chain_->size().height == size.height)
    return Nothing{};
  commands_.reset();
  chain_.reset();
  shown_.reset();
  const auto format = colour_format(session);
  if (!format) return format.error();
  auto chain = Swapchain::make_colour(session, *format, size, 1);
  if (!chain) return chain.error();
  chain_.emplace(std::move(*chain));
  const Status made = vulkan::tried([&]() -> Status {
    bytes_ = vulkan::Buffer(context_, pixel_bytes(*format) * size.width * size.height,
                            vulkan::MemoryKind::kHostVisible);
    return Nothing{};
  });
  if (!made) return of_device(made.error());
  auto commands = FrameCommands::make(context_);
  if (!commands) return of_device(commands.error());
  commands_ = std::move(*commands);
  return Nothing{};
}

/// After this the chain's image is acquired only if the compositor did not give it in time.
Done PanelLayer::upload(const Picture& pixels) {
  const auto image = chain_->acquire();
  if (!image) return image.error();
  if (!*image) return Nothing{};
  const Target target{**image, chain_->format(), chain_->size()};
  const auto copied = commands_->run(target, {}, [&](VkCommandBuffer commands) -> Result<Drawn> {
    // The copy before has ended: run() waits for it before it calls.
    write_as(target.format, pixels.colours, bytes_.as<uint32_t>());
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {target.size.width, target.size.height, 1};
    vkCmdCopyBufferToImage(commands, bytes_.handle(), target.image,
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    return Drawn{.color = true};
  });
  const Done released = chain_->release();
  if (!copied) return of_device(copied.error());
  return released;
}

}  // namespace palpate::xr
