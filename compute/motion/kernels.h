#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "compute/vulkan/image.h"
#include "compute/vulkan/kernel.h"
#include "compute/vulkan/recorder.h"

namespace palpate {

/// Every kernel of the motion engine, compiled at its first use and kept. Any thread.
class MotionKernels {
 public:
  /// How kernels read single texels (shaders/include/read.glsl). kAsSuits: as suits the device,
  /// only from images of the engine's formats. kFetched: through samplers, from images of any
  /// format. The values are the same.
  enum class Texels { kAsSuits, kFetched };
  explicit MotionKernels(std::shared_ptr<vulkan::Context> context,
                         Texels texels = Texels::kAsSuits);

  const vulkan::Kernel& downsample();
  const vulkan::Kernel& moments();
  /// radius: taps on one side, as in the push constants. format: of the images that are smoothed.
  const vulkan::Kernel& gauss(int radius, VkFormat format);
  const vulkan::Kernel& normalise();
  const vulkan::Kernel& pack(bool masked);
  const vulkan::Kernel& normal_equations(glm::ivec3 cell);
  const vulkan::Kernel& update();
  const vulkan::Kernel& update_two();
  const vulkan::Kernel& tv_primal(bool last);
  const vulkan::Kernel& tv_dual();
  const vulkan::Kernel& tv_second_primal();
  const vulkan::Kernel& tv_second_dual();
  const vulkan::Kernel& upsample();
  const vulkan::Kernel& upsample_cubic();
  const vulkan::Kernel& measure();
  const vulkan::Kernel& folds();
  const vulkan::Kernel& blend();
  const vulkan::Kernel& confidence();
  const vulkan::Kernel& matching_cost();
  const vulkan::Kernel& smooth_cost();
  const vulkan::Kernel& coupled_choice();
  const vulkan::Kernel& choose();
  const vulkan::Kernel& leave_out();
  const vulkan::Kernel& shared_noise();
  const vulkan::Kernel& refit();
  const vulkan::Kernel& left_out_error();
  const vulkan::Kernel& window_share();
  const vulkan::Kernel& sliding_moments();
  const vulkan::Kernel& sliding_cost(bool own, bool alone);
  const vulkan::Kernel& sliding_work();
  const vulkan::Kernel& sliding_find();
  const vulkan::Kernel& sliding_choose();
  const vulkan::Kernel& sliding_take();
  const vulkan::Kernel& blend_along();
  const vulkan::Kernel& median();
  const vulkan::Kernel& classic_force();

  /// Records to clear an image to 0, on a GPU much faster than Recorder::clear().
  void record_clear(vulkan::Recorder& recorder, const vulkan::Image& image);

  const vulkan::Sampler& nearest() const { return nearest_; }
  const vulkan::Sampler& linear() const { return linear_; }

 private:
  /// SPIR-V of a kernel that fetches single texels through samplers, and of the same kernel that
  /// loads them from storage images. Without the second, the first serves all devices.
  struct Code {
    template <size_t N>
    Code(const uint32_t (&all)[N]) : fetches(all) {}
    Code(std::span<const uint32_t> fetching, std::span<const uint32_t> loading)
        : fetches(fetching), loads(loading) {}
    std::span<const uint32_t> fetches, loads;
  };
  const vulkan::Kernel& get(const Code& code, uint32_t push_bytes,
                            std::vector<uint32_t> specialisation = {});

  std::shared_ptr<vulkan::Context> context_;
  bool loads_;
  vulkan::Sampler nearest_;
  vulkan::Sampler linear_;
  std::mutex mutex_;
  std::map<std::pair<const uint32_t*, std::vector<uint32_t>>, vulkan::Kernel> kernels_;
};

}  // namespace palpate
