#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/image.h"
#include "compute/vulkan/kernel.h"

namespace palpate::vulkan {

/// One argument of a dispatch: the resource to bind.
struct Binding {
  Binding(const Buffer& bound) : buffer(&bound) {}
  Binding(const TexelView& bound) : texels(&bound) {}
  Binding(const Image& bound) : image(&bound) {}
  Binding(const Image& bound, const Sampler& through) : image(&bound), sampler(&through) {}
  const Buffer* buffer = nullptr;
  const TexelView* texels = nullptr;
  const Image* image = nullptr;
  const Sampler* sampler = nullptr;
};

/// A list of device work that is recorded once and can be run many times. Every dispatch and copy
/// waits for the one before it, unless both are between begin_concurrent() and end_concurrent().
/// All resources in the list must outlive it. One thread at a time. Throws Failure.
class Recorder {
 public:
  explicit Recorder(std::shared_ptr<Context> context, uint32_t max_dispatches = 64);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  /// Waits for the running list, clears it and begins a new one.
  void restart();
  /// Brings a new image into layout GENERAL, in which it stays; its contents are undefined.
  void prepare(const Image& image);
  /// `push` has the size that the kernel expects; `groups` counts workgroups of the kernel's own
  /// size.
  void dispatch(const Kernel& kernel, const std::vector<Binding>& bindings, const void* push,
                glm::ivec3 groups);
  template <class Push>
  void dispatch(const Kernel& kernel, const std::vector<Binding>& bindings, const Push& push,
                glm::ivec3 groups) {
    dispatch(kernel, bindings, static_cast<const void*>(&push), groups);
  }
  /// Reads the number of workgroups from three words of a buffer, starting at `first_word`: for
  /// work lists that the device has made.
  void dispatch_indirect(const Kernel& kernel, const std::vector<Binding>& bindings,
                         const void* push, const Buffer& groups, uint64_t first_word);
  void copy(const Buffer& from, const Image& to);
  void copy(const Image& from, const Buffer& to);
  void copy(const Buffer& from, const Buffer& to, uint64_t bytes);
  /// Copies slices [first, first + slices) of the image to the start of the buffer.
  void copy_slices(const Image& from, int first, int slices, const Buffer& to);
  /// Fills the first `bytes` of the buffer, a multiple of 4.
  void fill(const Buffer& buffer, uint32_t word, uint64_t bytes = VK_WHOLE_SIZE);
  void clear(const Image& image, glm::vec4 value = glm::vec4(0.0F));
  void begin_concurrent();
  void end_concurrent();
  /// Writes a device time stamp with a name; read it with timestamps() after run().
  void stamp(const std::string& name);

  /// The command buffer, for commands that this class does not offer; the caller adds barriers.
  VkCommandBuffer commands() {
    transferred_ = true;
    return commands_;
  }

  /// Runs the whole list and waits. May be called again.
  void run();
  /// Starts without waiting; wait() must follow before the next start().
  void start();
  void wait();
  /// Waits if something runs; an error of the device is left to the next call that meets it.
  void drain() noexcept;

  struct TimerStamp {
    std::string name;
    double seconds;  ///< since the first stamp
  };
  std::vector<TimerStamp> timestamps();

 private:
  enum class Next { kDispatch, kIndirectDispatch, kTransfer };
  void bind(const Kernel& kernel, const std::vector<Binding>& bindings, const void* push,
            Next next);
  /// Lets the next command wait for all before it, and see what they wrote.
  void barrier(Next next);
  void finish();

  std::shared_ptr<Context> context_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  std::vector<std::string> stamp_names_;
  uint32_t max_dispatches_ = 0, dispatches_left_ = 0;
  bool recording_ = true;
  bool concurrent_ = false;
  std::optional<Next> waited_;  // by a command of this kind, in the concurrent part
  bool transferred_ = true;     // copies may have run since the last barrier that waits for them
  bool pending_ = false;
};

}  // namespace palpate::vulkan
