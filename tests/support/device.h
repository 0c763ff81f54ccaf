#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "compute/motion/kernels.h"
#include "compute/vulkan/context.h"

namespace palpate::test {

/// One device with validation and one set of kernels for a whole test program, opened by the first
/// test that uses it. `context` is null if no device could be opened; `why_not` then gives the
/// reason.
struct Device {
  std::shared_ptr<vulkan::Context> context;
  std::shared_ptr<MotionKernels> kernels;  ///< for images of any format
  std::string why_not;
};
const Device& device();

/// A test that needs a device. It is skipped, with a message, where there is none. At its end the
/// validation layers, synchronisation validation included, must have been active without a message.
class DeviceTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  const std::shared_ptr<vulkan::Context>& context() const { return device().context; }
  const std::shared_ptr<MotionKernels>& kernels() const { return device().kernels; }

 private:
  size_t messages_before_ = 0;
};

}  // namespace palpate::test
