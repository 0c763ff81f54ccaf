#pragma once

#include <vulkan/vulkan.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::vulkan {

/// Thrown where a Vulkan call fails. It ends in tried(), which the public functions of every
/// library use that records or submits: nothing outside compute/ catches or names it.
class Failure : public std::runtime_error {
 public:
  Failure(VkResult result, const std::string& doing);
  VkResult result() const { return result_; }
  Error error() const;

 private:
  VkResult result_;
};

/// Throws Failure unless `result` is VK_SUCCESS; `doing` completes the sentence "while ...".
void check(VkResult result, const char* doing);

/// Description of a device for the user.
struct GpuInfo {
  int index = 0;  ///< as `--gpu` takes it
  std::string name;
  std::string driver;  ///< name and version
  std::string kind;    ///< "discrete GPU", "integrated GPU", "CPU", ...
  uint32_t api_major = 1, api_minor = 0;
  uint64_t memory_bytes = 0;   ///< largest device-local heap; of a CPU the machine's memory
  uint64_t binding_bytes = 0;  ///< largest storage buffer binding
  bool usable = false;         ///< false if something that the engine needs is missing
  std::string missing;         ///< what is missing, as text
};

/// Every Vulkan device that the loader finds, usable or not, in the loader's order; empty if there
/// is no driver.
std::vector<GpuInfo> list_devices();

/// Makes the three Vulkan calls that create the context: a headset's runtime adds the extensions
/// that it needs and chooses the device that drives the display. Called by Context::open on its
/// thread, in this order; each function returns the result of its Vulkan call.
class DeviceMaker {
 public:
  virtual ~DeviceMaker() = default;
  virtual VkResult create_instance(const VkInstanceCreateInfo& create, VkInstance* instance) = 0;
  virtual VkResult choose_device(VkInstance instance, VkPhysicalDevice* device) = 0;
  virtual VkResult create_device(VkPhysicalDevice device, const VkDeviceCreateInfo& create,
                                 VkDevice* made) = 0;
};

struct ContextOptions {
  std::string device;       ///< index or part of the name; empty: the first GPU, else the CPU
  bool validation = false;  ///< Khronos validation with synchronisation validation, if installed
  uint64_t memory_cap_bytes = 0;  ///< upper limit on the memory that is used; 0: none
  DeviceMaker* maker = nullptr;   ///< creates and chooses the device; `device` is then ignored
};

/// A device that the caller has created and continues to use. It needs Vulkan 1.2 or later and the
/// feature shaderStorageImageWriteWithoutFormat, and must outlive the context.
struct SharedDevice {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical_device = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  uint32_t queue_family = 0;  ///< with compute
  VkQueue queue = VK_NULL_HANDLE;
  /// Called before and after every use of the queue, on any thread. Set both, or neither if only
  /// this context uses the queue. If lock_queue fails, nothing is submitted, and what asked for it
  /// fails with its words, which complete the sentence "while ...".
  std::function<Status()> lock_queue;
  std::function<void()> unlock_queue;
  /// Whether it was created with the feature shaderStorageImageExtendedFormats, which saves memory.
  bool has_extended_formats = false;
};

/// Where memory lies. kDevice: device-local. kHostVisible: host memory, coherent, fast for the host
/// to read. kFilledByHost: written by the host, read by kernels; device-local where the host can
/// write there, since kernels that read host memory wait for the bus.
enum class MemoryKind { kDevice, kHostVisible, kFilledByHost };

/// An opened device with one compute queue. It must outlive its buffers, images, kernels and
/// recorders. Resources may be created on any thread; submit() serialises on the queue.
class Context {
 public:
  static Result<std::shared_ptr<Context>> open(const ContextOptions& options);
  /// Uses a device of the caller, which is not destroyed. memory_cap_bytes: as in ContextOptions.
  /// Errors: kBadInput if something is missing from `shared`, kNoDevice if the device can not do
  /// the work.
  static Result<std::shared_ptr<Context>> share(const SharedDevice& shared,
                                                uint64_t memory_cap_bytes = 0);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  VkInstance instance() const { return instance_; }
  VkDevice device() const { return device_; }
  VkPhysicalDevice physical_device() const { return physical_device_; }
  uint32_t queue_family() const { return queue_family_; }
  const GpuInfo& info() const { return info_; }
  const VkPhysicalDeviceLimits& limits() const { return limits_; }
  bool is_cpu() const { return is_cpu_; }
  /// Whether kernels may also load from storage images of r8, r16f and rg32f.
  bool loads_extended_formats() const { return loads_extended_formats_; }

  /// Device memory that one estimation may use, at most the cap. On a driver for CPUs two thirds of
  /// what the machine has free now: it takes the machine's own memory, whatever it reports.
  uint64_t memory_budget_bytes() const;
  /// The largest image that the device makes.
  uint64_t largest_image_bytes() const { return largest_image_; }
  uint64_t memory_used_bytes() const { return memory_used_; }
  uint64_t memory_peak_bytes() const { return memory_peak_; }
  void reset_memory_peak() { memory_peak_ = memory_used_.load(); }

  /// Allocates memory. Only kDevice is counted. Throws Failure.
  VkDeviceMemory allocate(const VkMemoryRequirements& needed, MemoryKind kind);
  void release(VkDeviceMemory memory, uint64_t bytes, MemoryKind kind);

  void submit(VkCommandBuffer commands, VkFence fence);

  /// Locks the queue, for calls outside this class that use it (a headset's runtime, presenting to
  /// a window). The holder must not call submit().
  [[nodiscard]] std::unique_lock<std::mutex> hold_queue() { return std::unique_lock(queue_mutex_); }
  /// The queue itself, index 0 of its family: only while hold_queue() is held.
  VkQueue queue() const { return queue_; }

  /// Messages of the validation layers so far (tests require none). Any thread.
  std::vector<std::string> validation_messages() const;
  bool validation_active() const { return messenger_ != VK_NULL_HANDLE; }

 private:
  Context() = default;
  void read_properties();
  void listen();
  static VkBool32 VKAPI_PTR on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                       VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT*, void* context);

  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_device_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  uint32_t queue_family_ = 0;
  bool shared_ = false;  ///< instance and device belong to the caller
  std::function<Status()> lock_queue_;
  std::function<void()> unlock_queue_;
  VkPhysicalDeviceLimits limits_{};
  VkPhysicalDeviceMemoryProperties memory_{};
  GpuInfo info_;
  bool is_cpu_ = false;
  bool loads_extended_formats_ = false;
  uint64_t memory_cap_ = 0;
  uint64_t largest_image_ = 0;
  std::atomic<uint64_t> memory_used_{0};
  std::atomic<uint64_t> memory_peak_{0};
  std::mutex queue_mutex_;
  mutable std::mutex message_mutex_;
  std::vector<std::string> messages_;
};

}  // namespace palpate::vulkan
