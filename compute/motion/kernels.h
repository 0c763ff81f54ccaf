#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "compute/vulkan/image.h"
#include "compute/vulkan/kernel.h"

namespace palpate {

/// Every kernel of the motion engine, compiled when first asked for and kept. Any thread.
class MotionKernels {
 public:
  explicit MotionKernels(std::shared_ptr<vulkan::Context> context);

  const vulkan::Kernel& downsample();
  const vulkan::Kernel& moments();
  const vulkan::Kernel& gauss();
  const vulkan::Kernel& normalise();
  const vulkan::Kernel& pack(bool masked);
  const vulkan::Kernel& normal_equations(glm::ivec3 cell);
  const vulkan::Kernel& update();
  const vulkan::Kernel& update_two();
  const vulkan::Kernel& tv_primal(bool last);
  const vulkan::Kernel& tv_dual();
  const vulkan::Kernel& upsample();
  const vulkan::Kernel& measure();
  const vulkan::Kernel& folds();
  const vulkan::Kernel& blend();
  const vulkan::Kernel& confidence();
  const vulkan::Kernel& matching_cost();
  const vulkan::Kernel& smooth_cost();
  const vulkan::Kernel& coupled_choice();
  const vulkan::Kernel& classic_force();

  const vulkan::Sampler& nearest() const { return nearest_; }
  const vulkan::Sampler& linear() const { return linear_; }

 private:
  template <size_t N>
  const vulkan::Kernel& get(const uint32_t (&spirv)[N], const char* bindings, uint32_t push_bytes,
                            std::vector<uint32_t> specialisation = {});

  std::shared_ptr<vulkan::Context> context_;
  vulkan::Sampler nearest_;
  vulkan::Sampler linear_;
  std::mutex mutex_;
  std::map<std::pair<const uint32_t*, std::vector<uint32_t>>, vulkan::Kernel> kernels_;
};

}  // namespace palpate
