#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "module/xr/headset.h"
#include "tests/xr/gradient_source.h"
#include "tests/xr/runtime/control.h"

namespace palpate::test {

/// One runtime, reset before each test. After the test there must be no live handle, no wrong call,
/// and no message of the Vulkan validation layers.
class XrTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  fake::Control& runtime() { return fake::control(); }
  /// A headset with validation layers; valid until the test's end or the next call.
  xr::Headset& headset(xr::HeadsetOptions options = {});
  /// Steps until `wanted`, at most `steps` times; the virtual time is 11 ms per step.
  xr::HeadsetState step_until(xr::HeadsetState wanted, int steps = 50);
  const xr::Report& step();
  const xr::Report& headset_report() const { return headset_->report(); }
  std::shared_ptr<vulkan::Context> headset_context() const { return headset_->context(); }
  xr::Headset* headset_pointer() { return headset_.get(); }
  /// Advances the virtual time, for code that retries after seconds.
  void pass(double seconds) { now_ns_ += int64_t(seconds * 1e9); }
  void close();
  void expect_silence();

  GradientSource source;
  int64_t now_ns_ = 0;
  bool expect_violations_ = false;

 private:
  std::unique_ptr<xr::Headset> headset_;
};

}  // namespace palpate::test
