#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/context.h"

namespace palpate::vulkan {

/// Kind of a kernel's binding; binding i of set 0 is kinds[i]. kUniform is faster for a small block
/// that all invocations read at the same place, kTexels for a table that each invocation reads at
/// its own place: a CPU driver reads storage buffers one value and one lane at a time.
enum class BindingKind { kBuffer, kUniform, kTexels, kStorageImage, kSampledImage };

/// The bindings of set 0 as the shader declares them in its `layout(set = 0, binding = ...)` lines,
/// so that they are written in one place only. Throws Failure unless they are numbered 0, 1, 2, ...
/// without a gap and each is of a kind above.
std::vector<BindingKind> bindings_of(std::span<const uint32_t> spirv);

struct KernelOptions {
  std::span<const uint32_t> spirv;
  uint32_t push_bytes = 0;               ///< at most 128, which every device allows
  std::vector<uint32_t> specialisation;  ///< value of specialisation constant 0, 1, 2, ...
};

/// A compute pipeline with its layouts. Move-only. Creation compiles and throws Failure.
class Kernel {
 public:
  Kernel() = default;
  Kernel(std::shared_ptr<Context> context, const KernelOptions& options);
  Kernel(Kernel&& other) noexcept { swap(other); }
  Kernel& operator=(Kernel&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Kernel();

  /// Kernels compiled by the calling thread so far; a frame loop must compile none.
  static uint64_t compiled_on_this_thread();

  VkPipeline pipeline() const { return pipeline_; }
  VkPipelineLayout layout() const { return layout_; }
  VkDescriptorSetLayout set_layout() const { return set_layout_; }
  const std::vector<BindingKind>& bindings() const { return bindings_; }
  uint32_t push_bytes() const { return push_bytes_; }

 private:
  void swap(Kernel& other) noexcept;

  std::shared_ptr<Context> context_;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  std::vector<BindingKind> bindings_;
  uint32_t push_bytes_ = 0;
};

}  // namespace palpate::vulkan
