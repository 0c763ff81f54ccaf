#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "compute/vulkan/buffer.h"
#include "module/xr/headset.h"
#include "tests/xr/runtime/control.h"

namespace palpate::test {

/// Draws a picture that tells eye, column and row apart, and a depth that tells rows apart.
class GradientSource : public xr::FrameSource {
 public:
  Status use(const std::shared_ptr<vulkan::Context>& context) override;
  void drop() noexcept override;
  xr::Drawn record(const xr::Frame& frame, VkCommandBuffer commands) override;

  static uint32_t color_at(uint32_t eye, uint32_t x, uint32_t y) {
    return 0xff000000U | (eye ? 0xc00000U : 0x400000U) | (y & 0xffU) << 8U | (x & 0xffU);
  }
  static float depth_at(uint32_t eye, uint32_t y) {
    return eye ? 0.75F : 0.25F + float(y) * 0.001F;
  }

  std::function<void(const xr::Frame&)> on_frame;  ///< looks at each frame, may throw Failure
  bool with_color = true, with_depth = true;
  bool refuse = false;  ///< use() fails
  int uses = 0, drops = 0, frames = 0;
  std::optional<xr::Frame> last;  ///< pointers in it are no longer valid
  xr::Hands hands;
  std::vector<glm::vec2> hidden;

 private:
  std::shared_ptr<vulkan::Context> context_;
  vulkan::Buffer color_, depth_;
};

/// One runtime, reset before each test. Afterwards nothing may be alive, nothing may have been
/// called wrongly, and the Vulkan validation layers must have been silent.
class XrTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  fake::Control& runtime() { return fake::control(); }
  /// A headset with validation layers; it lives until the test's end or the next call.
  xr::Headset& headset(xr::HeadsetOptions options = {});
  /// Steps until `wanted` or until `steps` are done; the virtual time is 11 ms a step.
  xr::State step_until(xr::State wanted, int steps = 50);
  const xr::Report& step();
  const xr::Report& headset_report() const { return headset_->report(); }
  std::shared_ptr<vulkan::Context> headset_context() const { return headset_->context(); }
  xr::Headset* headset_pointer() { return headset_.get(); }
  /// Jumps, for what waits a second before it asks again.
  void pass(double seconds) { now_ns_ += int64_t(seconds * 1e9); }
  void close();
  void expect_silence();

  GradientSource source;
  int64_t now_ns_ = 0;
  bool expect_violations_ = false;

 private:
  std::unique_ptr<xr::Headset> headset_;
};

}  // namespace palpate::test
