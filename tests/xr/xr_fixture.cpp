#include "tests/xr/xr_fixture.h"

#include <cstdlib>

namespace palpate::test {
namespace {

/// Runs before the OpenXR loader is used; no other thread runs yet.
[[maybe_unused]] const int kChosen = [] {
  setenv("XR_RUNTIME_JSON", PALPATE_FAKE_RUNTIME, 1);
  return 0;
}();

}  // namespace

void XrTest::SetUp() {
  runtime().reset();
}

void XrTest::TearDown() {
  close();
  EXPECT_EQ(runtime().alive(), "");
  if (expect_violations_) return;
  EXPECT_THAT(runtime().violations(), ::testing::IsEmpty());
}

xr::Headset& XrTest::headset(xr::HeadsetOptions options) {
  close();
  options.validation = true;
  headset_ = std::make_unique<xr::Headset>(options, source);
  return *headset_;
}

void XrTest::expect_silence() {
  if (!headset_ || !headset_->context()) return;
  EXPECT_TRUE(headset_->context()->validation_active())
      << "the Khronos validation layer is missing (Debian: vulkan-validationlayers)";
  EXPECT_THAT(headset_->context()->validation_messages(), ::testing::IsEmpty());
}

void XrTest::close() {
  expect_silence();
  headset_.reset();
}

const xr::Report& XrTest::step() {
  now_ns_ += 11'111'111;
  return headset_->step(now_ns_);
}

xr::HeadsetState XrTest::step_until(xr::HeadsetState wanted, int steps) {
  for (int i = 0; i < steps && headset_->report().state != wanted; ++i) step();
  return headset_->report().state;
}

}  // namespace palpate::test
