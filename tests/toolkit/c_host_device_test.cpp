// A Vulkan device that the host made and continues to use.
#include <gmock/gmock.h>
#include <vulkan/vulkan.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/toolkit/c_library.h"

namespace palpate::test {
namespace {

using ::testing::HasSubstr;

/// Counts how often the queue is locked, and detects a second lock while it is locked.
struct QueueLock {
  std::atomic<int> locked{0}, times{0};
  std::atomic<bool> wrong{false};
  static void lock(void* user) {
    auto* const self = static_cast<QueueLock*>(user);
    if (++self->locked != 1) self->wrong = true;
    ++self->times;
  }
  static void unlock(void* user) {
    auto* const self = static_cast<QueueLock*>(user);
    if (--self->locked != 0) self->wrong = true;
  }
};

class HostDevice : public ::testing::Test {
 protected:
  void SetUp() override {
    VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    create.pApplicationInfo = &application;
    if (vkCreateInstance(&create, nullptr, &instance_) != VK_SUCCESS)
      GTEST_SKIP() << "There is no Vulkan driver here.";
    uint32_t count = 1;
    vkEnumeratePhysicalDevices(instance_, &count, &physical_);
    if (count == 0) GTEST_SKIP() << "There is no Vulkan device here.";
    uint32_t families = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &families, nullptr);
    std::vector<VkQueueFamilyProperties> properties(families);
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &families, properties.data());
    while (family_ < families && !(properties[family_].queueFlags & VK_QUEUE_COMPUTE_BIT))
      ++family_;
    if (family_ == families) GTEST_SKIP() << "This device has no compute queue.";
  }
  void TearDown() override {
    if (device_) vkDestroyDevice(device_, nullptr);
    if (instance_) vkDestroyInstance(instance_, nullptr);
  }
  void make_device() {
    VkPhysicalDeviceFeatures features{};
    features.shaderStorageImageWriteWithoutFormat = VK_TRUE;
    const float priority = 1.0F;
    VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue.queueFamilyIndex = family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo create{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    create.pEnabledFeatures = &features;
    create.queueCreateInfoCount = 1;
    create.pQueueCreateInfos = &queue;
    ASSERT_EQ(vkCreateDevice(physical_, &create, nullptr, &device_), VK_SUCCESS);
    vkGetDeviceQueue(device_, family_, 0, &queue_);
  }
  PalVulkan vulkan() {
    PalVulkan vulkan{};
    vulkan.size = sizeof vulkan;
    vulkan.instance = instance_;
    vulkan.physical_device = physical_;
    vulkan.device = device_;
    vulkan.queue = queue_;
    vulkan.queue_family = family_;
    vulkan.lock_queue = &QueueLock::lock;
    vulkan.unlock_queue = &QueueLock::unlock;
    vulkan.user = &lock_;
    return vulkan;
  }

  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  uint32_t family_ = 0;
  QueueLock lock_;
};

TEST_F(HostDevice, FindsMotionAndDrawsWithItsQueueLocked) {
  make_device();
  Opened opened;
  PalVulkan shared = vulkan();
  PalContextInfo info = context_info(0);
  info.vulkan = &shared;
  PAL_ASSERT_OK(pal_context_open(&info, &opened.context));
  EXPECT_STRNE(pal_context_device(opened.context), "");

  const BallFrames ball(2);
  PalEstimatorInfo estimation{};
  estimation.size = sizeof estimation;
  estimation.grid = ball.info.grid;
  estimation.preset = "fast";
  PalEstimator* estimator = nullptr;
  PalMotion* motion = nullptr;
  PAL_ASSERT_OK(pal_estimator_open(opened.context, &estimation, &estimator));
  for (const void* frame : ball.pointers)
    PAL_ASSERT_OK(pal_estimator_push(estimator, PAL_FLOAT32, frame, -1.0));
  PAL_ASSERT_OK(pal_estimator_finish(estimator, &motion));
  const int after_motion = lock_.times;
  EXPECT_GT(after_motion, 0);
  pal_motion_close(&motion);
  pal_estimator_close(&estimator);

  const char* path = "shell";
  PalSceneInfo scene{};
  scene.size = sizeof scene;
  scene.paths = &path;
  scene.path_count = 1;
  PAL_ASSERT_OK(pal_scene_open(opened.context, &scene, &opened.scene));
  const PalDeviceInfo device = host_device();
  PalSessionInfo session{};
  session.size = sizeof session;
  session.flags = PAL_SESSION_HOST_TICKS;
  session.host = &device;
  PAL_ASSERT_OK(pal_session_open(opened.scene, &session, &opened.session));
  PalViewInfo view{};
  view.size = sizeof view;
  view.flags = PAL_VIEW_NO_HAND | PAL_VIEW_NO_BOX;
  view.width = 64;
  view.height = 48;
  view.eye_count = 1;
  PAL_ASSERT_OK(pal_view_open(opened.session, &view, &opened.view));
  const PalEye eye{{0.0, 0.0, 0.3}, {0.0, 0.0, 0.0, 1.0}, -0.3, 0.3, -0.25, 0.25};
  EXPECT_EQ(pal_view_render(opened.view, &eye, 1, 64, 48, 0.0, nullptr), PAL_NOT_YET);
  HostHand hand{opened.session};
  hand.at(0.08);
  PAL_ASSERT_OK(pal_view_render(opened.view, &eye, 1, 64, 48, 0.0, nullptr));
  std::vector<uint32_t> pixels(64 * 48);
  std::vector<float> depth_m(64 * 48);
  PAL_ASSERT_OK(pal_view_read(opened.view, 0, pixels.data(), depth_m.data()));
  // In the middle the shell, whose nearest part is 25 to 30 mm towards the eye; nothing in the
  // corners.
  EXPECT_EQ(pixels[24 * 64 + 32] >> 24, 255U);
  EXPECT_NEAR(depth_m[24 * 64 + 32], 0.27, 0.02);
  EXPECT_EQ(depth_m[0], 0.0F);
  EXPECT_GT(lock_.times, after_motion);
  EXPECT_EQ(lock_.locked, 0);
  EXPECT_FALSE(lock_.wrong);
  PalEye wrong = eye;
  wrong.orientation[3] = 0.0;
  EXPECT_EQ(pal_view_render(opened.view, &wrong, 1, 64, 48, 0.0, nullptr), PAL_BAD_INPUT);
  EXPECT_EQ(pal_view_render(opened.view, &eye, 1, 640, 48, 0.0, nullptr), PAL_BAD_INPUT);
  EXPECT_EQ(pal_view_read(opened.view, 1, pixels.data(), nullptr), PAL_BAD_INPUT);
  // The images of an older program are accepted; these have no format, which is an error. A size of
  // zero is an error too.
  PalImages images{};
  images.size = offsetof(PalImages, inverse_depth_0);
  EXPECT_EQ(pal_view_render(opened.view, &eye, 1, 64, 48, 0.0, &images), PAL_BAD_INPUT);
  images.size = 4;
  EXPECT_EQ(pal_view_render(opened.view, &eye, 1, 64, 48, 0.0, &images), PAL_BAD_VERSION);
}

TEST_F(HostDevice, WhoseLockThrowsFailsInASentence) {
  make_device();
  static std::atomic<bool> lock_throws, unlock_throws;
  static std::atomic<int> said, submitted;
  lock_throws = unlock_throws = false;
  said = submitted = 0;
  Opened opened;
  PalVulkan shared = vulkan();
  shared.lock_queue = [](void*) {
    if (lock_throws) throw std::runtime_error("the lock is gone");
    ++submitted;
  };
  shared.unlock_queue = [](void*) {
    if (unlock_throws) throw std::runtime_error("it was not locked");
  };
  PalContextInfo info = context_info(0);
  info.vulkan = &shared;
  info.log = [](void*, const char* sentence) {
    if (std::string(sentence) == "unlock_queue threw an exception: it was not locked") ++said;
  };
  PAL_ASSERT_OK(pal_context_open(&info, &opened.context));
  const BallFrames ball(2);
  PalEstimatorInfo estimation{};
  estimation.size = sizeof estimation;
  estimation.grid = ball.info.grid;
  estimation.preset = "fast";
  estimation.flags = PAL_ESTIMATOR_NO_VERDICT;
  const auto found = [&](std::string& why) {
    PalEstimator* estimator = nullptr;
    PalMotion* motion = nullptr;
    PalResult result = pal_estimator_open(opened.context, &estimation, &estimator);
    for (const void* frame : ball.pointers)
      if (result == PAL_OK) result = pal_estimator_push(estimator, PAL_FLOAT32, frame, -1.0);
    if (result == PAL_OK) result = pal_estimator_finish(estimator, &motion);
    why = pal_last_error();
    pal_motion_close(&motion);
    pal_estimator_close(&estimator);
    return result;
  };
  std::string why;
  unlock_throws = true;
  EXPECT_EQ(found(why), PAL_OK) << why;
  EXPECT_GT(said, 0);
  unlock_throws = false;
  lock_throws = true;
  submitted = 0;
  EXPECT_EQ(found(why), PAL_DEVICE_FAILED);
  EXPECT_NE(why.find("lock_queue threw an exception: the lock is gone"), std::string::npos) << why;
  EXPECT_EQ(submitted, 0);
  lock_throws = false;
  EXPECT_EQ(found(why), PAL_OK) << why;
}

TEST_F(HostDevice, IsLeftAsItWas) {
  make_device();
  for (int round = 0; round < 3; ++round) {
    PalVulkan shared = vulkan();
    PalContextInfo info = context_info(0);
    info.vulkan = &shared;
    PalContext* context = nullptr;
    PAL_ASSERT_OK(pal_context_open(&info, &context));
    PAL_ASSERT_OK(pal_context_close(&context));
    EXPECT_EQ(vkQueueWaitIdle(queue_), VK_SUCCESS);
  }
}

TEST_F(HostDevice, ThatIsIncompleteIsRefused) {
  make_device();
  const auto refusal = [&](PalVulkan shared) {
    PalContextInfo info = context_info(0);
    info.vulkan = &shared;
    PalContext* never = nullptr;
    EXPECT_LT(pal_context_open(&info, &never), PAL_OK);
    EXPECT_EQ(never, nullptr);
    return std::string(pal_last_error());
  };
  PalVulkan wrong = vulkan();
  wrong.queue = nullptr;
  EXPECT_THAT(refusal(wrong), HasSubstr("a queue"));
  wrong = vulkan();
  wrong.unlock_queue = nullptr;
  EXPECT_THAT(refusal(wrong), HasSubstr("unlock"));
  wrong = vulkan();
  wrong.size = 3;
  EXPECT_THAT(refusal(wrong), HasSubstr("PalVulkan"));
}

/// The same with Chromium's SwiftShader instead of this machine's driver, in a process of its own.
TEST(HostDeviceOfSwiftShader, DoesTheSame) {
  const std::string manifest = "/usr/lib/chromium/vk_swiftshader_icd.json";
  if (!std::filesystem::exists(manifest))
    GTEST_SKIP() << "SwiftShader is not here (Debian: chromium).";
  const std::string command = "VK_DRIVER_FILES=" + manifest + " VK_ICD_FILENAMES=" + manifest +
                              " " + std::filesystem::read_symlink("/proc/self/exe").string() +
                              " --gtest_filter='HostDevice.*' >/dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace palpate::test
