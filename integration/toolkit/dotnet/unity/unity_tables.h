#pragma once
// The tables of functions that Unity gives to a native plugin, as far as palpate uses them. Written
// from their published layout (names, order and types of members, numbers of enumerators); Unity's
// own headers are not part of palpate.
#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>

#if defined(_WIN32)
#define PALPATE_UNITY_CALL __stdcall
#define PALPATE_UNITY_EXPORT extern "C" __declspec(dllexport)
#else
#define PALPATE_UNITY_CALL
#define PALPATE_UNITY_EXPORT extern "C" __attribute__((visibility("default")))
#endif

namespace palpate::unity {

/// The key of a table.
struct TableKey {
  uint64_t high, low;
};

/// All tables, by key; given to UnityPluginLoad().
struct Tables {
  void*(PALPATE_UNITY_CALL* get)(TableKey key);
  void(PALPATE_UNITY_CALL* add)(TableKey key, void* table);
  void*(PALPATE_UNITY_CALL* get_split)(uint64_t high, uint64_t low);
  void(PALPATE_UNITY_CALL* add_split)(uint64_t high, uint64_t low, void* table);
};

enum class GraphicsEvent : int {
  kInitialize = 0,
  kShutdown = 1,
  kBeforeReset = 2,
  kAfterReset = 3
};
constexpr int kRendererVulkan = 21;

constexpr TableKey kGraphicsKey{0x7CBA0A9CA4DDB544, 0x8C5AD4926EB17B11};
struct GraphicsTable {
  int(PALPATE_UNITY_CALL* renderer)();
  void(PALPATE_UNITY_CALL* add_listener)(void(PALPATE_UNITY_CALL* listener)(GraphicsEvent event));
  void(PALPATE_UNITY_CALL* remove_listener)(
      void(PALPATE_UNITY_CALL* listener)(GraphicsEvent event));
  int(PALPATE_UNITY_CALL* reserve_events)(int count);
};

/// What a command buffer calls on the render thread.
using RenderEvent = void(PALPATE_UNITY_CALL*)(int event, void* data);
/// Called with the loader's function before Unity makes its instance; Unity then uses the returned
/// one.
using InitHook = PFN_vkGetInstanceProcAddr(PALPATE_UNITY_CALL*)(PFN_vkGetInstanceProcAddr loader,
                                                                void* user);

struct UnityDevice {
  VkPipelineCache pipeline_cache;
  VkInstance instance;
  VkPhysicalDevice physical;
  VkDevice device;
  VkQueue queue;
  PFN_vkGetInstanceProcAddr get_instance_function;
  unsigned int queue_family;
  void* reserved[8];
};

struct UnityMemory {
  VkDeviceMemory memory;
  VkDeviceSize offset, size;
  void* mapped;
  VkMemoryPropertyFlags flags;
  unsigned int type;
  void* reserved[4];
};

struct UnityImage {
  UnityMemory memory;
  VkImage image;
  VkImageLayout layout;
  VkImageAspectFlags aspect;
  VkImageUsageFlags usage;
  VkFormat format;
  VkExtent3D extent;
  VkImageTiling tiling;
  VkImageType type;
  VkSampleCountFlagBits samples;
  int layers, mip_levels;
  void* reserved[4];
};

/// What an access to a texture does with its layout.
enum class TextureAccess : int { kObserve = 0, kBarrier = 1, kRecreate = 2 };

/// What must hold when an event is called.
struct EventNeeds {
  enum Pass : int { kAny = 0, kInside = 1, kOutside = 2 } pass;
  enum Queue : int { kNoQueue = 0, kQueue = 1 } queue;
  enum Flags : uint32_t {
    kPreviousFrameSubmitted = 1,
    kFlush = 2,
    kSyncWorkers = 4,
    kChangesState = 8
  };
  uint32_t flags;
};

constexpr TableKey kVulkanKey{0x329334C09DCA4787, 0xB347DD92A0097FFC};
struct VulkanTable {
  bool(PALPATE_UNITY_CALL* intercept_initialization)(InitHook hook, void* user);
  PFN_vkVoidFunction(PALPATE_UNITY_CALL* intercept_function)(const char* name,
                                                             PFN_vkVoidFunction function);
  void(PALPATE_UNITY_CALL* configure_event)(int event, const EventNeeds* needs);
  UnityDevice(PALPATE_UNITY_CALL* device)();
  bool(PALPATE_UNITY_CALL* recording_state)(void* state, int queue_access);
  /// nativeTexture: Texture.GetNativeTexturePtr(); subresource null: all of it. Records the barrier
  /// into Unity's commands.
  bool(PALPATE_UNITY_CALL* access_texture)(void* texture, const VkImageSubresource* subresource,
                                           VkImageLayout layout, VkPipelineStageFlags stages,
                                           VkAccessFlags accesses, TextureAccess access,
                                           UnityImage* image);
  /// The same for RenderBuffer.GetNativeRenderBufferPtr(): colour or depth of a render texture.
  bool(PALPATE_UNITY_CALL* access_buffer_texture)(void* buffer,
                                                  const VkImageSubresource* subresource,
                                                  VkImageLayout layout, VkPipelineStageFlags stages,
                                                  VkAccessFlags accesses, TextureAccess access,
                                                  UnityImage* image);
  bool(PALPATE_UNITY_CALL* access_resolve_texture)(
      void* buffer, const VkImageSubresource* subresource, VkImageLayout layout,
      VkPipelineStageFlags stages, VkAccessFlags accesses, TextureAccess access, UnityImage* image);
  bool(PALPATE_UNITY_CALL* access_buffer)(void* buffer, VkPipelineStageFlags stages,
                                          VkAccessFlags accesses, TextureAccess access, void* out);
  void(PALPATE_UNITY_CALL* leave_render_pass)();
  void(PALPATE_UNITY_CALL* enter_render_pass)();
  /// Calls `event` while Unity does not use its queue; flush: after all commands of this frame are
  /// submitted.
  void(PALPATE_UNITY_CALL* access_queue)(RenderEvent event, int id, void* data, bool flush);
  bool(PALPATE_UNITY_CALL* configure_swapchain)(const void* configuration);
  bool(PALPATE_UNITY_CALL* access_texture_by_id)(unsigned int id,
                                                 const VkImageSubresource* subresource,
                                                 VkImageLayout layout, VkPipelineStageFlags stages,
                                                 VkAccessFlags accesses, TextureAccess access,
                                                 UnityImage* image);
  bool(PALPATE_UNITY_CALL* add_init_hook)(InitHook hook, void* user, int32_t priority);
  bool(PALPATE_UNITY_CALL* remove_init_hook)(InitHook hook);
};

// On 64 bits; a table whose members are out of order fails elsewhere, one with a hole fails here.
static_assert(sizeof(Tables) == 4 * sizeof(void*) && sizeof(GraphicsTable) == 4 * sizeof(void*));
static_assert(sizeof(VulkanTable) == 16 * sizeof(void*) &&
              offsetof(VulkanTable, access_queue) == 11 * sizeof(void*));
static_assert(sizeof(UnityDevice) == 120 && sizeof(UnityMemory) == 72 && sizeof(UnityImage) == 160);

}  // namespace palpate::unity
