#pragma once

#include <vulkan/vulkan.h>
#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <unordered_map>

#include "tests/xr/runtime/control.h"
#include "tests/xr/runtime/remote.h"

/// The state of the runtime. One lock for everything: calls may come from several threads.
namespace palpate::test::fake {

enum class Kind {
  kInstance,
  kSession,
  kSpace,
  kSwapchain,
  kActionSet,
  kAction,
  kHandTracker,
  kRenderModel,
  kRenderModelAsset
};
const char* name(Kind kind);

/// Handles are numbers that are never reused, so that a stale one is detected.
struct Object {
  Kind kind{};
  uint64_t id = 0, parent = 0;
  virtual ~Object() = default;
};

struct Instance : Object {
  std::set<std::string> extensions;
  bool lost = false;
  bool asked_system = false;
  bool asked_requirements = false;
  VkPhysicalDevice device = VK_NULL_HANDLE;
  VkDevice made = VK_NULL_HANDLE;
  bool made_vulkan = false;
  /// By profile: action and part.
  std::map<XrPath, std::vector<std::pair<uint64_t, XrPath>>> suggested;
};

struct SwapchainImage {
  VkImage image = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
};

struct Session : Object {
  VkInstance vk_instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  uint32_t family = 0;
  /// Its place among the overlays; -1: it is not one.
  int64_t overlay = -1;
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  bool running = false, lost = false, exit_asked = false, ever_begun = false;
  XrViewConfigurationType views{};  ///< of the last xrBeginSession
  int waited = 0;                   ///< waits not yet begun
  bool begun = false;               ///< a frame is open
  XrTime open_time = 0, waited_time = 0;
  uint64_t frames = 0, frames_this_run = 0;
  std::vector<uint64_t> attached;
  bool synced = false;
  std::array<std::string, 2> profiles;               ///< as of the last sync
  std::map<std::string, float> input, input_before;  ///< at the last two syncs
};

struct Space : Object {
  bool reference = false;
  XrReferenceSpaceType type{};
  XrPosef offset{};
  uint64_t action = 0;
  int hand = -1;
  bool is_model = false;  ///< of that hand's controller
};

struct Swapchain : Object {
  XrSwapchainCreateInfo info{};
  std::vector<SwapchainImage> images;
  std::deque<uint32_t> acquired;
  bool waited = false;
  uint32_t next = 0;
  int last_released = -1;
};

struct ActionSet : Object {
  std::string name;
  bool attached = false;
};

struct HandTracker : Object {
  int hand = 0;
};

struct RenderModel : Object {
  int hand = 0;
};

struct RenderModelAsset : Object {};

struct Action : Object {
  std::string name;
  XrActionType type{};
  std::vector<XrPath> hands;
};

struct Fault {
  int nth = 1;
  XrResult result{};
  bool always = false;
};

struct SpaceChange {
  XrReferenceSpaceType type{};
  XrTime time = 0;
  XrPosef room_from_new{};
};

class World : public Control {
 public:
  World();

  // Control
  void reset() override;
  Setup& setup() override { return settings; }
  void inject(const std::string& function, int nth, XrResult result) override;
  void inject_always(const std::string& function, XrResult result) override;
  bool injected_all() const override;
  int calls(const std::string& function) const override;
  const std::map<std::string, int>& all_calls() const override { return counts; }
  std::vector<std::string> violations() const override { return wrong; }
  std::string alive() const override;
  void announce(XrSessionState state) override;
  void lose_instance() override;
  void lose_session() override;
  void change_rate(double hz) override;
  void change_models() override;
  void push_event(const XrEventDataBuffer& event) override { events.push_back(event); }
  XrSession session() const override;
  XrSessionState state() const override;
  int64_t overlay() const override;
  void recentre(XrReferenceSpaceType space, XrTime time, const XrPosef& pose,
                bool say_pose) override;
  void script_head(PoseScript room_from_head) override { head = std::move(room_from_head); }
  void script_hand(int hand, PoseScript script) override { hands[hand] = std::move(script); }
  void script_fingers(int hand, FingerScript script) override { fingers[hand] = std::move(script); }
  void set_input(const std::string& path, float value) override { inputs[path] = value; }
  XrPosef room_from(XrReferenceSpaceType space, XrTime time) const override;
  XrTime now() const override { return time; }
  int64_t monotonic_of(XrTime at) const override { return at + (real_time ? 0 : kClockOffset); }
  uint64_t frames() const override { return ended_frames; }
  Ended last_frame() const override { return ended; }
  std::vector<Quad> quads() const override { return hanging; }
  std::vector<Picture> pictures() const override { return shown; }
  std::vector<Haptic> haptics() const override { return vibrations; }
  int stops() const override { return vibration_stops; }

  // The rest of the runtime
  static constexpr XrTime kStart = 1'000'000'000;
  static constexpr int64_t kClockOffset = 123'456'789'012;  ///< CLOCK_MONOTONIC less XrTime, ns

