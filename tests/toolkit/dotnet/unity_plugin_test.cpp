// The plugin for Unity, in a host with the same tables of functions. It is preloaded; the host has
// a device of its own, images, and a command buffer that is submitted when the queue is asked for.
// A thread submits all the time. Unity itself is not here.
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <deque>
#include <optional>
#include <thread>

#include "integration/files/shared_library.h"
#include "integration/toolkit/dotnet/unity/palpate_unity.h"
#include "integration/toolkit/dotnet/unity/unity_tables.h"
#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;
using namespace palpate::unity;

constexpr uint32_t kWidth = 96, kHeight = 64;
constexpr double kNear_m = 0.02, kFar_m = 5.0;
constexpr VkClearColorValue kBlack{{0.0F, 0.0F, 0.0F, 1.0F}};

/// What a native pointer of a render buffer points to.
struct Surface {
  VkImage image = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  VkFormat format{};
  VkImageAspectFlags aspect{};
  VkImageUsageFlags usage{};
  VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
};

class FakeUnity {
 public:
  FakeUnity() { self = this; }
  ~FakeUnity() {
    if (device) wait_device_(device);
    if (plugin_) {
      function<void()>("UnityPluginUnload")();
      plugin_->close();
    }
    if (device) {
      for (Surface& surface : surfaces_) {
        vkDestroyImage(device, surface.image, nullptr);
        vkFreeMemory(device, surface.memory, nullptr);
      }
      vkDestroyCommandPool(device, pool_, nullptr);
      vkDestroyDevice(device, nullptr);
    }
    if (instance) vkDestroyInstance(instance, nullptr);
    self = nullptr;
  }

  template <class Function>
  Function* function(const char* name) {
    return plugin_->find<Function>(name);
  }

  void load_plugin() {
    plugin_.emplace(PALPATE_UNITY_PLUGIN);
    ASSERT_TRUE(plugin_->is_open()) << plugin_->problem();
    function<void(Tables*)>("UnityPluginLoad")(&tables_);
  }

