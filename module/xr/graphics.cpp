#include "module/xr/graphics.h"

#include <optional>

namespace palpate::xr {
namespace {

constexpr XrVersion kVulkan = XR_MAKE_VERSION(1, 2, 0);

/// Every session must be preceded by this question. kUnsupported if the runtime wants a Vulkan that
/// palpate does not speak.
Done check_requirements(const Instance& instance, const System& system) {
  XrGraphicsRequirementsVulkan2KHR needs{XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR};
  const XrResult asked = instance.get_vulkan_requirements(instance.handle(), system.id, &needs);
  if (XR_FAILED(asked)) return problem_of("xrGetVulkanGraphicsRequirements2KHR", asked);
  // maxApiVersionSupported is only what the runtime was tested with: not a reason to give up.
  if (needs.minApiVersionSupported <= kVulkan) return Nothing{};
  return Problem{Trouble::kUnsupported,
                 "The OpenXR runtime wants Vulkan " +
                     std::to_string(XR_VERSION_MAJOR(needs.minApiVersionSupported)) + "." +
                     std::to_string(XR_VERSION_MINOR(needs.minApiVersionSupported)) +
                     ", palpate uses 1.2: choose another runtime with XR_RUNTIME_JSON.",
                 "xrGetVulkanGraphicsRequirements2KHR", XR_SUCCESS};
}

XrResult device_of(const Instance& instance, const System& system, VkInstance vulkan,
                   VkPhysicalDevice* device) {
  XrVulkanGraphicsDeviceGetInfoKHR get{XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR};
  get.systemId = system.id;
  get.vulkanInstance = vulkan;
  return instance.get_vulkan_device(instance.handle(), &get, device);
}

/// Makes through the runtime. What the runtime itself refuses has no VkResult: it is kept.
class ThroughRuntime : public vulkan::DeviceMaker {
 public:
  ThroughRuntime(const Instance& instance, const System& system)
      : instance_(instance), system_(system) {}

  VkResult create_instance(const VkInstanceCreateInfo& create, VkInstance* made) override {
    XrVulkanInstanceCreateInfoKHR through{XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR};
    through.systemId = system_.id;
    through.pfnGetInstanceProcAddr = &vkGetInstanceProcAddr;
    through.vulkanCreateInfo = &create;
    VkResult result = VK_SUCCESS;
    return kept("xrCreateVulkanInstanceKHR",
                instance_.create_vulkan_instance(instance_.handle(), &through, made, &result),
                result);
  }

  VkResult choose_device(VkInstance vulkan, VkPhysicalDevice* device) override {
    return kept("xrGetVulkanGraphicsDevice2KHR", device_of(instance_, system_, vulkan, device),
                VK_SUCCESS);
  }

  VkResult create_device(VkPhysicalDevice device, const VkDeviceCreateInfo& create,
                         VkDevice* made) override {
    XrVulkanDeviceCreateInfoKHR through{XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR};
    through.systemId = system_.id;
    through.pfnGetInstanceProcAddr = &vkGetInstanceProcAddr;
    through.vulkanPhysicalDevice = device;
    through.vulkanCreateInfo = &create;
    VkResult result = VK_SUCCESS;
    return kept("xrCreateVulkanDeviceKHR",
                instance_.create_vulkan_device(instance_.handle(), &through, made, &result),
                result);
  }

  const std::optional<Problem>& problem() const { return problem_; }

 private:
  VkResult kept(const char* call, XrResult result, VkResult vulkan) {
    if (!XR_FAILED(result)) return vulkan;
    problem_ = problem_of(call, result);
    return VK_ERROR_INITIALIZATION_FAILED;
  }

  const Instance& instance_;
  const System& system_;
  std::optional<Problem> problem_;
};

}  // namespace

Outcome<std::shared_ptr<vulkan::Context>> make_context(const Instance& instance,
                                                       const System& system,
                                                       const GraphicsOptions& options) {
  const Done fits = check_requirements(instance, system);
  if (!fits) return fits.error();
  ThroughRuntime maker(instance, system);
  vulkan::ContextOptions context;
  context.validation = options.validation;
  context.memory_cap_bytes = options.memory_cap_bytes;
  context.maker = &maker;
  Result<std::shared_ptr<vulkan::Context>> opened = vulkan::Context::open(context);
  if (opened) return *opened;
  if (maker.problem()) return *maker.problem();
  return Problem{Trouble::kNoGraphics, opened.error().message, "vkCreateDevice", XR_SUCCESS};
}

Outcome<bool> still_drives(const Instance& instance, const System& system,
                           const vulkan::Context& context) {
  const Done fits = check_requirements(instance, system);
  if (!fits) return fits.error();
  VkPhysicalDevice device = VK_NULL_HANDLE;
  const XrResult asked = device_of(instance, system, context.instance(), &device);
  // Monado 25.0.1 answers only where Vulkan was started through this connection.
  if (asked == XR_ERROR_VALIDATION_FAILURE) return false;
  if (XR_FAILED(asked)) return problem_of("xrGetVulkanGraphicsDevice2KHR", asked);
  return device == context.physical_device();
}

}  // namespace palpate::xr
