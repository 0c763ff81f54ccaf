#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "compute/vulkan/context.h"
#include "module/view/picture.h"
#include "module/xr/hands.h"
#include "module/xr/held_model.h"
#include "module/xr/pose.h"

namespace palpate::xr {

/// Half angles of one eye's picture, radians; left and down are negative as a rule.
struct Fov {
  double left = 0, right = 0, up = 0, down = 0;
};

/// The part of an eye's picture that the optics hide: triangles in the plane z = -1 of the eye.
/// Empty: nothing is hidden, or it is not known.
struct HiddenMesh {
  std::vector<glm::vec2> vertices;
  std::vector<uint32_t> triangles;  ///< three indices each
  bool operator==(const HiddenMesh&) const = default;
};

/// One view of a frame.
struct EyeView {
  Pose world_from_eye;
  Fov fov;
  VkExtent2D size{};                   ///< pixels to fill, from the image's corner (0, 0)
  const HiddenMesh* hidden = nullptr;  ///< never null; lives as long as the frame
};

/// An image of the runtime, in layout TRANSFER_DST_OPTIMAL while the source records; array layer i
/// is view i. What the source does not write is undefined.
struct Target {
  VkImage image = VK_NULL_HANDLE;
  VkFormat format = VK_FORMAT_UNDEFINED;
  VkExtent2D size{};
};

/// A frame to draw.
struct HeadsetFrame {
  int64_t display_time_ns = 0;     ///< of the monotonic clock: when it will be displayed
  bool display_time_exact = true;  ///< false: the runtime can not convert its time, it was guessed
  int64_t period_ns = 0;           ///< of the display
  /// Left, right; where the headset has a second pair in the middle of these, with more pixels per
  /// angle, that one too. At most 4.
  std::vector<EyeView> eyes;
  const Hands* hands = nullptr;  ///< never null; at the display time
  /// The controllers' shapes, where the runtime gives them; none while it gives no input.
  std::vector<HeldModel> held;
  Target color;
  Target depth;  ///< image is null where the runtime takes no depth
};

/// How the source drew.
struct Drawn {
  bool color = false;  ///< false: nothing to show this time
  bool depth = false;  ///< the depth target was written
  /// Pixels of each view that were filled, from the corner (0, 0), where fewer than EyeView::size:
  /// the whole view in fewer pixels, which the runtime enlarges. Empty: all of them.
  std::vector<VkExtent2D> sizes;
  /// Distances that depth 0 and 1 stand for, m. Reversed depth: near is the larger; infinity is
  /// allowed.
  float depth_0_m = 0.1F;
  float depth_1_m = 100.0F;
};

/// A flat picture that hangs in the room, such as text.
struct HangingPanel {
  /// Opaque; its depths are not used. Never null. Another pointer means other pixels: they are not
  /// compared.
  std::shared_ptr<const Picture> pixels;
  Pose world_from_panel;  ///< its middle; x to the right, y up, z towards the person
  double width_m = 0.0;   ///< of the picture; pixels are square
};

/// What is shown in the headset. All on the thread that calls Headset::step.
///
/// sRGB: `color.format` is an _SRGB one wherever the runtime offers one. Its bytes are to be
/// sRGB-encoded already. B8G8R8A8 wants blue first; a format that is not _SRGB, 8-bit _UNORM or
/// R16G16B16A16_SFLOAT, wants linear values (OpenXR 1.0, XrSwapchain).
class PictureSource {
 public:
  virtual ~PictureSource() = default;
  /// The device on which record() will work, called before the first record() and again whenever it
  /// is another one. What it takes to draw may be made here. An error is taken as kNoGraphics.
  virtual Status use(const std::shared_ptr<vulkan::Context>& context) = 0;
  /// Everything made on the device of the last use() must go: its work has ended.
  virtual void drop() noexcept = 0;
  /// Draws all eyes. The commands of the frame before have ended. The source records barriers for
  /// its own resources, the caller those for the targets. Errors: kDeviceFailed, kOutOfMemory; they
  /// are taken as kNoGraphics.
  virtual Result<Drawn> record(const HeadsetFrame& frame, VkCommandBuffer commands) = 0;
  /// The shortest period of a display in which its pictures are good enough, s, as measured; 0: not
  /// known yet. Called after record().
  virtual double needed_period_s() const { return 0.0; }
  /// What hangs beside the picture, in front of which it is drawn. Called after record(), for
  /// frames with a picture only.
  virtual std::optional<HangingPanel> panel() { return std::nullopt; }
};

}  // namespace palpate::xr
