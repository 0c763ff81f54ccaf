#include "compute/vulkan/kernel.h"

#include <utility>

namespace palpate::vulkan {
namespace {

thread_local uint64_t compiled_here = 0;

VkDescriptorType type_of(BindingKind kind) {
  switch (kind) {
    case BindingKind::kBuffer:
      return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    case BindingKind::kUniform:
      return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    case BindingKind::kTexels:
      return VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    case BindingKind::kStorageImage:
      return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    case BindingKind::kSampledImage:
      break;
  }
  return VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
}

}  // namespace

Kernel::Kernel(std::shared_ptr<Context> context, const KernelOptions& options)
    : context_(std::move(context)), bindings_(options.bindings), push_bytes_(options.push_bytes) {
  const VkDevice device = context_->device();
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const BindingKind kind : bindings_) {
    bindings.push_back(
        {uint32_t(bindings.size()), type_of(kind), 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  }
  VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
  set.bindingCount = uint32_t(bindings.size());
  set.pBindings = bindings.data();
  check(vkCreateDescriptorSetLayout(device, &set, nullptr, &set_layout_),
        "creating a kernel's bindings");

  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes_};
  VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = push_bytes_ ? 1 : 0;
  layout.pPushConstantRanges = &push;
  check(vkCreatePipelineLayout(device, &layout, nullptr, &layout_), "creating a kernel's layout");

  VkShaderModuleCreateInfo code{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  code.codeSize = options.spirv.size_bytes();
  code.pCode = options.spirv.data();
  VkShaderModule shader_module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device, &code, nullptr, &shader_module), "loading a kernel");

  std::vector<VkSpecializationMapEntry> entries;
  for (uint32_t i = 0; i < options.specialisation.size(); ++i) entries.push_back({i, i * 4, 4});
  const VkSpecializationInfo specialisation{uint32_t(entries.size()), entries.data(),
                                            options.specialisation.size() * 4,
                                            options.specialisation.data()};
  VkComputePipelineCreateInfo create{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
  create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  create.stage.module = shader_module;
  create.stage.pName = "main";
  create.stage.pSpecializationInfo = &specialisation;
  create.layout = layout_;
  const VkResult result =
      vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &create, nullptr, &pipeline_);
  vkDestroyShaderModule(device, shader_module, nullptr);
  check(result, "compiling a kernel");
  ++compiled_here;
}

uint64_t Kernel::compiled_on_this_thread() {
  return compiled_here;
}

Kernel::~Kernel() {
  if (!context_) return;
  vkDestroyPipeline(context_->device(), pipeline_, nullptr);
  vkDestroyPipelineLayout(context_->device(), layout_, nullptr);
  vkDestroyDescriptorSetLayout(context_->device(), set_layout_, nullptr);
}

void Kernel::swap(Kernel& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(pipeline_, other.pipeline_);
  std::swap(layout_, other.layout_);
  std::swap(set_layout_, other.set_layout_);
  std::swap(bindings_, other.bindings_);
  std::swap(push_bytes_, other.push_bytes_);
}

}  // namespace palpate::vulkan
