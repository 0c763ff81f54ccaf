#include "integration/headset/place_check.h"

#include <fmt/format.h>

namespace palpate::headset {
namespace {

constexpr double kClose_m = 0.10;       // a hand that grabs further away means the volume
constexpr double kGoodPlace_m = 0.003;  // as for a calibration that can be used

}  // namespace

PlaceCheck::PlaceCheck(glm::dvec3 controller_from_tip_m)
    : tip_m_(controller_from_tip_m),
      takers_{TouchTaker(controller_from_tip_m), TouchTaker(controller_from_tip_m)} {}

std::optional<HeadsetEvent> PlaceCheck::step(double now_s, glm::dvec3 probe_m, xr::Colocation& room,
                                             xr::Hands& hands) {
  if (room.doubtful() && !wanted_) {
    wanted_ = true;
    asked_ = false;
  }
  if (!wanted_) return std::nullopt;
  if (!asked_) {
    asked_ = true;
    return HeadsetEvent{
        HeadsetEvent::Kind::kNote,
        room.doubtful()
            ? "The runtime was restarted and may take the room for another: touch the device's "
              "tip with the controller's tip and grab, to check the calibration."
            : "Touch the device's tip with the controller's tip and grab: that checks that the "
              "picture stands where the force is."};
  }
  const TipSample tip{now_s, probe_m};
  for (size_t side = 0; side < 2; ++side) {
    xr::Controller& hand = hands.hand[side];
    xr::Controller touching = hand;
    touching.grabs = hand.grabs && glm::distance(hand.world_from_grip(tip_m_), probe_m) < kClose_m;
    const auto taken = takers_[side].step(now_s, touching, {&tip, 1});
    if (touching.grabs) hand.grabs = false;
    if (taken.point) return judge(*taken.point, room);
    if (!taken.refused.empty()) return HeadsetEvent{HeadsetEvent::Kind::kNote, taken.refused};
  }
  return std::nullopt;
}

HeadsetEvent PlaceCheck::judge(const TouchedPoint& point, xr::Colocation& room) {
  const double off_m = glm::distance(point.device_m, point.stage_m);
  if (off_m > kGoodPlace_m)
    return {HeadsetEvent::Kind::kMisplaced,
            fmt::format("The picture stands {:.1f} mm off the device.", 1e3 * off_m)};
  room.trust();
  wanted_ = false;
  return {HeadsetEvent::Kind::kNote,
          fmt::format("The picture stands where the device is, to {:.1f} mm.", 1e3 * off_m)};
}

}  // namespace palpate::headset
