// A Vulkan device, the host's or the library's own, is lost while a program uses it through the C
// library. Oracle: the specification of VK_ERROR_DEVICE_LOST (chapter "Lost Device"). The functions
// below replace the Vulkan loader's: from a chosen call on they return what a lost device returns.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <unistd.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;

/// Simulates the loss of devices. Counts only the calls that may return VK_ERROR_DEVICE_LOST by the
/// specification.
class Loss {
 public:
  static constexpr int kNever = -1;

  /// Starts anew; the device is lost from call `at` on, counted from 0.
  void arm(int at) {
    const std::lock_guard lock(mutex_);
    at_ = at;
    calls_ = 0;
    lost_ = false;
  }
  /// Counts one more call. Returns whether the device is lost for it.
  bool strikes() {
    const std::lock_guard lock(mutex_);
    if (calls_++ == at_) lost_ = true;
    return lost_;
  }
  int calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }
  bool lost() const {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

 private:
  mutable std::mutex mutex_;
  int at_ = kNever, calls_ = 0;
  bool lost_ = false;
} loss;

template <class Function>
Function loaders(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace palpate::test

using palpate::test::loaders;
using palpate::test::loss;

// A lost device must have finished its work before it returns the error: it writes to no memory
// later.
extern "C" {

VKAPI_ATTR VkResult VKAPI_CALL vkQueueSubmit(VkQueue queue, uint32_t count,
                                             const VkSubmitInfo* submits, VkFence fence) {
  static const auto submit = loaders<PFN_vkQueueSubmit>("vkQueueSubmit");
  static const auto idle = loaders<PFN_vkQueueWaitIdle>("vkQueueWaitIdle");
  if (!loss.strikes()) return submit(queue, count, submits, fence);
  idle(queue);
  return VK_ERROR_DEVICE_LOST;
}

VKAPI_ATTR VkResult VKAPI_CALL vkWaitForFences(VkDevice device, uint32_t count,
                                               const VkFence* fences, VkBool32 all,
                                               uint64_t timeout) {
  static const auto wait = loaders<PFN_vkWaitForFences>("vkWaitForFences");
  static const auto idle = loaders<PFN_vkDeviceWaitIdle>("vkDeviceWaitIdle");
  if (!loss.strikes()) return wait(device, count, fences, all, timeout);
  idle(device);
  return VK_ERROR_DEVICE_LOST;
}

VKAPI_ATTR VkResult VKAPI_CALL vkDeviceWaitIdle(VkDevice device) {
  static const auto idle = loaders<PFN_vkDeviceWaitIdle>("vkDeviceWaitIdle");
  const VkResult done = idle(device);
  return loss.strikes() ? VK_ERROR_DEVICE_LOST : done;
}

VKAPI_ATTR VkResult VKAPI_CALL vkGetQueryPoolResults(VkDevice device, VkQueryPool pool,
                                                     uint32_t first, uint32_t count, size_t bytes,
                                                     void* data, VkDeviceSize stride,
                                                     VkQueryResultFlags flags) {
  static const auto read = loaders<PFN_vkGetQueryPoolResults>("vkGetQueryPoolResults");
  if (loss.strikes()) return VK_ERROR_DEVICE_LOST;
  return read(device, pool, first, count, bytes, data, stride, flags);
}

VKAPI_ATTR VkResult VKAPI_CALL vkCreateDevice(VkPhysicalDevice physical,
                                              const VkDeviceCreateInfo* info,
                                              const VkAllocationCallbacks* allocator,
                                              VkDevice* device) {
  static const auto create = loaders<PFN_vkCreateDevice>("vkCreateDevice");
  return loss.strikes() ? VK_ERROR_DEVICE_LOST : create(physical, info, allocator, device);
}

}  // extern "C"

namespace palpate::test {
namespace {

/// The host's instance, device and queue; null if the library makes its own.
struct HostVulkan {
  VkInstance instance = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  PalVulkan shared{};

  bool open() {
    VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo of_instance{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    of_instance.pApplicationInfo = &application;
    if (vkCreateInstance(&of_instance, nullptr, &instance) != VK_SUCCESS) return false;
    uint32_t count = 1;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    vkEnumeratePhysicalDevices(instance, &count, &physical);
    if (count == 0) return false;
    uint32_t families = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &families, nullptr);
    std::vector<VkQueueFamilyProperties> properties(families);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &families, properties.data());
    VkPhysicalDeviceFeatures features{};
    features.shaderStorageImageWriteWithoutFormat = VK_TRUE;
    const float priority = 1.0F;
    VkDeviceQueueCreateInfo of_queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    while (of_queue.queueFamilyIndex < families &&
           !(properties[of_queue.queueFamilyIndex].queueFlags & VK_QUEUE_COMPUTE_BIT))
      ++of_queue.queueFamilyIndex;
    if (of_queue.queueFamilyIndex == families) return false;
    of_queue.queueCount = 1;
    of_queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo of_device{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    of_device.pEnabledFeatures = &features;
    of_device.queueCreateInfoCount = 1;
    of_device.pQueueCreateInfos = &of_queue;
    if (vkCreateDevice(physical, &of_device, nullptr, &device) != VK_SUCCESS) return false;
    VkQueue queue = VK_NULL_HANDLE;
    vkGetDeviceQueue(device, of_queue.queueFamilyIndex, 0, &queue);
    shared.size = sizeof shared;
    shared.instance = instance;
    shared.physical_device = physical;
    shared.device = device;
    shared.queue = queue;
    shared.queue_family = of_queue.queueFamilyIndex;
    return true;
  }
  ~HostVulkan() {
    if (device) vkDestroyDevice(device, nullptr);
    if (instance) vkDestroyInstance(instance, nullptr);
  }
};

/// Checks that a call succeeded or reported the loss of the device. Returns whether it succeeded.
bool works(PalResult result, const char* call) {
  if (result == PAL_OK) return true;
  EXPECT_TRUE(loss.lost()) << call << " fails on a device that is not lost: " << pal_last_error();
  EXPECT_EQ(result, PAL_DEVICE_FAILED) << call << ": " << pal_last_error();
  EXPECT_THAT(pal_last_error(), HasSubstr("lost")) << call;
  return false;
}
#define WORKS(call) works((call), #call)

/// The events of a session.
struct Heard {
  std::atomic<int> moves{0}, failed{0}, whole{0};
  std::mutex mutex;
  std::string failure;
  static void event(void* user, PalEventKind kind, const char* sentence) {
    auto* const self = static_cast<Heard*>(user);
    if (kind == PAL_EVENT_MOTION_FAILED) {
      const std::lock_guard lock(self->mutex);
      self->failure = sentence;
    }
    self->moves += kind == PAL_EVENT_MOVES;
    self->whole += kind == PAL_EVENT_WHOLE_MOTION;
    self->failed += kind == PAL_EVENT_MOTION_FAILED;
  }
  bool is_over() const { return failed > 0 || whole > 0; }
};

/// With the host's device, and with the library's own.
class DeviceLoss : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    loss.arm(Loss::kNever);
    PalContext* probe = new_context();
    if (!probe) GTEST_SKIP() << "There is no Vulkan device here.";
    pal_context_close(&probe);
  }
  void TearDown() override { loss.arm(Loss::kNever); }

  /// A context on a device that was never lost; null if there is none.
  PalContext* new_context() {
    PalContextInfo info = context_info(0);
    if (GetParam()) {
      hosts_.push_back(std::make_unique<HostVulkan>());
      if (!hosts_.back()->open()) return nullptr;
      info.vulkan = &hosts_.back()->shared;
    }
    PalContext* context = nullptr;
    pal_context_open(&info, &context);
    return context;
  }

  /// The motion of the ball's frames; empty if the device was lost.
  std::vector<float> estimated(PalContext* context, uint32_t flags) {
    PalEstimatorInfo info{};
    info.size = sizeof info;
    info.flags = flags;
    info.grid = ball_.info.grid;
    info.preset = "fast";
    PalEstimator* estimator = nullptr;
    if (!WORKS(pal_estimator_open(context, &info, &estimator))) {
      EXPECT_EQ(estimator, nullptr);
      return {};
    }
    for (const void* frame : ball_.pointers)
      if (!WORKS(pal_estimator_push(estimator, PAL_FLOAT32, frame, -1.0))) break;
    PalProgress progress{};
    progress.size = sizeof progress;
    PAL_EXPECT_OK(pal_estimator_poll(estimator, &progress));
    PalMotion* motion = nullptr;
    std::vector<float> field;
    if (WORKS(pal_estimator_finish(estimator, &motion))) {
      field.resize(3 * 32 * 32 * 32);
      PalFieldInfo wanted{};
      wanted.size = sizeof wanted;
      PAL_EXPECT_OK(pal_motion_field(motion, &wanted, field.data()));
    } else {
      EXPECT_EQ(motion, nullptr);
    }
    PAL_EXPECT_OK(pal_motion_close(&motion));
    PAL_EXPECT_OK(pal_estimator_close(&estimator));
    return field;
  }

  void open_scene(PalContext* context, PalScene** scene) {
    const char* path = "ball";
    PalSceneInfo info = scene_info(&path, 0, &ball_.info);
    PAL_ASSERT_OK(pal_scene_open(context, &info, scene));
  }

  /// Ends a session that the host ticks, while the hand presses: the force goes to zero in small
  /// steps.
  static void end(PalSession** session, HostHand& hand, double z_m) {
    PAL_EXPECT_OK(pal_session_stop(*session));
    const double pressed_n = hand.size();
    hand.worst_change_n = 0.0;
    int ticks = 0;
    while (!pal_session_at_rest(*session) && ++ticks < 2000) hand.at(z_m);
    EXPECT_LT(ticks, 2000);
    EXPECT_EQ(hand.size(), 0.0);
    // A straight ramp of 20 ms, from the force at the phase at which the motion was stopped.
    EXPECT_LE(hand.worst_change_n, pressed_n / 20.0 + 1e-3);
    PAL_EXPECT_OK(pal_session_close(session));
  }

  const BallFrames ball_{3};
  std::vector<std::unique_ptr<HostVulkan>> hosts_;
};

/// The calls at which to lose the device: every call if there are few, else the first ones and some
/// of the others.
std::vector<int> places(int calls) {
  std::vector<int> chosen;
  for (int at = 0; at < calls; at += at < 6 ? 1 : std::max(1, calls / 12)) chosen.push_back(at);
  chosen.push_back(calls - 1);
  return chosen;
}

TEST_P(DeviceLoss, EndsAnEstimationWithASentence) {
  for (const uint32_t flags : {uint32_t(PAL_ESTIMATOR_PAIRWISE), 0U}) {
    PalContext* context = new_context();
    loss.arm(Loss::kNever);
    const std::vector<float> sound = estimated(context, flags);
    ASSERT_FALSE(sound.empty());
    const int calls = loss.calls();
    PAL_EXPECT_OK(pal_context_close(&context));
    ASSERT_GT(calls, 20);
    for (const int at : places(calls)) {
      SCOPED_TRACE("lost at call " + std::to_string(at) + " of " + std::to_string(calls));
      loss.arm(Loss::kNever);
      context = new_context();
      loss.arm(at);
      EXPECT_TRUE(estimated(context, flags).empty());
      EXPECT_TRUE(loss.lost());
      // It stays lost for all later calls.
      EXPECT_TRUE(estimated(context, flags).empty());
      PAL_EXPECT_OK(pal_context_close(&context));
    }
    // A new device gives the same result as the first one.
    loss.arm(Loss::kNever);
    context = new_context();
    EXPECT_EQ(estimated(context, flags), sound);
    PAL_EXPECT_OK(pal_context_close(&context));
  }
}

TEST_P(DeviceLoss, LeavesASessionItsForces) {
  const PalDeviceInfo device = host_device();
  int calls = 0;
  // The first round loses no device and counts the calls.
  std::vector<int> rounds{Loss::kNever};
  for (size_t round = 0; round < rounds.size(); ++round) {
    SCOPED_TRACE("lost at call " + std::to_string(rounds[round]) + " of " + std::to_string(calls));
    loss.arm(Loss::kNever);
    Opened opened;
    opened.context = new_context();
    open_scene(opened.context, &opened.scene);
    Heard heard;
    PalSessionInfo info{};
    info.size = sizeof info;
    info.flags = PAL_SESSION_HOST_TICKS;
    info.host = &device;
    info.preset = "fast";
    info.on_event = &Heard::event;
    info.user = &heard;
    loss.arm(rounds[round]);
    PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
    HostHand hand{opened.session};
    const double z_m = hand.press(0.5);
    EXPECT_GT(z_m, 0.0);
    for (int k = 0; k < 60'000 && !heard.is_over(); ++k) {
      hand.at(z_m);
      ::usleep(1000);
    }
    ASSERT_TRUE(heard.is_over());
    EXPECT_EQ(heard.failed, loss.lost() ? 1 : 0) << heard.failure;
    EXPECT_EQ(heard.whole, loss.lost() ? 0 : 1);
    if (loss.lost()) {
      EXPECT_THAT(heard.failure, HasSubstr("lost"));
    }
    // The haptic loop goes on, without a jump of the force.
    for (int k = 0; k < 500; ++k) hand.at(z_m);
    EXPECT_GT(hand.size(), 0.1);
    EXPECT_LT(hand.worst_change_n, 0.25);
    PalState state{};
    state.size = sizeof state;
    PAL_EXPECT_OK(pal_session_state(opened.session, &state));
    EXPECT_EQ(state.can_play, 1U) << "a caller that waits for the motion must not wait for ever";
    end(&opened.session, hand, z_m);
    if (round == 0) {
      calls = loss.calls();
      ASSERT_GT(calls, 20);
      rounds = places(calls);
      rounds.insert(rounds.begin(), Loss::kNever);
    }
  }
}

TEST_P(DeviceLoss, EndsPicturesWithASentence) {
  const PalDeviceInfo device = host_device();
  const PalEye eye{{0.0, 0.0, 0.3}, {0.0, 0.0, 0.0, 1.0}, -0.3, 0.3, -0.25, 0.25};
  int calls = 0;
  std::vector<int> rounds{Loss::kNever};
  for (size_t round = 0; round < rounds.size(); ++round) {
    SCOPED_TRACE("lost at call " + std::to_string(rounds[round]) + " of " + std::to_string(calls));
    loss.arm(Loss::kNever);
    Opened opened;
    opened.context = new_context();
    open_scene(opened.context, &opened.scene);
    PalSessionInfo info{};
    info.size = sizeof info;
    info.flags = PAL_SESSION_HOST_TICKS | PAL_SESSION_NO_ESTIMATION;
    info.host = &device;
    PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
    HostHand hand{opened.session};
    const double z_m = hand.press(0.5);
    PalViewInfo of_view{};
    of_view.size = sizeof of_view;
    of_view.width = 64;
    of_view.height = 48;
    of_view.eye_count = 1;
    loss.arm(rounds[round]);
    std::vector<uint32_t> pixels(64 * 48);
    if (WORKS(pal_view_open(opened.session, &of_view, &opened.view)))
      for (int picture = 0; picture < 3; ++picture) {
        const bool started = WORKS(pal_view_render(opened.view, &eye, 1, 64, 48, 0.0, nullptr));
        WORKS(pal_view_wait(opened.view));
        const PalResult read = pal_view_read(opened.view, 0, pixels.data(), nullptr);
        // Before the first picture there is nothing to read.
        if (started || read != PAL_BAD_INPUT) works(read, "pal_view_read");
        hand.at(z_m);
      }
    if (round == 0) {
      EXPECT_GT(pixels[24 * 64 + 32] >> 24, 200U);
      calls = loss.calls();
      ASSERT_GT(calls, 8);
      for (int at = 0; at < calls; ++at) rounds.push_back(at);
    } else {
      EXPECT_TRUE(loss.lost());
      // On the lost device every further call fails, and none waits for ever.
      PalView* another = nullptr;
      EXPECT_EQ(pal_view_open(opened.session, &of_view, &another), PAL_DEVICE_FAILED);
      EXPECT_EQ(another, nullptr);
    }
    PAL_EXPECT_OK(pal_view_close(&opened.view));
    end(&opened.session, hand, z_m);
  }
}

/// A force device of the host's that stores the largest change of its force.
struct Gripped {
  std::atomic<double> z_m{0.03}, last_n{0.0}, worst_change_n{0.0};
  static void exchange(void* user, const double force_n[3], PalReading* reading) {
    auto* const self = static_cast<Gripped*>(user);
    self->worst_change_n =
        std::max(self->worst_change_n.load(), std::abs(force_n[2] - self->last_n.load()));
    self->last_n = force_n[2];
    reading->position_m[2] = self->z_m;
    reading->is_fresh = 1;
  }
};

TEST_P(DeviceLoss, LetsTheHapticThreadEndByARamp) {
  Opened opened;
  opened.context = new_context();
  open_scene(opened.context, &opened.scene);
  Gripped gripped;
  const PalDeviceInfo about = host_device();
  PalDevice device = device_of(about, &gripped, &Gripped::exchange);
  Heard heard;
  PalSessionInfo info{};
  info.size = sizeof info;
  info.flags = PAL_SESSION_NO_REAL_TIME;
  info.device = &device;
  // Long, because other tests run at the same time.
  info.watchdog_s = 0.2;
  info.preset = "fast";
  info.on_event = &Heard::event;
  info.user = &heard;
  loss.arm(5);
  PAL_ASSERT_OK(pal_session_open(opened.scene, &info, &opened.session));
  for (int k = 0; k < 60'000 && (gripped.last_n < 0.3 || !heard.is_over()); ++k) {
    gripped.z_m = std::max(0.018, 0.03 - 6e-6 * k);
    ::usleep(1000);
  }
  EXPECT_EQ(heard.failed, 1);
  EXPECT_GT(gripped.last_n, 0.3) << "the force goes on after the device was lost";
  PAL_EXPECT_OK(pal_session_close(&opened.session));
  EXPECT_EQ(gripped.last_n, 0.0);
  EXPECT_LT(gripped.worst_change_n, 0.25);
}

TEST_P(DeviceLoss, RefusesAContextOfItsOwnThatCanNotBeOpened) {
  if (GetParam()) GTEST_SKIP() << "The host opens its device itself.";
  loss.arm(0);
  const PalContextInfo info = context_info(0);
  PalContext* context = nullptr;
  EXPECT_EQ(pal_context_open(&info, &context), PAL_DEVICE_FAILED);
  EXPECT_THAT(pal_last_error(), HasSubstr("lost"));
  EXPECT_EQ(context, nullptr);
}

INSTANTIATE_TEST_SUITE_P(OfTheHost, DeviceLoss, ::testing::Values(true));
INSTANTIATE_TEST_SUITE_P(OfPalpate, DeviceLoss, ::testing::Values(false));

}  // namespace
}  // namespace palpate::test
