// Random legal walks of the session's state machine: whatever the runtime announces, the program
// makes the required calls and no forbidden one, and reports its state.

#include "tests/support/random.h"
#include "tests/xr/xr_fixture.h"

namespace palpate::test {
namespace {

using xr::HeadsetState;

/// The states that a conformant runtime may announce next (OpenXR 1.0, figure "Session State
/// Life-cycle"); UNKNOWN means none.
XrSessionState next_state(XrSessionState now, Random& random) {
  if (random.chance(0.02)) return XR_SESSION_STATE_LOSS_PENDING;
  const bool up = random.chance(0.6);
  switch (now) {
    case XR_SESSION_STATE_IDLE:
      return random.chance(0.03) ? XR_SESSION_STATE_EXITING : XR_SESSION_STATE_READY;
    case XR_SESSION_STATE_READY:
      return XR_SESSION_STATE_SYNCHRONIZED;
    case XR_SESSION_STATE_SYNCHRONIZED:
      return up ? XR_SESSION_STATE_VISIBLE : XR_SESSION_STATE_STOPPING;
    case XR_SESSION_STATE_VISIBLE:
      return up ? XR_SESSION_STATE_FOCUSED : XR_SESSION_STATE_SYNCHRONIZED;
    case XR_SESSION_STATE_FOCUSED:
      return XR_SESSION_STATE_VISIBLE;
    case XR_SESSION_STATE_STOPPING:
      return XR_SESSION_STATE_IDLE;
    default:
      return XR_SESSION_STATE_UNKNOWN;
  }
}

/// The state that the program must report after an announcement.
HeadsetState expected(XrSessionState state) {
  switch (state) {
    case XR_SESSION_STATE_READY:
    case XR_SESSION_STATE_SYNCHRONIZED:
      return HeadsetState::kHidden;
    case XR_SESSION_STATE_VISIBLE:
      return HeadsetState::kVisible;
    case XR_SESSION_STATE_FOCUSED:
      return HeadsetState::kFocused;
    case XR_SESSION_STATE_LOSS_PENDING:
      return HeadsetState::kWaiting;
    case XR_SESSION_STATE_EXITING:
      return HeadsetState::kEnded;
    default:
      return HeadsetState::kIdle;
  }
}

class XrWalk : public XrTest {
 protected:
  /// One walk: a session from its first announcement to its loss or end.
  void walk(xr::Headset& headset, uint32_t seed) {
    Random random(seed);
    const auto step = [&] { return headset.step(now_ns_ += 11'111'111).state; };
    ASSERT_EQ(step(), HeadsetState::kIdle) << "seed " << seed;
    XrSessionState now = XR_SESSION_STATE_IDLE;
    runtime().announce(now);
    for (int i = 0; i < 60; ++i) {
      // Several announcements may come together. But after READY and STOPPING the runtime waits for
      // the program's answer (begin, end) before the next one.
      const int bunch = 1 + random.below(3);
      for (int b = 0; b < bunch; ++b) {
        const XrSessionState next = next_state(now, random);
        runtime().announce(now = next);
        if (next == XR_SESSION_STATE_READY || next == XR_SESSION_STATE_STOPPING ||
            next == XR_SESSION_STATE_LOSS_PENDING || next == XR_SESSION_STATE_EXITING)
          break;
      }
      runtime().setup().should_render = random.chance(0.02);
      const uint64_t frames = runtime().frames();
      ASSERT_EQ(step(), expected(now)) << "seed " << seed << ", step " << i;
      const bool running = headset.report().state == HeadsetState::kHidden ||
                           headset.report().state == HeadsetState::kVisible ||
                           headset.report().state == HeadsetState::kFocused;
      ASSERT_EQ(runtime().frames() - frames, running ? 1u : 0u) << "seed " << seed;
      ASSERT_EQ(headset.report().hands.focused, headset.report().state == HeadsetState::kFocused)
          << "seed " << seed;
      if (now == XR_SESSION_STATE_LOSS_PENDING || now == XR_SESSION_STATE_EXITING) break;
      if (random.chance(0.05)) break;
    }
    // At any stage: lost, or ended by the program.
    if (random.chance(0.9)) {
      if (runtime().session()) runtime().announce(XR_SESSION_STATE_LOSS_PENDING);
    } else if (headset.report().state != HeadsetState::kWaiting) {
      headset.end(now_ns_);
    }
    for (int i = 0; i < 3 && headset.report().state != HeadsetState::kEnded &&
                    headset.report().state != HeadsetState::kWaiting;
         ++i) {
      now_ns_ += 1'000'000'000;
      step();
    }
    const HeadsetState last = headset.report().state;
    ASSERT_TRUE(last == HeadsetState::kEnded || last == HeadsetState::kWaiting) << "seed " << seed;
    ASSERT_EQ(runtime().session(), XrSession(XR_NULL_HANDLE)) << "seed " << seed;
    headset.look_again();
    now_ns_ += 1'000'000'000;
  }
};

TEST_F(XrWalk, TwentyThousandRandomLegalWalksEndAsTheyShould) {
  runtime().setup().automatic = false;
  xr::Headset headset({}, source);
  for (uint32_t seed = 1; seed <= 20'000; ++seed) {
    walk(headset, seed);
    ASSERT_THAT(runtime().violations(), ::testing::IsEmpty()) << "seed " << seed;
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace palpate::test
