#include "integration/headset/probe_hand.h"

#include <algorithm>

namespace palpate::headset {
namespace {

constexpr double kShortest_s = 1e-6;  // so that a pinch counts from its first frame on

}  // namespace

ProbeHold ProbeHand::step(const xr::Hands& hands, double dt_s) {
  ProbeHold hold;
  for (const int side : {1, 0}) {
    const xr::Controller& hand = hands.hand[size_t(side)];
    if (!hand.active) continue;
    pinched_s_ = {};
    since_tap_s_ = {};
    finger_.reset();
    hold.by = ProbeHold::By::kController;
    hold.side = side;
    hold.tip_m = hand.world_from_aim.value_or(hand.world_from_grip).position_m;
    hold.buttons = hand.dead_man ? 1u : 0u;
    return hold;
  }
  for (const size_t side : {size_t(0), size_t(1)}) {
    const xr::Fingers& fingers = hands.fingers[side];
    hold.shown[side] = fingers.seen;
    hold.tips[side] = fingers.fingertip_m;
    std::optional<double>& since_s = since_tap_s_[side];
    if (since_s) *since_s += dt_s;
    // A pinch that ends because tracking lost the hand is not a tap.
    if (!fingers.seen || (since_s && *since_s >= kTwice_s)) since_s.reset();
    if (!fingers.pinches && fingers.seen && pinched_s_[side] > 0.0 && pinched_s_[side] < kTap_s) {
      (since_s ? hold.asks_to_keep : hold.asks_for_tube) = true;
      since_s = since_s ? std::nullopt : std::optional(0.0);
    }
    pinched_s_[side] = fingers.pinches ? pinched_s_[side] + std::max(dt_s, kShortest_s) : 0.0;
  }
  if (finger_ && !hands.fingers[size_t(*finger_)].pinches) finger_.reset();
  for (const int side : {1, 0})
    if (!finger_ && hands.fingers[size_t(side)].pinches) finger_ = side;
  if (!finger_) return hold;
  hold.by = ProbeHold::By::kFinger;
  hold.side = *finger_;
  hold.tip_m = hands.fingers[size_t(*finger_)].fingertip_m;
  return hold;
}

}  // namespace palpate::headset
