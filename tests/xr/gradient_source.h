#pragma once

#include <functional>
#include <optional>

#include "compute/vulkan/buffer.h"
#include "module/xr/picture_source.h"

namespace palpate::test {

/// Draws a picture that differs per view, column and row, and a depth that differs per row.
class GradientSource : public xr::PictureSource {
 public:
  Status use(const std::shared_ptr<vulkan::Context>& context) override;
  void drop() noexcept override;
  Result<xr::Drawn> record(const xr::HeadsetFrame& frame, VkCommandBuffer commands) override;
  double needed_period_s() const override { return needed_s; }
  std::optional<xr::HangingPanel> panel() override { return hanging; }

  static uint32_t color_at(uint32_t eye, uint32_t x, uint32_t y) {
    return 0xff000000U | (0x400000U + 0x800000U * (eye & 1U) + 0x200000U * (eye >> 1U)) |
           (y & 0xffU) << 8U | (x & 0xffU);
  }
  static float depth_at(uint32_t eye, uint32_t y) {
    return eye ? 0.75F : 0.25F + float(y) * 0.001F;
  }

  std::function<void(const xr::HeadsetFrame&)> on_frame;  ///< called with each frame
  std::optional<Error> fails_once;                        ///< of the next record()
  double needed_s = 0.0;                                  ///< needed_period_s() gives it
  bool with_color = true, with_depth = true;
  std::optional<xr::HangingPanel> hanging;  ///< panel() gives it
  /// use() fails.
  bool refuse = false;
  int uses = 0, drops = 0, frames = 0;
  std::optional<xr::HeadsetFrame> last;  ///< pointers in it are no longer valid
  xr::Hands hands;
  std::vector<glm::vec2> hidden;         ///< of the first view
  std::vector<size_t> hidden_triangles;  ///< indices of each view

 private:
  std::shared_ptr<vulkan::Context> context_;
  vulkan::Buffer color_, depth_;
};

}  // namespace palpate::test
