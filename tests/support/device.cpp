#include "tests/support/device.h"

namespace palpate::test {
namespace {

/// Owns the device. It is closed before the program's static objects, those of the driver included,
/// are destroyed.
class OneDevice : public ::testing::Environment {
 public:
  const Device& get() {
    if (!opened_) open();
    return device_;
  }
  void TearDown() override { device_ = {}; }

 private:
  void open() {
    opened_ = true;
    vulkan::ContextOptions options;
    options.validation = true;
    Result<std::shared_ptr<vulkan::Context>> context = vulkan::Context::open(options);
    if (!context) {
      device_.why_not = context.error().message;
      return;
    }
    device_.context = *context;
    device_.kernels =
        std::make_shared<MotionKernels>(device_.context, MotionKernels::Texels::kFetched);
  }

  Device device_;
  bool opened_ = false;
};

OneDevice& environment() {
  static auto* one = static_cast<OneDevice*>(::testing::AddGlobalTestEnvironment(new OneDevice));
  return *one;
}

// Registered before RUN_ALL_TESTS(), as GoogleTest requires.
[[maybe_unused]] const OneDevice& registered = environment();

}  // namespace

const Device& device() {
  return environment().get();
}

void DeviceTest::SetUp() {
  if (!context()) GTEST_SKIP() << "no device: " << device().why_not;
  messages_before_ = context()->validation_messages().size();
}

void DeviceTest::TearDown() {
  if (!context()) return;
  EXPECT_TRUE(context()->validation_active())
      << "the Khronos validation layer is missing (Debian: vulkan-validationlayers)";
  std::vector<std::string> messages = context()->validation_messages();
  // Removes only the messages of this test, so that the next tests do not fail because of them.
  messages.erase(messages.begin(), messages.begin() + std::ptrdiff_t(messages_before_));
  EXPECT_TRUE(messages.empty()) << messages.size()
                                << " validation messages, the first: " << messages.front();
}

}  // namespace palpate::test
