// A small Vulkan program with its own device, window and picture, into which palpate draws a
// volume. The program's cube moves around the beating heart; each hides the other, by depth.
//
//   host_vulkan [scene, sequence or "heart"] [--frames N] [--screenshot FILE.ppm]
//
// Code for palpate is marked by "palpate:". The rest is ordinary Vulkan.
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>
#include <palpate.h>

#define GLM_FORCE_DEPTH_ZERO_TO_ONE
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_vulkan_frag.h"
#include "host_vulkan_vert.h"

namespace {

constexpr uint32_t kWidth = 960, kHeight = 640;
constexpr VkFormat kColour = VK_FORMAT_R8G8B8A8_SRGB, kDepth = VK_FORMAT_D32_SFLOAT;
constexpr double kNear_m = 0.02, kFar_m = 5.0;

void check(VkResult result, const char* doing) {
  if (result != VK_SUCCESS)
    throw std::runtime_error(std::string(doing) + ": VkResult " + std::to_string(int(result)));
}

// palpate: throws with the library's error message if `result` is an error.
void check(PalResult result, const char* doing) {
  if (result < PAL_OK) throw std::runtime_error(std::string(doing) + ": " + pal_last_error());
}

struct Push {
  glm::mat4 clip_from_cube, world_from_cube;
};

/// The camera, in Vulkan's convention and in palpate's. World, m.
struct Camera {
  glm::dvec3 from{0.13, 0.09, 0.34}, to{0.0};
  double tan_up = 0.28, tan_right = tan_up * kWidth / kHeight;

  glm::dmat4 eye_from_world() const { return glm::lookAt(from, to, glm::dvec3(0.0, 1.0, 0.0)); }
  glm::dmat4 clip_from_eye() const {
    glm::dmat4 clip = glm::frustumRH_ZO(-tan_right * kNear_m, tan_right * kNear_m,
                                        -tan_up * kNear_m, tan_up * kNear_m, kNear_m, kFar_m);
    clip[1][1] = -clip[1][1];  // Vulkan's y points down
    return clip;
  }
  PalEye eye() const {
    const glm::dquat q = glm::quat_cast(glm::transpose(glm::dmat3(eye_from_world())));
    return {{from.x, from.y, from.z}, {q.x, q.y, q.z, q.w}, -tan_right, tan_right, -tan_up, tan_up};
  }
};

/// This program's device, window and pictures.
struct Host {
  GLFWwindow* window = nullptr;
  VkInstance instance = VK_NULL_HANDLE;
  VkSurfaceKHR surface = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  uint32_t family = 0;
  VkQueue queue = VK_NULL_HANDLE;
  std::mutex queue_mutex;  // palpate submits to the queue on threads of its own
  bool has_extended_formats = false;
  VkSwapchainKHR swapchain = VK_NULL_HANDLE;
  std::vector<VkImage> shown;
  VkExtent2D shown_size{};
  struct Image {
    VkImage image = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
  } colour, depth;
  VkBuffer copied = VK_NULL_HANDLE;
  VkDeviceMemory copied_memory = VK_NULL_HANDLE;
  VkRenderPass pass = VK_NULL_HANDLE;
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipeline pipeline = VK_NULL_HANDLE;
  VkCommandPool pool = VK_NULL_HANDLE;
  VkCommandBuffer drawing = VK_NULL_HANDLE, showing = VK_NULL_HANDLE;
  VkFence drawn = VK_NULL_HANDLE, presented = VK_NULL_HANDLE;

