#include <thread>

#include "compute/vulkan/buffer.h"
#include "compute/vulkan/image.h"
#include "compute/vulkan/recorder.h"
#include "compute/vulkan/tried.h"
#include "tests/support/device.h"

namespace palpate::test {
namespace {

using vulkan::Buffer;
using vulkan::Context;
using vulkan::ContextOptions;
using vulkan::Failure;
using vulkan::GpuInfo;
using vulkan::list_devices;

class VulkanContext : public DeviceTest {};

std::shared_ptr<Context> open(const ContextOptions& options) {
  Result<std::shared_ptr<Context>> opened = Context::open(options);
  EXPECT_TRUE(opened) << opened.error().message;
  return opened ? *opened : nullptr;
}

TEST_F(VulkanContext, IsOneOfTheListedDevices) {
  const std::vector<GpuInfo> devices = list_devices();
  ASSERT_GT(devices.size(), size_t(context()->info().index));
  const GpuInfo& listed = devices[size_t(context()->info().index)];
  EXPECT_EQ(listed.name, context()->info().name);
  EXPECT_TRUE(listed.usable) << listed.missing;
  for (size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].index, int(i));
    EXPECT_FALSE(devices[i].name.empty());
    EXPECT_EQ(devices[i].usable, devices[i].missing.empty());
  }
}

TEST_F(VulkanContext, SaysWhatAPersonWantsToKnow) {
  const GpuInfo& info = context()->info();
  EXPECT_THAT(info.kind, ::testing::AnyOf("CPU", "discrete GPU", "integrated GPU", "virtual GPU"));
  EXPECT_EQ(context()->is_cpu(), info.kind == "CPU");
  // The minimum that Vulkan requires of every device, and a plausible amount of memory.
  EXPECT_GE(info.binding_bytes, uint64_t(1) << 27);
  EXPECT_GE(info.memory_bytes, uint64_t(1) << 28);
  EXPECT_LE(context()->memory_budget_bytes(), info.memory_bytes);
}

TEST_F(VulkanContext, OpensByIndexAndByPartOfTheNameInAnyCase) {
  const GpuInfo& info = context()->info();
  ContextOptions options;
  options.device = std::to_string(info.index);
  EXPECT_EQ(open(options)->info().name, info.name);
  options.device = info.name.substr(0, 4);
  for (char& c : options.device) c = char(std::toupper(static_cast<unsigned char>(c)));
  EXPECT_EQ(open(options)->info().name.substr(0, 4), info.name.substr(0, 4));
}

TEST_F(VulkanContext, NamesWhatThereIsWhenTheWantedDeviceIsNotThere) {
  ContextOptions options;
  options.device = "no such device";
  const Result<std::shared_ptr<Context>> opened = Context::open(options);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().kind, ErrorKind::kNoDevice);
  EXPECT_THAT(opened.error().message, ::testing::HasSubstr("no such device"));
  EXPECT_THAT(opened.error().message, ::testing::HasSubstr(context()->info().name));
}

TEST_F(VulkanContext, CountsMemoryAndRemembersThePeak) {
  const std::shared_ptr<Context> own = open({});
  EXPECT_EQ(own->memory_used_bytes(), 0U);
  {
    const Buffer large(own, 1 << 20);
    const uint64_t with_one = own->memory_used_bytes();
    EXPECT_GE(with_one, 1U << 20);
    { const Buffer other(own, 1 << 19); }
    EXPECT_EQ(own->memory_used_bytes(), with_one);
    EXPECT_GE(own->memory_peak_bytes(), with_one + (1U << 19));
    own->reset_memory_peak();
    EXPECT_EQ(own->memory_peak_bytes(), with_one);
    // Host-visible memory does not count as the device's.
    const Buffer of_the_host(own, 1 << 19, Buffer::Kind::kHostVisible);
    EXPECT_EQ(own->memory_used_bytes(), with_one);
  }
  EXPECT_EQ(own->memory_used_bytes(), 0U);
}

