#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "compute/volume/result.h"
#include "compute/vulkan/context.h"
#include "integration/running/session_request.h"
#include "integration/toolkit/palpate.h"
#include "module/session/loaded_scene.h"

/// Shared by the functions of palpate.h: handles that are safe against wrong calls, structures of
/// older programs, and errors as a number with a sentence.
namespace palpate::toolkit {

/// Keeps the sentence for pal_last_error() of this thread. Any thread; does not allocate.
PalResult failed(PalResult result, std::initializer_list<std::string_view> parts) noexcept;
PalResult failed(const Error& error) noexcept;

/// A handle: its content, and a count of the calls that use it at the moment. It is never freed, so
/// a call with a closed handle finds a closed handle and no freed memory. A free handle waits in a
/// list until at least kRest others were freed after it, so a handle that a host has kept by
/// mistake does not soon refer to something else. (Tests use an Atomic that lets other threads run
/// in between.)
template <class Content, template <class> class Atomic = std::atomic>
struct Handle {
  Atomic<int> users{0};
  Atomic<bool> open{false};
  std::shared_ptr<Content> content;
  Handle* next = nullptr;  ///< in the list of free handles

  static constexpr size_t kRest = 1024;

  static Handle* make(std::shared_ptr<Content> content) {
    Pool& pool = the_pool();
    const std::lock_guard lock(pool.mutex);
    // Allocated in blocks: single ones between the sessions' allocations would fragment the heap.
    if (pool.free <= kRest) {
      pool.blocks.push_back(std::make_unique<Handle[]>(2 * kRest));
      for (size_t i = 0; i < 2 * kRest; ++i) pool.put(&pool.blocks.back()[i]);
    }
    Handle* const handle = pool.take();
    handle->content = std::move(content);
    handle->open.store(true);
    return handle;
  }

  /// Waits for the calls that use the handle and returns its content; null if it was already
  /// closed.
  std::shared_ptr<Content> close() {
    if (!open.exchange(false)) return nullptr;
    while (users.load() != 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    std::shared_ptr<Content> last = std::move(content);
    const std::lock_guard lock(the_pool().mutex);
    the_pool().put(this);
    return last;
  }

 private:
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<Handle[]>> blocks;
    Handle *first = nullptr, *last = nullptr;  ///< list of free handles, the longest free first
    size_t free = 0;

    void put(Handle* handle) {
      handle->next = nullptr;
      (free > 0 ? last->next : first) = handle;
      last = handle;
      ++free;
    }
    Handle* take() {
      Handle* const handle = first;
      first = handle->next;
      --free;
      return handle;
    }
  };
  static Pool& the_pool() {
    static Pool pool;
    return pool;
  }
};

/// A call that uses a handle; it can not be closed meanwhile. Wait-free.
template <class Content, template <class> class Atomic>
class Use {
 public:
  explicit Use(Handle<Content, Atomic>* handle) noexcept : handle_(handle) {
    if (!handle_) return;
    handle_->users.fetch_add(1);
    open_ = handle_->open.load();
  }
  ~Use() {
    if (handle_) handle_->users.fetch_sub(1);
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

  explicit operator bool() const noexcept { return open_; }
  Content* operator->() const noexcept { return handle_->content.get(); }
  Content& operator*() const noexcept { return *handle_->content; }
  std::shared_ptr<Content> shared() const { return handle_->content; }

 private:
  Handle<Content, Atomic>* handle_;
  bool open_ = false;
};

/// The handle in a host's variable. Any thread.
template <class Named>
Named* seen_in(Named** variable) noexcept {
  return std::atomic_ref<Named*>(*variable).load();
}

/// Takes the handle out of a host's variable: of several threads one gets it, the others get NULL.
template <class Named>
Named* taken_out_of(Named** variable) noexcept {
  return variable ? std::atomic_ref<Named*>(*variable).exchange(nullptr) : nullptr;
}

/// Closes the handle: waits for the calls that use it and returns its content; null if there was
/// none, or if another thread was first.
template <class Content>
std::shared_ptr<Content> closed(Handle<Content>* handle) {
  return handle ? handle->close() : nullptr;
}

/// The result of a call with a null or closed handle.
PalResult refused_handle(const char* what) noexcept;

/// The structure that a program has given, in this library's version: fields that an older program
/// does not know are 0. Errors: PAL_BAD_INPUT for NULL; PAL_BAD_VERSION for a size below `least` or
/// above this library's.
template <class Info>
PalResult taken(const Info* info, size_t least, const char* name, Info& result) noexcept {
  if (!info) return failed(PAL_BAD_INPUT, {name, " is missing"});
  if (info->size > sizeof(Info))
    return failed(PAL_BAD_VERSION, {name,
                                    " is larger than this library knows: the program was compiled "
                                    "for a newer palpate"});
  if (info->size < least)
    return failed(PAL_BAD_VERSION,
                  {name, " does not say its size: set size to sizeof(", name, ")"});
  std::memset(&result, 0, sizeof(Info));
  std::memcpy(&result, info, info->size);
  return PAL_OK;
}

/// Runs a function of the C interface: an exception becomes a result and a sentence.
template <class Work>
PalResult guarded(const Work& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return failed(PAL_OUT_OF_MEMORY, {"There is not enough memory on this machine"});
  } catch (const std::exception& error) {
    return failed(PAL_INTERNAL, {error.what()});
  } catch (...) {
    return failed(PAL_INTERNAL, {"An unknown exception was thrown"});
  }
}

/// A sentence on an exception from a function of the host; empty if it returned.
class Thrown {
 public:
  Thrown() = default;
  Thrown(std::string_view function, std::string_view what) noexcept {
    size_t length = 0;
    for (const std::string_view part : {function, std::string_view(" threw an exception: "), what})
      length += part.copy(sentence_.data() + length, sentence_.size() - 1 - length);
  }
  explicit operator bool() const noexcept { return sentence_[0] != '\0'; }
  const char* sentence() const noexcept { return sentence_.data(); }