  Host();
  ~Host();
  void make_device();
  void make_swapchain();
  void make_pipeline();
  Image make_image(VkFormat format, VkImageUsageFlags usage, VkImageAspectFlags aspect);
  VkDeviceMemory memory_for(const VkMemoryRequirements& needed, VkMemoryPropertyFlags wanted);
  VkShaderModule shader(const uint32_t* words, size_t bytes);
  void submit(VkCommandBuffer commands, VkFence fence);
  void draw(const Push& push);
  void show();
  void write_picture(const std::string& file);
};

Host::Host() {
  if (!glfwInit()) throw std::runtime_error("there is no display");
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
  window =
      glfwCreateWindow(int(kWidth), int(kHeight), "palpate in a Vulkan program", nullptr, nullptr);
  if (!window) throw std::runtime_error("no window can be opened");
  make_device();
  make_swapchain();
  constexpr VkImageUsageFlags kCopied =
      VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  colour =
      make_image(kColour, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | kCopied, VK_IMAGE_ASPECT_COLOR_BIT);
  depth = make_image(kDepth, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | kCopied,
                     VK_IMAGE_ASPECT_DEPTH_BIT);
  make_pipeline();
  VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool_info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool_info.queueFamilyIndex = family;
  check(vkCreateCommandPool(device, &pool_info, nullptr, &pool), "a command pool");
  VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  allocate.commandPool = pool;
  allocate.commandBufferCount = 1;
  check(vkAllocateCommandBuffers(device, &allocate, &drawing), "commands");
  check(vkAllocateCommandBuffers(device, &allocate, &showing), "commands");
  const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  check(vkCreateFence(device, &fence, nullptr, &drawn), "a fence");
  check(vkCreateFence(device, &fence, nullptr, &presented), "a fence");
}

void Host::make_device() {
  uint32_t count = 0;
  const char** extensions = glfwGetRequiredInstanceExtensions(&count);
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.apiVersion = VK_API_VERSION_1_2;  // palpate: 1.2 or later
  VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  create.pApplicationInfo = &application;
  create.enabledExtensionCount = count;
  create.ppEnabledExtensionNames = extensions;
  check(vkCreateInstance(&create, nullptr, &instance), "a Vulkan instance");
  check(glfwCreateWindowSurface(instance, window, nullptr, &surface), "a surface");
  vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(instance, &count, devices.data());
  for (VkPhysicalDevice candidate : devices) {
    vkGetPhysicalDeviceQueueFamilyProperties(candidate, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(candidate, &count, families.data());
    for (uint32_t f = 0; f < count && !physical; ++f) {
      constexpr VkQueueFlags kBoth = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
      VkBool32 presents = VK_FALSE;
      vkGetPhysicalDeviceSurfaceSupportKHR(candidate, f, surface, &presents);
      if ((families[f].queueFlags & kBoth) != kBoth || !presents) continue;
      physical = candidate;
      family = f;
    }
  }
  if (!physical) throw std::runtime_error("no Vulkan device can draw, compute and show");
  VkPhysicalDeviceFeatures offered, wanted{};
  vkGetPhysicalDeviceFeatures(physical, &offered);
  // palpate: the first feature is required; the second is used if the device has it.
  wanted.shaderStorageImageWriteWithoutFormat = VK_TRUE;
  wanted.shaderStorageImageExtendedFormats = offered.shaderStorageImageExtendedFormats;
  has_extended_formats = offered.shaderStorageImageExtendedFormats;
  const float priority = 1.0F;
  VkDeviceQueueCreateInfo queues{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queues.queueFamilyIndex = family;
  queues.queueCount = 1;
  queues.pQueuePriorities = &priority;
  const char* swap = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
  VkDeviceCreateInfo of_device{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
  of_device.pEnabledFeatures = &wanted;
  of_device.queueCreateInfoCount = 1;
  of_device.pQueueCreateInfos = &queues;
  of_device.enabledExtensionCount = 1;
  of_device.ppEnabledExtensionNames = &swap;
  check(vkCreateDevice(physical, &of_device, nullptr, &device), "a Vulkan device");
  vkGetDeviceQueue(device, family, 0, &queue);
}

void Host::make_swapchain() {
  VkSurfaceCapabilitiesKHR can;
  vkGetPhysicalDeviceSurfaceCapabilitiesKHR(physical, surface, &can);
  uint32_t count = 0;
  vkGetPhysicalDeviceSurfaceFormatsKHR(physical, surface, &count, nullptr);
  std::vector<VkSurfaceFormatKHR> formats(count);
  vkGetPhysicalDeviceSurfaceFormatsKHR(physical, surface, &count, formats.data());
  VkSurfaceFormatKHR chosen = formats.front();
  for (const VkSurfaceFormatKHR& format : formats)
    if (format.format == VK_FORMAT_B8G8R8A8_SRGB || format.format == VK_FORMAT_R8G8B8A8_SRGB)
      chosen = format;
  shown_size =
      can.currentExtent.width == UINT32_MAX ? VkExtent2D{kWidth, kHeight} : can.currentExtent;
  VkSwapchainCreateInfoKHR create{VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR};
  create.surface = surface;
  create.minImageCount = std::max(can.minImageCount, 2U);
  create.imageFormat = chosen.format;
  create.imageColorSpace = chosen.colorSpace;
  create.imageExtent = shown_size;
  create.imageArrayLayers = 1;
  create.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  create.preTransform = can.currentTransform;
  create.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  create.presentMode = VK_PRESENT_MODE_FIFO_KHR;
  create.clipped = VK_TRUE;
  check(vkCreateSwapchainKHR(device, &create, nullptr, &swapchain), "a swapchain");
  vkGetSwapchainImagesKHR(device, swapchain, &count, nullptr);
  shown.resize(count);
  vkGetSwapchainImagesKHR(device, swapchain, &count, shown.data());
}

VkDeviceMemory Host::memory_for(const VkMemoryRequirements& needed, VkMemoryPropertyFlags wanted) {
  VkPhysicalDeviceMemoryProperties types;
  vkGetPhysicalDeviceMemoryProperties(physical, &types);
  for (uint32_t type = 0; type < types.memoryTypeCount; ++type) {
    if (!(needed.memoryTypeBits >> type & 1U) ||
        (types.memoryTypes[type].propertyFlags & wanted) != wanted)
      continue;
    VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocate.allocationSize = needed.size;
    allocate.memoryTypeIndex = type;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    check(vkAllocateMemory(device, &allocate, nullptr, &memory), "memory");
    return memory;
  }
  throw std::runtime_error("no fitting memory");
}

Host::Image Host::make_image(VkFormat format, VkImageUsageFlags usage, VkImageAspectFlags aspect) {
  Image made;
  VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
  create.imageType = VK_IMAGE_TYPE_2D;
  create.format = format;
  create.extent = {kWidth, kHeight, 1};
  create.mipLevels = create.arrayLayers = 1;
  create.samples = VK_SAMPLE_COUNT_1_BIT;
  create.usage = usage;
  check(vkCreateImage(device, &create, nullptr, &made.image), "an image");
  VkMemoryRequirements needed;
  vkGetImageMemoryRequirements(device, made.image, &needed);
  made.memory = memory_for(needed, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  check(vkBindImageMemory(device, made.image, made.memory, 0), "an image's memory");
  VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
  view.image = made.image;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {aspect, 0, 1, 0, 1};
  check(vkCreateImageView(device, &view, nullptr, &made.view), "an image view");
  return made;
}

VkShaderModule Host::shader(const uint32_t* words, size_t bytes) {
  VkShaderModuleCreateInfo create{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  create.codeSize = bytes;
  create.pCode = words;
  VkShaderModule module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device, &create, nullptr, &module), "a shader");
  return module;
}

void Host::make_pipeline() {
  const auto attachment = [](VkFormat format, VkImageLayout last) {
    VkAttachmentDescription of{};
    of.format = format;
    of.samples = VK_SAMPLE_COUNT_1_BIT;
    of.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    of.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    of.finalLayout = last;
    return of;
  };
  const VkAttachmentDescription attachments[] = {
      attachment(kColour, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL),
      attachment(kDepth, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL)};
  const VkAttachmentReference to_colour{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  const VkAttachmentReference to_depth{1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &to_colour;
  subpass.pDepthStencilAttachment = &to_depth;
  VkSubpassDependency before{};
  before.srcSubpass = VK_SUBPASS_EXTERNAL;
  before.srcStageMask = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
  before.dstStageMask = VK_PIPELINE_STAGE_ALL_GRAPHICS_BIT;
  before.srcAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  before.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  VkRenderPassCreateInfo of_pass{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
  of_pass.attachmentCount = 2;
  of_pass.pAttachments = attachments;
  of_pass.subpassCount = 1;
  of_pass.pSubpasses = &subpass;
  of_pass.dependencyCount = 1;
  of_pass.pDependencies = &before;
  check(vkCreateRenderPass(device, &of_pass, nullptr, &pass), "a render pass");
  const VkImageView views[] = {colour.view, depth.view};
  VkFramebufferCreateInfo frame{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
  frame.renderPass = pass;
  frame.attachmentCount = 2;
  frame.pAttachments = views;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.layers = 1;
  check(vkCreateFramebuffer(device, &frame, nullptr, &framebuffer), "a framebuffer");

  const VkPushConstantRange pushed{VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof(Push)};
  VkPipelineLayoutCreateInfo of_layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  of_layout.pushConstantRangeCount = 1;
  of_layout.pPushConstantRanges = &pushed;
  check(vkCreatePipelineLayout(device, &of_layout, nullptr, &layout), "a pipeline layout");
  VkPipelineShaderStageCreateInfo stages[2]{};
  for (VkPipelineShaderStageCreateInfo& stage : stages) {
    stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stage.pName = "main";
  }
  stages[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
  stages[0].module = shader(k_host_vulkan_vert, sizeof k_host_vulkan_vert);
  stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
  stages[1].module = shader(k_host_vulkan_frag, sizeof k_host_vulkan_frag);
  const VkPipelineVertexInputStateCreateInfo no_buffers{
      VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
  VkPipelineInputAssemblyStateCreateInfo triangles{
      VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
  triangles.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  const VkViewport viewport{0.0F, 0.0F, float(kWidth), float(kHeight), 0.0F, 1.0F};
  const VkRect2D scissor{{0, 0}, {kWidth, kHeight}};
  VkPipelineViewportStateCreateInfo viewports{
      VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
  viewports.viewportCount = viewports.scissorCount = 1;
  viewports.pViewports = &viewport;
  viewports.pScissors = &scissor;
  VkPipelineRasterizationStateCreateInfo raster{
      VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
  raster.lineWidth = 1.0F;
  VkPipelineMultisampleStateCreateInfo samples{
      VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  VkPipelineDepthStencilStateCreateInfo nearest{
      VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
  nearest.depthTestEnable = nearest.depthWriteEnable = VK_TRUE;
  nearest.depthCompareOp = VK_COMPARE_OP_LESS;
  VkPipelineColorBlendAttachmentState opaque{};
  opaque.colorWriteMask = 0xf;
  VkPipelineColorBlendStateCreateInfo blend{
      VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
  blend.attachmentCount = 1;
  blend.pAttachments = &opaque;
  VkGraphicsPipelineCreateInfo create{VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
  create.stageCount = 2;
  create.pStages = stages;
  create.pVertexInputState = &no_buffers;
  create.pInputAssemblyState = &triangles;
  create.pViewportState = &viewports;
  create.pRasterizationState = &raster;
  create.pMultisampleState = &samples;
  create.pDepthStencilState = &nearest;
  create.pColorBlendState = &blend;
  create.layout = layout;
  create.renderPass = pass;
  check(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &create, nullptr, &pipeline),
        "a pipeline");
  for (const VkPipelineShaderStageCreateInfo& stage : stages)
    vkDestroyShaderModule(device, stage.module, nullptr);
}

void Host::submit(VkCommandBuffer commands, VkFence fence) {
  VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  const std::lock_guard lock(queue_mutex);
  check(vkQueueSubmit(queue, 1, &submit, fence), "submitting");
}

void Host::draw(const Push& push) {
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  check(vkBeginCommandBuffer(drawing, &begin), "drawing");
  VkClearValue clear[2]{};
  clear[0].color = {{0.012F, 0.016F, 0.025F, 1.0F}};
  clear[1].depthStencil = {1.0F, 0};
  VkRenderPassBeginInfo into{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
  into.renderPass = pass;
  into.framebuffer = framebuffer;
  into.renderArea = {{0, 0}, {kWidth, kHeight}};
  into.clearValueCount = 2;
  into.pClearValues = clear;
  vkCmdBeginRenderPass(drawing, &into, VK_SUBPASS_CONTENTS_INLINE);
  vkCmdBindPipeline(drawing, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
  vkCmdPushConstants(drawing, layout, VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof push, &push);
  vkCmdDraw(drawing, 36, 1, 0, 0);
  vkCmdEndRenderPass(drawing);
  check(vkEndCommandBuffer(drawing), "drawing");
  submit(drawing, drawn);
}

void change(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to) {
  VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
  barrier.srcAccessMask = barrier.dstAccessMask =
      VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.oldLayout = from;
  barrier.newLayout = to;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                       VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

/// Copies the picture into the window, and waits until it is done: simple, but slow.
void Host::show() {
  uint32_t at = 0;
  check(vkResetFences(device, 1, &presented), "a fence");
  const VkResult acquired =
      vkAcquireNextImageKHR(device, swapchain, UINT64_MAX, VK_NULL_HANDLE, presented, &at);
  if (acquired == VK_ERROR_OUT_OF_DATE_KHR) return;
  check(vkWaitForFences(device, 1, &presented, VK_TRUE, UINT64_MAX), "the window");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  check(vkBeginCommandBuffer(showing, &begin), "showing");
  change(showing, colour.image, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
         VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  change(showing, shown[at], VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  VkImageBlit region{};
  region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.srcOffsets[1] = {int(kWidth), int(kHeight), 1};
  region.dstOffsets[1] = {int(shown_size.width), int(shown_size.height), 1};
  vkCmdBlitImage(showing, colour.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, shown[at],
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_LINEAR);
  change(showing, shown[at], VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
  check(vkEndCommandBuffer(showing), "showing");
  check(vkResetFences(device, 1, &presented), "a fence");
  submit(showing, presented);
  check(vkWaitForFences(device, 1, &presented, VK_TRUE, UINT64_MAX), "showing");
  VkPresentInfoKHR present{VK_STRUCTURE_TYPE_PRESENT_INFO_KHR};
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain;
  present.pImageIndices = &at;
  const std::lock_guard lock(queue_mutex);
  vkQueuePresentKHR(queue, &present);
}

/// Writes the colour image to a file (PPM). After show().
void Host::write_picture(const std::string& file) {
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = 4 * kWidth * kHeight;
  create.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  check(vkCreateBuffer(device, &create, nullptr, &copied), "a buffer");
  VkMemoryRequirements needed;
  vkGetBufferMemoryRequirements(device, copied, &needed);
  copied_memory = memory_for(
      needed, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  check(vkBindBufferMemory(device, copied, copied_memory, 0), "a buffer's memory");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  check(vkBeginCommandBuffer(showing, &begin), "copying");
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {kWidth, kHeight, 1};
  vkCmdCopyImageToBuffer(showing, colour.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, copied, 1,
                         &region);
  check(vkEndCommandBuffer(showing), "copying");
  check(vkResetFences(device, 1, &presented), "a fence");
  submit(showing, presented);
  check(vkWaitForFences(device, 1, &presented, VK_TRUE, UINT64_MAX), "copying");
  void* mapped = nullptr;
  check(vkMapMemory(device, copied_memory, 0, VK_WHOLE_SIZE, 0, &mapped), "reading");
  const auto* const rgba = static_cast<const unsigned char*>(mapped);
  std::ofstream out(file, std::ios::binary);
  out << "P6\n" << kWidth << " " << kHeight << "\n255\n";
  for (size_t p = 0; p < size_t(kWidth) * kHeight; ++p)
    out.write(reinterpret_cast<const char*>(rgba + 4 * p), 3);
  if (!out.flush()) throw std::runtime_error("can not write " + file);
}

Host::~Host() {
  if (device) {
    vkDeviceWaitIdle(device);
    vkDestroyBuffer(device, copied, nullptr);
    vkFreeMemory(device, copied_memory, nullptr);
    vkDestroyFence(device, drawn, nullptr);
    vkDestroyFence(device, presented, nullptr);
    vkDestroyCommandPool(device, pool, nullptr);
    vkDestroyPipeline(device, pipeline, nullptr);
    vkDestroyPipelineLayout(device, layout, nullptr);
    vkDestroyFramebuffer(device, framebuffer, nullptr);
    vkDestroyRenderPass(device, pass, nullptr);
    for (const Image& image : {colour, depth}) {
      vkDestroyImageView(device, image.view, nullptr);
      vkDestroyImage(device, image.image, nullptr);
      vkFreeMemory(device, image.memory, nullptr);
    }
    vkDestroySwapchainKHR(device, swapchain, nullptr);
    vkDestroyDevice(device, nullptr);
  }
  if (surface) vkDestroySurfaceKHR(instance, surface, nullptr);
  if (instance) vkDestroyInstance(instance, nullptr);
  if (window) glfwDestroyWindow(window);
  glfwTerminate();
}

/// palpate: its objects, in the order in which they are opened.
struct Palpate {
  PalContext* context = nullptr;
  PalScene* scene = nullptr;
  PalSession* session = nullptr;
  PalView* view = nullptr;

  Palpate(Host& host, const std::string& what) {
    PalVulkan vulkan{};
    vulkan.size = sizeof vulkan;
    vulkan.instance = host.instance;
    vulkan.physical_device = host.physical;
    vulkan.device = host.device;
    vulkan.queue = host.queue;
    vulkan.queue_family = host.family;
    vulkan.has_extended_formats = host.has_extended_formats;
    vulkan.user = &host;
    vulkan.lock_queue = [](void* user) { static_cast<Host*>(user)->queue_mutex.lock(); };
    vulkan.unlock_queue = [](void* user) { static_cast<Host*>(user)->queue_mutex.unlock(); };
    PalContextInfo of_context{};
    of_context.size = sizeof of_context;
    of_context.version = PAL_VERSION;
    of_context.vulkan = &vulkan;
    check(pal_context_open(&of_context, &context), "opening palpate");

    const char* path = what.c_str();
    PalSceneInfo of_scene{};
    of_scene.size = sizeof of_scene;
    of_scene.paths = &path;
    of_scene.path_count = 1;
    check(pal_scene_open(context, &of_scene, &scene), "reading the scene");

    // A simulated hand that moves in front of the volume. A real device is read and written here.
    PalDeviceInfo about{};
    about.size = sizeof about;
    about.max_force_n = 8.0;
    about.workspace_radius_m = 0.1;
    PalDevice device{};
    device.size = sizeof device;
    device.info = &about;
    device.exchange = [](void*, const double*, PalReading* reading) {
      using Clock = std::chrono::steady_clock;
      const double t_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
      reading->position_m[0] = 0.01 * std::sin(0.7 * t_s);
      reading->position_m[1] = 0.01 * std::cos(0.9 * t_s);
      reading->position_m[2] = 0.05 + 0.03 * std::sin(t_s);
      reading->is_fresh = 1;
    };
    PalSessionInfo of_session{};
    of_session.size = sizeof of_session;
    of_session.flags = PAL_SESSION_NO_REAL_TIME;
    of_session.device = &device;
    of_session.watchdog_s = 0.05;
    check(pal_session_open(scene, &of_session, &session), "starting the session");

    PalViewInfo of_view{};
    of_view.size = sizeof of_view;
    of_view.width = kWidth;
    of_view.height = kHeight;
    of_view.eye_count = 1;
    check(pal_view_open(session, &of_view, &view), "opening the view");
  }
  ~Palpate() {
    pal_view_close(&view);
    pal_session_close(&session);
    pal_scene_close(&scene);
    pal_context_close(&context);
  }

  /// Draws the volume into the images that the host has drawn.
  void draw(const Host& host, const PalEye& eye) {
    PalImages images{};
    images.size = sizeof images;
    images.colour[0] = uint64_t(host.colour.image);
    images.depth[0] = uint64_t(host.depth.image);
    images.colour_format = kColour;
    images.depth_format = kDepth;
    images.colour_layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    images.depth_layout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    images.inverse_depth_0 = 1.0 / kNear_m;
    images.inverse_depth_1 = 1.0 / kFar_m;
    check(pal_view_render(view, &eye, 1, kWidth, kHeight, 0.0, &images), "drawing the volume");
  }
};

int run(int argc, char** argv) {
  std::string what = "heart", screenshot;
  int frames = 0;
  for (int a = 1; a < argc; ++a) {
    const std::string word = argv[a];
    if (word == "--frames" && a + 1 < argc)
      frames = std::atoi(argv[++a]);
    else if (word == "--screenshot" && a + 1 < argc)
      screenshot = argv[++a];
    else
      what = word;
  }
  Host host;
  Palpate palpate(host, what);
  const Camera camera;
  const auto begin = std::chrono::steady_clock::now();
  int drawn = 0;
  for (; !glfwWindowShouldClose(host.window) && (frames == 0 || drawn < frames); ++drawn) {
    glfwPollEvents();
    // The cube moves around the volume; with --frames it ends half inside the volume.
    const double turn = frames > 0 ? 0.6 * (drawn + 1) / frames : 0.4 * drawn / 60.0 * 6.28;
    const glm::dvec3 place(0.05 * std::cos(turn), -0.01, 0.05 * std::sin(turn));
    glm::dmat4 world_from_cube = glm::translate(glm::dmat4(1.0), place);
    world_from_cube =
        glm::rotate(world_from_cube, 2.0 * turn, glm::normalize(glm::dvec3(1.0, 2.0, 0.5)));
    world_from_cube = glm::scale(world_from_cube, glm::dvec3(0.022));
    host.draw({glm::mat4(camera.clip_from_eye() * camera.eye_from_world() * world_from_cube),
               glm::mat4(world_from_cube)});
    palpate.draw(host, camera.eye());
    host.show();
    check(vkWaitForFences(host.device, 1, &host.drawn, VK_TRUE, UINT64_MAX), "drawing");
    check(vkResetFences(host.device, 1, &host.drawn), "a fence");
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("%d pictures of %u x %u on %s, %.1f ms each\n", drawn, kWidth, kHeight,
              pal_context_device(palpate.context), 1e3 * seconds / std::max(drawn, 1));
  if (!screenshot.empty()) host.write_picture(screenshot);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "host_vulkan: %s\n", error.what());
    return 1;
  }
}