TEST_F(VulkanContext, RefusesMoreMemoryThanItsCapAndLosesNothing) {
  ContextOptions options;
  options.memory_cap_bytes = 1 << 20;
  const std::shared_ptr<Context> capped = open(options);
  EXPECT_EQ(capped->memory_budget_bytes(), 1U << 20);
  const Buffer fits(capped, 1 << 19);
  const uint64_t used = capped->memory_used_bytes();
  for (const bool image : {false, true}) {
    try {
      if (image) {
        const vulkan::Image too_much(capped, {64, 64, 64}, VK_FORMAT_R32G32B32A32_SFLOAT);
      } else {
        const Buffer too_much(capped, 1 << 20);
      }
      ADD_FAILURE() << "the cap was ignored";
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.result(), VK_ERROR_OUT_OF_DEVICE_MEMORY);
      EXPECT_EQ(failure.error().kind, ErrorKind::kOutOfMemory);
      EXPECT_THAT(failure.error().message, ::testing::HasSubstr("with more memory"));
    }
  }
  EXPECT_EQ(capped->memory_used_bytes(), used);
  const Buffer still_fits(capped, 1 << 18);
}

TEST_F(VulkanContext, ThrowsWhenTheDriverHasNoSuchMemory) {
  const std::shared_ptr<Context> own = open({});
  EXPECT_THROW(Buffer(own, uint64_t(1) << 46), Failure);
  EXPECT_EQ(own->memory_used_bytes(), 0U);
}

TEST_F(VulkanContext, ServesSeveralThreadsThatAllocateAtOnce) {
  const std::shared_ptr<Context> own = open({});
  {
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&own] {
        for (int k = 1; k < 50; ++k) Buffer(own, uint64_t(k) * 4096);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  EXPECT_EQ(own->memory_used_bytes(), 0U);
  EXPECT_GT(own->memory_peak_bytes(), 0U);
}

TEST(VulkanFailure, SaysWhatWentWrongWhileDoingWhatAndWhatToDo) {
  const Failure lost(VK_ERROR_DEVICE_LOST, "waiting for the device");
  EXPECT_STREQ(lost.what(), "the device was lost while waiting for the device");
  EXPECT_EQ(lost.error().kind, ErrorKind::kDeviceFailed);
  EXPECT_THAT(lost.error().message, ::testing::HasSubstr("another Vulkan device"));
  EXPECT_EQ(Failure(VK_ERROR_OUT_OF_HOST_MEMORY, "x").error().kind, ErrorKind::kOutOfMemory);
  EXPECT_NO_THROW(vulkan::check(VK_SUCCESS, "nothing"));
  EXPECT_THROW(vulkan::check(VK_ERROR_INITIALIZATION_FAILED, "starting"), Failure);
}

TEST(VulkanFailure, EndsWhereItIsTried) {
  const auto fail = [] { vulkan::check(VK_ERROR_DEVICE_LOST, "drawing"); };
  const Status nothing = vulkan::tried([&] { fail(); });
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().kind, ErrorKind::kDeviceFailed);
  const Result<int> number = vulkan::tried([&] {
    fail();
    return 1;
  });
  EXPECT_FALSE(number);
  const Result<int> result = vulkan::tried([&]() -> Result<int> {
    fail();
    return 1;
  });
  EXPECT_FALSE(result);
  EXPECT_TRUE(vulkan::tried([] {}));
  EXPECT_EQ(*vulkan::tried([] { return 2; }), 2);
  const Result<int> refused = vulkan::tried([]() -> Result<int> {
    return Error{ErrorKind::kBadInput, "no"};
  });
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "no");
  EXPECT_THROW((void)vulkan::tried([] { throw std::bad_alloc(); }), std::bad_alloc);
}

TEST_F(VulkanContext, SubmitsNothingToAQueueThatCanNotBeLocked) {
  const std::shared_ptr<Context> own = open({});
  vulkan::SharedDevice shared;
  shared.instance = own->instance();
  shared.physical_device = own->physical_device();
  shared.device = own->device();
  shared.queue_family = own->queue_family();
  shared.queue = own->queue();
  bool locks = true;
  int locked = 0;
  shared.lock_queue = [&]() -> Status {
    if (!locks) return Error{ErrorKind::kDeviceFailed, "locking a queue that is gone"};
    ++locked;
    return Nothing{};
  };
  shared.unlock_queue = [&] { --locked; };
  const auto context = Context::share(shared);
  ASSERT_TRUE(context);
  const Buffer words(*context, 64);
  vulkan::Recorder recorder(*context, 1);
  recorder.fill(words, 1);
  EXPECT_TRUE(vulkan::tried([&] { recorder.run(); }));
  EXPECT_EQ(locked, 0);
  locks = false;
  const Status refused = vulkan::tried([&] { recorder.run(); });
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kDeviceFailed);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("locking a queue that is gone"));
  EXPECT_EQ(locked, 0);
}

}  // namespace
}  // namespace palpate::test
