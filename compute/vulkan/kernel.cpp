#include "compute/vulkan/kernel.h"

#include <cassert>
#include <map>
#include <optional>
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

/// The declarations of a SPIR-V module (SPIR-V specification, sections 2.3 and 3.32: a header of
/// five words, then instructions; the first word of each holds its length and opcode).
struct Declarations {
  explicit Declarations(std::span<const uint32_t> spirv) {
    constexpr size_t kHeaderWords = 5;
    for (size_t at = kHeaderWords; at < spirv.size();) {
      const size_t length = spirv[at] >> 16;
      if (length == 0 || length > spirv.size() - at)
        throw Failure(VK_ERROR_INVALID_SHADER_NV, "reading the bindings of a kernel");
      read(spirv[at] & 0xffffU, spirv.subspan(at + 1, length - 1));
      at += length;
    }
  }

  struct ImageType {
    bool is_buffer = false, is_stored = false;
  };
  struct PointerType {
    uint32_t storage_class = 0, type = 0;
  };
  std::map<uint32_t, ImageType> images;         ///< by type
  std::map<uint32_t, uint32_t> sampled_images;  ///< the image type, by type
  std::map<uint32_t, PointerType> pointers;     ///< by type
  std::map<uint32_t, uint32_t> pointer_types;   ///< by variable
  std::map<uint32_t, uint32_t> variables;       ///< by binding

 private:
  void read(uint32_t opcode, std::span<const uint32_t> words) {
    constexpr uint32_t kTypeImage = 25, kTypeSampledImage = 27, kTypePointer = 32, kVariable = 59,
                       kDecorate = 71;
    constexpr uint32_t kBinding = 33, kDimBuffer = 5, kStored = 2;
    if (opcode == kTypeImage && words.size() > 6) {
      images[words[0]] = {words[2] == kDimBuffer, words[6] == kStored};
    } else if (opcode == kTypeSampledImage && words.size() > 1) {
      sampled_images[words[0]] = words[1];
    } else if (opcode == kTypePointer && words.size() > 2) {
      pointers[words[0]] = {words[1], words[2]};
    } else if (opcode == kVariable && words.size() > 2) {
      pointer_types[words[1]] = words[0];
    } else if (opcode == kDecorate && words.size() > 2 && words[1] == kBinding) {
      variables[words[2]] = words[0];
    }
  }
};

std::optional<BindingKind> kind_of(const Declarations& declared, uint32_t variable) {
  constexpr uint32_t kUniformConstant = 0, kUniform = 2, kStorageBuffer = 12;
  const auto type = declared.pointer_types.find(variable);
  if (type == declared.pointer_types.end()) return std::nullopt;
  const auto pointer = declared.pointers.find(type->second);
  if (pointer == declared.pointers.end()) return std::nullopt;
  const auto [storage_class, target] = pointer->second;
  if (storage_class == kStorageBuffer) return BindingKind::kBuffer;
  if (storage_class == kUniform) return BindingKind::kUniform;
  if (storage_class != kUniformConstant) return std::nullopt;
  const auto sampled = declared.sampled_images.find(target);
  const auto image =
      declared.images.find(sampled == declared.sampled_images.end() ? target : sampled->second);
  if (image == declared.images.end()) return std::nullopt;
  if (sampled == declared.sampled_images.end())
    return image->second.is_stored ? std::optional(BindingKind::kStorageImage) : std::nullopt;
  return image->second.is_buffer ? BindingKind::kTexels : BindingKind::kSampledImage;
}

}  // namespace

std::vector<BindingKind> bindings_of(std::span<const uint32_t> spirv) {
  const Declarations declared(spirv);
  std::vector<BindingKind> bindings;
  for (const auto& [binding, variable] : declared.variables) {
    const auto kind = kind_of(declared, variable);
    if (binding != bindings.size() || !kind)
      throw Failure(VK_ERROR_INVALID_SHADER_NV, "reading the bindings of a kernel");
    bindings.push_back(*kind);
  }
  return bindings;
}

Kernel::Kernel(std::shared_ptr<Context> context, const KernelOptions& options)
    : context_(std::move(context)),
      bindings_(bindings_of(options.spirv)),
      push_bytes_(options.push_bytes) {
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