 private:
  std::array<char, 384> sentence_{};
};

/// Calls a function of the host. A host in C++ may throw, and the exception must reach neither our
/// threads nor C code in between. `name`: of the function, for the sentence. Takes no lock and
/// allocates nothing itself.
template <class Call>
Thrown call_host(std::string_view name, const Call& call) noexcept {
  try {
    call();
    return {};
  } catch (const std::exception& error) {
    return {name, error.what()};
  } catch (...) {
    return {name, "it has no message"};
  }
}

/// Errors: kBadInput, with a sentence, for an invalid grid.
Result<Grid> grid_of(const PalGrid& grid);

/// The grid as it is in files: the host's samples are in the same order.
void fill_grid(PalGrid& to, const Grid& from);

/// Converts a frame of the host to a volume. Errors: kBadInput for an unknown type, and for samples
/// that are not finite.
Result<Volume> volume_of(const Grid& grid, PalSampleType type, const void* samples);

struct ContextContent {
  std::shared_ptr<vulkan::Context> device;  ///< null: there is none
  std::string device_name;
  void (*log)(void* user, const char* sentence) = nullptr;
  void* user = nullptr;

  /// Writes to the host's log. An exception from the log itself is dropped: there is nowhere to
  /// report it.
  void say(const char* sentence) const noexcept {
    if (log) call_host("log", [&] { log(user, sentence); });
  }
};

/// The source of the frames of a live scene.
struct LiveOrigin {
  Volume first;            ///< the first one
  bool is_server = false;  ///< an OpenIGTLink server sends them; else the host pushes them
};

struct SceneContent {
  std::shared_ptr<ContextContent> context;
  LoadedScene scene;
  std::optional<LiveOrigin> live;
  running::SessionRequest request;  ///< its options; a session's come on top
};

class SessionContent;
class ViewContent;

/// Conversions of the handles that palpate.h only declares.
inline Handle<ContextContent>* of(PalContext* handle) noexcept {
  return reinterpret_cast<Handle<ContextContent>*>(handle);
}
inline Handle<SceneContent>* of(PalScene* handle) noexcept {
  return reinterpret_cast<Handle<SceneContent>*>(handle);
}
inline Handle<SessionContent>* of(PalSession* handle) noexcept {
  return reinterpret_cast<Handle<SessionContent>*>(handle);
}
inline Handle<ViewContent>* of(PalView* handle) noexcept {
  return reinterpret_cast<Handle<ViewContent>*>(handle);
}
template <class Named>
auto* of(const Named* handle) noexcept {
  return of(const_cast<Named*>(handle));
}

/// A transform as three rows of four.
void rows_of(const Transform& transform, double rows[12]);

}  // namespace palpate::toolkit