  /// Waits as a display does, and uses the monotonic clock: for unmodified programs.
  /// PALPATE_FAKE_XR_REAL_TIME.
  bool real_time = false;
  Remote remote;
  /// Advances by a period of the virtual or the real clock.
  void next_frame();
  /// As from a menu of the runtime's own.
  void exit_by_person();
  /// Those of the setup whose extension, if they need one, is enabled.
  std::vector<XrReferenceSpaceType> spaces() const;
  /// Whether the second pair of views can.
  bool follows_gaze() const;
  /// Preferred ones first: four views only where their extension is enabled.
  std::vector<XrViewConfigurationType> view_types() const;
  /// Whether an instance has enabled this extension.
  bool enabled(const std::string& extension) const;
  /// The interaction profile of a hand now: that of its controller; without one, while the headset
  /// sees it, that of bare hands, where XR_EXT_hand_interaction is enabled; or none.
  std::string profile_of(int side) const;
  XrTime period() const { return XrTime(1e9 / settings.rate_hz + 0.5); }
  /// Records an error of the caller and returns `result`.
  XrResult violation(const std::string& what, XrResult result = XR_ERROR_VALIDATION_FAILURE);
  template <class T>
  T* find(Kind kind, uint64_t id) {
    const auto at = objects.find(id);
    if (at == objects.end() || at->second->kind != kind) return nullptr;
    return static_cast<T*>(at->second.get());
  }
  template <class T>
  T& add(Kind kind, uint64_t parent) {
    auto made = std::make_unique<T>();
    made->kind = kind;
    made->id = next_id++;
    made->parent = parent;
    T& kept = *made;
    objects[kept.id] = std::move(made);
    return kept;
  }
  /// Removes it with everything below it.
  void remove(uint64_t id);
  void set_state(Session& session, XrSessionState state);
  Session* newest_session();
  void write_report() const;

  std::recursive_mutex mutex;
  Setup settings;
  std::unordered_map<uint64_t, std::unique_ptr<Object>> objects;
  uint64_t next_id = 0x1000;
  std::map<std::string, int> counts;
  /// Into counts, by the literal's address: fast.
  std::unordered_map<const char*, int*> counters;
  std::map<std::string, std::vector<Fault>> faults;
  std::vector<std::string> wrong;
  std::deque<XrEventDataBuffer> events;
  std::vector<std::string> paths;                        ///< path i + 1
  std::unordered_map<std::string, XrPath> path_numbers;  ///< and back
  /// has_part() by numbers: called often.
  std::map<std::pair<XrPath, XrPath>, bool> parts;
  XrTime time = kStart;
  std::vector<SpaceChange> changes;
  PoseScript head;
  PoseScript hands[2];
  FingerScript fingers[2];
  std::map<std::string, float> inputs;
  std::multiset<std::string> taps;  ///< each pressed for one sync, and let go for the next one
  uint64_t ended_frames = 0;
  Ended ended;
  std::vector<Quad> hanging;
  std::vector<Picture> shown;
  std::vector<Haptic> vibrations;
  int vibration_stops = 0;
};

World& world();

template <class Handle>
uint64_t id_of(Handle handle) {
  return reinterpret_cast<uint64_t>(handle);
}
template <class Handle>
Handle handle_of(uint64_t id) {
  return reinterpret_cast<Handle>(id);
}

/// The beginning of every call: takes the lock, counts, and injects the fault.
class Call {
 public:
  explicit Call(const char* function);
  /// With the object of the call: returns an error for unknown or lost ones.
  Call(const char* function, XrInstance instance);
  Call(const char* function, XrSession session);

  bool answered() const { return answer_.has_value(); }
  XrResult answer() const { return *answer_; }
  Instance* instance = nullptr;
  Session* session = nullptr;

 private:
  void check_instance(uint64_t id, const char* function);
  std::unique_lock<std::recursive_mutex> lock_;
  std::optional<XrResult> answer_;
};

/// The two-call idiom: first the number, then the values.
template <class From, class To, class Copy>
XrResult enumerate(const std::vector<From>& from, uint32_t capacity, uint32_t* count, To* to,
                   Copy copy) {
  *count = uint32_t(from.size());
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < from.size()) return XR_ERROR_SIZE_INSUFFICIENT;
  for (size_t i = 0; i < from.size(); ++i) copy(from[i], to[i]);
  return XR_SUCCESS;
}

XrResult copy_text(const std::string& text, uint32_t capacity, uint32_t* count, char* to);

// Poses, in double inside.
XrPosef identity();
XrPosef compose(const XrPosef& a, const XrPosef& b);
XrPosef inverted(const XrPosef& pose);
bool unit(const XrQuaternionf& q);

// vulkan_images.cpp
VkResult make_image(Session& session, const XrSwapchainCreateInfo& info, SwapchainImage& made);
void destroy_image(Session& session, SwapchainImage& image);
/// Reads one layer of a released image back.
bool read_back(Session& session, const Swapchain& chain, uint32_t layer, const XrRect2Di& rect,
               std::vector<uint32_t>& words);

double linear_of_srgb(double value);
/// The words of an image as a compositor reads them: formats other than _SRGB are linear (OpenXR
/// 1.0, XrSwapchain).
std::vector<std::array<float, 4>> light_of(VkFormat format, const std::vector<uint32_t>& words);

/// The parts of what this hand (XR_NULL_PATH: any) holds, or is, that the action is bound to.
std::vector<std::string> bound_parts(const Action& action, XrPath hand);

/// The function for xrGetInstanceProcAddr; null if unknown.
PFN_xrVoidFunction function_named(const std::string& name);

}  // namespace palpate::test::fake
