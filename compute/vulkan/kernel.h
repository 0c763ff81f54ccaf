#pragma once

#include <memory>
#include <span>
#include <vector>

#include "compute/vulkan/context.h"

namespace palpate::vulkan {

/// What a kernel's binding takes; binding i of set 0 is kinds[i]. A small block that all
/// invocations read at the same place goes faster through kUniform, and a table that each reads at
/// a place of its own through kTexels: a CPU driver reads storage buffers value by value, lane by
/// lane.
enum class BindingKind { kBuffer, kUniform, kTexels, kStorageImage, kSampledImage };

/// The bindings of set 0 as the shader itself declares them, so that they stand in one place: its
/// `layout(set = 0, binding = ...)` lines. Throws Failure unless they are numbered 0, 1, 2, ...
/// without a gap and each is of a kind above.
std::vector<BindingKind> bindings_of(std::span<const uint32_t> spirv);

struct KernelOptions {
  std::span<const uint32_t> spirv;
  std::vector<BindingKind> bindings;     ///< empty: bindings_of(spirv); else they must be the same
  uint32_t push_bytes = 0;               ///< at most 128, the limit that every device has
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

  /// Kernels that the calling thread has compiled so far: a frame loop compiles none.
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