  /// As a program that knows nothing of palpate: Vulkan 1.0, no features. False: there is no
  /// driver.
  bool start_graphics() {
    PFN_vkGetInstanceProcAddr get = &get_instance_function;
    if (hook_) get = hook_(get, hook_user_);
    const auto create = reinterpret_cast<PFN_vkCreateInstance>(get(nullptr, "vkCreateInstance"));
    VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.apiVersion = VK_API_VERSION_1_0;
    VkInstanceCreateInfo of_instance{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    of_instance.pApplicationInfo = &application;
    if (create(&of_instance, nullptr, &instance) != VK_SUCCESS) return false;
    uint32_t count = 1;
    vkEnumeratePhysicalDevices(instance, &count, &physical);
    if (count == 0) return false;
    const float priority = 1.0F;
    VkDeviceQueueCreateInfo of_queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    of_queue.queueCount = 1;
    of_queue.pQueuePriorities = &priority;
    const VkPhysicalDeviceFeatures features{};
    VkDeviceCreateInfo of_device{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    of_device.queueCreateInfoCount = 1;
    of_device.pQueueCreateInfos = &of_queue;
    of_device.pEnabledFeatures = &features;
    const auto create_device =
        reinterpret_cast<PFN_vkCreateDevice>(get(instance, "vkCreateDevice"));
    if (create_device(physical, &of_device, nullptr, &device) != VK_SUCCESS) return false;
    const auto get_device =
        reinterpret_cast<PFN_vkGetDeviceProcAddr>(get(instance, "vkGetDeviceProcAddr"));
    submit_ = reinterpret_cast<PFN_vkQueueSubmit>(get_device(device, "vkQueueSubmit"));
    wait_device_ = reinterpret_cast<PFN_vkDeviceWaitIdle>(get_device(device, "vkDeviceWaitIdle"));
    // What the device does not have, the plugin does not invent.
    EXPECT_EQ(get_device(device, "vkQueuePresentKHR"), nullptr);
    vkGetDeviceQueue(device, 0, 0, &queue);
    VkCommandPoolCreateInfo of_pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    of_pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    EXPECT_EQ(vkCreateCommandPool(device, &of_pool, nullptr, &pool_), VK_SUCCESS);
    renderer = kRendererVulkan;
    if (listener_) listener_(GraphicsEvent::kInitialize);
    return true;
  }

  Surface* make_surface(VkFormat format, VkImageAspectFlags aspect, VkImageUsageFlags usage) {
    surfaces_.push_back({.format = format, .aspect = aspect, .usage = usage});
    Surface& made = surfaces_.back();
    VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    create.imageType = VK_IMAGE_TYPE_2D;
    create.format = format;
    create.extent = {kWidth, kHeight, 1};
    create.mipLevels = create.arrayLayers = 1;
    create.samples = VK_SAMPLE_COUNT_1_BIT;
    create.usage = usage;
    EXPECT_EQ(vkCreateImage(device, &create, nullptr, &made.image), VK_SUCCESS);
    VkMemoryRequirements needed;
    vkGetImageMemoryRequirements(device, made.image, &needed);
    made.memory = allocate(needed, 0);
    EXPECT_EQ(vkBindImageMemory(device, made.image, made.memory, 0), VK_SUCCESS);
    return &made;
  }

  void clear(Surface& colour, const VkClearColorValue& value) {
    const VkImageSubresourceRange all{colour.aspect, 0, 1, 0, 1};
    to(colour, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    vkCmdClearColorImage(commands(), colour.image, colour.layout, &value, 1, &all);
  }
  void clear(Surface& depth, float value) {
    const VkImageSubresourceRange all{depth.aspect, 0, 1, 0, 1};
    const VkClearDepthStencilValue both{value, 0};
    to(depth, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    vkCmdClearDepthStencilImage(commands(), depth.image, depth.layout, &both, 1, &all);
  }

  std::vector<uint32_t> read(Surface& colour) {
    VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    create.size = 4 * kWidth * kHeight;
    create.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    VkBuffer buffer = VK_NULL_HANDLE;
    EXPECT_EQ(vkCreateBuffer(device, &create, nullptr, &buffer), VK_SUCCESS);
    VkMemoryRequirements needed;
    vkGetBufferMemoryRequirements(device, buffer, &needed);
    const VkDeviceMemory memory = allocate(
        needed, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    EXPECT_EQ(vkBindBufferMemory(device, buffer, memory, 0), VK_SUCCESS);
    to(colour, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {kWidth, kHeight, 1};
    vkCmdCopyImageToBuffer(commands(), colour.image, colour.layout, buffer, 1, &region);
    flush();
    wait_device_(device);
    std::vector<uint32_t> pixels(kWidth * kHeight);
    void* mapped = nullptr;
    EXPECT_EQ(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), VK_SUCCESS);
    std::memcpy(pixels.data(), mapped, 4 * pixels.size());
    vkDestroyBuffer(device, buffer, nullptr);
    vkFreeMemory(device, memory, nullptr);
    return pixels;
  }

  /// An empty submission, as Unity's own thread would make it.
  void submit_nothing() {
    const VkSubmitInfo none{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    EXPECT_EQ(submit_(queue, 1, &none, VK_NULL_HANDLE), VK_SUCCESS);
  }
  void end_graphics() {
    flush();
    wait_device_(device);
    if (listener_) listener_(GraphicsEvent::kShutdown);
    renderer = kRendererNone;
  }

  static constexpr int kRendererNone = 4, kFirstEvent = 17;
  int renderer = kRendererNone;
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  bool has_vulkan_table = true;
  uint32_t asked_version = 0;
  int flushes = 0, needs_of_event = -1;
  std::atomic<int> submissions{0};
  std::atomic<bool> is_palpates{false}, wrong{false};
  PalVulkan of_plugin{};
  static FakeUnity* self;

 private:
  VkDeviceMemory allocate(const VkMemoryRequirements& needed, VkMemoryPropertyFlags wanted) {
    VkPhysicalDeviceMemoryProperties types;
    vkGetPhysicalDeviceMemoryProperties(physical, &types);
    VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    info.allocationSize = needed.size;
    while (!(needed.memoryTypeBits >> info.memoryTypeIndex & 1U) ||
           (types.memoryTypes[info.memoryTypeIndex].propertyFlags & wanted) != wanted)
      ++info.memoryTypeIndex;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    EXPECT_EQ(vkAllocateMemory(device, &info, nullptr, &memory), VK_SUCCESS);
    return memory;
  }

  /// The command buffer of this frame.
  VkCommandBuffer commands() {
    if (recording_) return recording_;
    VkCommandBufferAllocateInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    info.commandPool = pool_;
    info.commandBufferCount = 1;
    EXPECT_EQ(vkAllocateCommandBuffers(device, &info, &recording_), VK_SUCCESS);
    const VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    EXPECT_EQ(vkBeginCommandBuffer(recording_, &begin), VK_SUCCESS);
    return recording_;
  }

  void flush() {
    if (!recording_) return;
    EXPECT_EQ(vkEndCommandBuffer(recording_), VK_SUCCESS);
    VkSubmitInfo info{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    info.commandBufferCount = 1;
    info.pCommandBuffers = &recording_;
    EXPECT_EQ(submit_(queue, 1, &info, VK_NULL_HANDLE), VK_SUCCESS);
    recording_ = VK_NULL_HANDLE;
    ++flushes;
  }

  void to(Surface& surface, VkImageLayout layout) {
    VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    barrier.srcAccessMask = barrier.dstAccessMask =
        VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = surface.layout;
    barrier.newLayout = layout;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = surface.image;
    barrier.subresourceRange = {surface.aspect, 0, 1, 0, 1};
    vkCmdPipelineBarrier(commands(), VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1,
                         &barrier);
    surface.layout = layout;
  }

  // The driver, with a submit that detects palpate on the queue at the same time.
  static PFN_vkVoidFunction VKAPI_CALL get_instance_function(VkInstance of, const char* name) {
    if (std::string(name) == "vkGetDeviceProcAddr")
      return reinterpret_cast<PFN_vkVoidFunction>(&get_device_function);
    if (std::string(name) == "vkCreateInstance")
      return reinterpret_cast<PFN_vkVoidFunction>(&keeping_create_instance);
    return vkGetInstanceProcAddr(of, name);
  }
  static VkResult VKAPI_CALL keeping_create_instance(const VkInstanceCreateInfo* info,
                                                     const VkAllocationCallbacks* allocator,
                                                     VkInstance* made) {
    self->asked_version = info->pApplicationInfo->apiVersion;
    return vkCreateInstance(info, allocator, made);
  }
  static PFN_vkVoidFunction VKAPI_CALL get_device_function(VkDevice of, const char* name) {
    if (std::string(name) == "vkQueueSubmit")
      return reinterpret_cast<PFN_vkVoidFunction>(&counting_submit);
    return vkGetDeviceProcAddr(of, name);
  }
  static VkResult VKAPI_CALL counting_submit(VkQueue to, uint32_t count, const VkSubmitInfo* infos,
                                             VkFence fence) {
    if (self->is_palpates) self->wrong = true;
    const VkResult result = vkQueueSubmit(to, count, infos, fence);
    if (self->is_palpates) self->wrong = true;
    ++self->submissions;
    return result;
  }

  // The tables.
  static void* get_table(TableKey key) {
    if (key.high == kGraphicsKey.high && key.low == kGraphicsKey.low) return &self->graphics_;
    if (key.high == kVulkanKey.high && key.low == kVulkanKey.low && self->has_vulkan_table)
      return &self->vulkan_;
    return nullptr;
  }
  static bool add_init_hook(InitHook hook, void* user, int32_t) {
    if (self->device) return false;  // too late
    self->hook_ = hook;
    self->hook_user_ = user;
    return true;
  }
  static UnityDevice unity_device() {
    UnityDevice device{};
    device.instance = self->instance;
    device.physical = self->physical;
    device.device = self->device;
    device.queue = self->queue;
    return device;
  }
  static bool access_buffer_texture(void* buffer, const VkImageSubresource*, VkImageLayout layout,
                                    VkPipelineStageFlags, VkAccessFlags, TextureAccess,
                                    UnityImage* image) {
    Surface& surface = *static_cast<Surface*>(buffer);
    EXPECT_FALSE(self->in_queue_) << "an image was accessed in a callback that has the queue";
    self->to(surface, layout);
    image->image = surface.image;
    image->layout = surface.layout;
    image->aspect = surface.aspect;
    image->usage = surface.usage;
    image->format = surface.format;
    image->extent = {kWidth, kHeight, 1};
    image->samples = VK_SAMPLE_COUNT_1_BIT;
    image->layers = image->mip_levels = 1;
    return true;
  }
  static void access_queue(RenderEvent event, int id, void* data, bool flushes_first) {
    if (flushes_first) self->flush();
    self->in_queue_ = true;
    event(id, data);
    self->in_queue_ = false;
  }

  Tables tables_{.get = &get_table};
  GraphicsTable graphics_{
      .renderer = [] { return self->renderer; },
      .add_listener = [](void (*listener)(GraphicsEvent)) { self->listener_ = listener; },
      .remove_listener = [](void (*)(GraphicsEvent)) { self->listener_ = nullptr; },
      .reserve_events = [](int) { return kFirstEvent; }};
  VulkanTable vulkan_{
      .configure_event =
          [](int event, const EventNeeds* needs) { self->needs_of_event = event + needs->queue; },
      .device = &unity_device,
      .access_buffer_texture = &access_buffer_texture,
      .access_queue = &access_queue,
      .add_init_hook = &add_init_hook,
      .remove_init_hook = [](InitHook) { return true; }};
  std::optional<files::SharedLibrary> plugin_;
  InitHook hook_ = nullptr;
  void* hook_user_ = nullptr;
  void (*listener_)(GraphicsEvent) = nullptr;
  PFN_vkQueueSubmit submit_ = nullptr;
  PFN_vkDeviceWaitIdle wait_device_ = nullptr;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer recording_ = VK_NULL_HANDLE;
  std::deque<Surface> surfaces_;
  bool in_queue_ = false;
};
FakeUnity* FakeUnity::self = nullptr;

/// Peak signal to noise ratio of the colours of two pictures, dB.
double agreement_db(const std::vector<uint32_t>& a, const std::vector<uint32_t>& b) {
  double sum = 0.0;
  for (size_t p = 0; p < a.size(); ++p)
    for (int shift : {0, 8, 16})
      sum += std::pow(double(a[p] >> shift & 255U) - double(b[p] >> shift & 255U), 2.0);
  return 10.0 * std::log10(255.0 * 255.0 * 3.0 * double(a.size()) / std::max(sum, 1e-9));
}

TEST(UnityPlugin, DrawsIntoTheImagesOfAHostWithUnitysTables) {
  FakeUnity unity;
  unity.load_plugin();
  if (!unity.start_graphics()) GTEST_SKIP() << "There is no Vulkan driver here.";
  EXPECT_EQ(unity.asked_version, VK_API_VERSION_1_2) << "the instance is of palpate's version";
  EXPECT_EQ(unity.needs_of_event, FakeUnity::kFirstEvent) << "its event asks for no queue";
  PalVulkan shared{};
  ASSERT_EQ(unity.function<decltype(palpate_unity_device)>("palpate_unity_device")(&shared), PAL_OK)
      << unity.function<decltype(palpate_unity_error)>("palpate_unity_error")();
  // Tells the driver above when palpate has the queue.
  unity.of_plugin = shared;
  shared.lock_queue = [](void*) {
    FakeUnity::self->of_plugin.lock_queue(nullptr);
    FakeUnity::self->is_palpates = true;
  };
  shared.unlock_queue = [](void*) {
    FakeUnity::self->is_palpates = false;
    FakeUnity::self->of_plugin.unlock_queue(nullptr);
  };

  Opened opened;
  PalContextInfo context = context_info(0);
  context.vulkan = &shared;
  PAL_ASSERT_OK(pal_context_open(&context, &opened.context));
  const BallFrames ball(2);
  const char* path = "ball";
  const PalSceneInfo scene = scene_info(&path, 0, &ball.info);
  PAL_ASSERT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
  // Unity's thread submits while palpate estimates the motion and uploads on threads of its own.
  std::atomic<bool> ends{false};
  std::thread submitting([&] {
    while (!ends) unity.submit_nothing();
  });
  const PalDeviceInfo device = host_device();
  PalSessionInfo session{};
  session.size = sizeof session;
  session.flags = PAL_SESSION_HOST_TICKS;
  session.host = &device;
  session.preset = "fast";
  std::atomic<bool> is_final{false};
  session.user = &is_final;
  session.on_event = [](void* user, PalEventKind kind, const char*) {
    if (kind == PAL_EVENT_WHOLE_MOTION) *static_cast<std::atomic<bool>*>(user) = true;
  };
  PAL_EXPECT_OK(pal_session_open(opened.scene, &session, &opened.session));
  PalViewInfo of_view{};
  of_view.size = sizeof of_view;
  of_view.width = kWidth;
  of_view.height = kHeight;
  of_view.eye_count = 1;
  PAL_EXPECT_OK(pal_view_open(opened.session, &of_view, &opened.view));
  PalState state{};
  state.size = sizeof state;
  // Until the motion is final: others are felt and seen before, and later pictures would differ.
  for (int k = 0; k < 60'000 && !is_final; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(is_final);
  PAL_EXPECT_OK(pal_session_state(opened.session, &state));
  EXPECT_EQ(state.can_play, 1U);
  ends = true;
  submitting.join();
  EXPECT_GT(unity.submissions, 100);
  EXPECT_FALSE(unity.wrong) << "the queue was used by both at the same time";

  HostHand hand{opened.session};
  hand.at(0.05);
  const PalEye eye{{0.0, 0.0, 0.15}, {0.0, 0.0, 0.0, 1.0}, -0.3, 0.3, -0.2, 0.2};
  constexpr VkImageUsageFlags kCopied =
      VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  Surface* const colour = unity.make_surface(VK_FORMAT_R8G8B8A8_SRGB, VK_IMAGE_ASPECT_COLOR_BIT,
                                             kCopied | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
  Surface* const depth = unity.make_surface(VK_FORMAT_D32_SFLOAT, VK_IMAGE_ASPECT_DEPTH_BIT,
                                            kCopied | VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
  auto* const event = reinterpret_cast<RenderEvent>(
      unity.function<decltype(palpate_unity_event)>("palpate_unity_event")());
  EXPECT_EQ(unity.function<decltype(palpate_unity_event_id)>("palpate_unity_event_id")(),
            FakeUnity::kFirstEvent);
  PalUnityPicture picture{};
  picture.size = sizeof picture;
  picture.eye_count = 1;
  picture.view = opened.view;
  picture.eyes[0] = eye;
  picture.colour[0] = colour;
  picture.depth[0] = depth;
  picture.inverse_depth_0 = 1.0 / kFar_m;
  picture.inverse_depth_1 = 1.0 / kNear_m;
  const auto drawn = [&](float host_depth) {
    unity.clear(*colour, kBlack);
    unity.clear(*depth, host_depth);
    picture.is_done = 0;
    event(FakeUnity::kFirstEvent, &picture);
    EXPECT_EQ(picture.is_done, 1U);
    EXPECT_EQ(picture.result, PAL_OK) << picture.sentence;
    EXPECT_EQ(colour->layout, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    return unity.read(*colour);
  };
  // Nothing before it: the picture that the library draws there itself. Unity's depth is reversed:
  // 0 is far.
  const std::vector<uint32_t> far = drawn(0.0F);
  unity.clear(*colour, kBlack);
  unity.clear(*depth, 0.0F);
  const std::vector<uint32_t> black = unity.read(*colour);
  EXPECT_LT(agreement_db(far, black), 30.0) << "the ball is seen";
  PalImages images = picture.images;
  images.colour_layout = colour->layout;
  images.depth_layout = depth->layout;
  PAL_ASSERT_OK(pal_view_render(opened.view, &eye, 1, kWidth, kHeight, 0.0, &images));
  EXPECT_EQ(unity.read(*colour), far);
  // Something before it: what the host drew.
  EXPECT_EQ(drawn(1.0F), black);

  // A view that is opened only now: back-tracking begins elsewhere, and ends within its tolerance.
  PalView* later = nullptr;
  PAL_ASSERT_OK(pal_view_open(opened.session, &of_view, &later));
  picture.view = later;
  const std::vector<uint32_t> anew = drawn(0.0F);
  EXPECT_GT(agreement_db(anew, far), 50.0);
  PAL_ASSERT_OK(pal_view_close(&later));

  // Two eyes, each into an image of its own; the second one further to the right.
  Surface* const right = unity.make_surface(VK_FORMAT_R8G8B8A8_SRGB, VK_IMAGE_ASPECT_COLOR_BIT,
                                            kCopied | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
  of_view.eye_count = 2;
  PalView* stereo = nullptr;
  PAL_ASSERT_OK(pal_view_open(opened.session, &of_view, &stereo));
  picture.view = stereo;
  picture.eye_count = 2;
  picture.eyes[1] = eye;
  picture.eyes[1].position_m[0] = 0.06;
  picture.colour[1] = right;
  picture.depth[1] = depth;
  unity.clear(*right, kBlack);
  const std::vector<uint32_t> left_eye = drawn(0.0F), right_eye = unity.read(*right);
  EXPECT_LT(agreement_db(right_eye, far), 30.0);
  EXPECT_LT(agreement_db(right_eye, black), 30.0);
  // Both are what the library draws for two eyes itself. (The first one is not the picture of one
  // eye: letters come in where the second eye's border would cut them.)
  unity.clear(*colour, kBlack);
  unity.clear(*right, kBlack);
  EXPECT_EQ(unity.read(*right), black);  // the clearing is submitted
  images = picture.images;
  images.colour_layout = colour->layout;
  images.depth_layout = depth->layout;
  PAL_ASSERT_OK(pal_view_render(stereo, picture.eyes, 2, kWidth, kHeight, 0.0, &images));
  EXPECT_EQ(unity.read(*colour), left_eye);
  EXPECT_EQ(unity.read(*right), right_eye);
  EXPECT_GT(agreement_db(left_eye, far), 20.0);
  PAL_ASSERT_OK(pal_view_close(&stereo));
  picture.view = opened.view;
  picture.eye_count = 1;

  // What can not be drawn is told in the picture.
  Surface* const not_copied = unity.make_surface(VK_FORMAT_R8G8B8A8_SRGB, VK_IMAGE_ASPECT_COLOR_BIT,
                                                 VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
  picture.colour[0] = not_copied;
  event(FakeUnity::kFirstEvent, &picture);
  EXPECT_EQ(picture.result, PAL_BAD_INPUT);
  EXPECT_THAT(picture.sentence, HasSubstr("allow transfers"));
  picture.colour[0] = colour;
  picture.eyes[0].orientation[3] = 0.0;
  event(FakeUnity::kFirstEvent, &picture);
  EXPECT_EQ(picture.result, PAL_BAD_INPUT);
  EXPECT_STREQ(picture.sentence, pal_last_error());
  picture.size = 8;
  event(FakeUnity::kFirstEvent, &picture);
  EXPECT_EQ(picture.result, PAL_BAD_INPUT);

  // The device goes: what is issued after that fails in a sentence.
  pal_view_close(&opened.view);
  pal_session_close(&opened.session);
  pal_scene_close(&opened.scene);
  pal_context_close(&opened.context);
  unity.end_graphics();
  picture.size = sizeof picture;
  event(FakeUnity::kFirstEvent, &picture);
  EXPECT_EQ(picture.result, PAL_NO_DEVICE);
}

TEST(UnityPlugin, SaysWhyThereIsNoDevice) {
  const auto refusal = [](FakeUnity& unity) {
    PalVulkan shared{};
    EXPECT_EQ(unity.function<decltype(palpate_unity_device)>("palpate_unity_device")(&shared),
              PAL_NO_DEVICE);
    return std::string(unity.function<decltype(palpate_unity_error)>("palpate_unity_error")());
  };
  {
    FakeUnity unity;
    unity.load_plugin();
    EXPECT_THAT(refusal(unity), HasSubstr("does not draw with Vulkan"));
  }
  {
    FakeUnity unity;
    unity.has_vulkan_table = false;
    unity.load_plugin();
    EXPECT_THAT(refusal(unity), HasSubstr("does not draw with Vulkan"));
  }
  {
    FakeUnity unity;
    if (!unity.start_graphics()) GTEST_SKIP() << "There is no Vulkan driver here.";
    unity.load_plugin();
    EXPECT_THAT(refusal(unity), HasSubstr("Load on startup"));
  }
}

}  // namespace
}  // namespace palpate::test
