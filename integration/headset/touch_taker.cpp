#include "integration/headset/touch_taker.h"

namespace palpate::headset {
namespace {

constexpr double kHold_s = 0.3;
constexpr double kStill_m = 0.002;  // a hand that rests on something moves less

glm::dvec3 mean(const std::vector<glm::dvec3>& places) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& place : places) sum += place;
  return sum / double(places.size());
}

double spread(const std::vector<glm::dvec3>& places) {
  const glm::dvec3 middle = mean(places);
  double most = 0.0;
  for (const glm::dvec3& place : places) most = std::max(most, glm::distance(place, middle));
  return most;
}

}  // namespace

void TouchTaker::begin(double now_s) {
  since_s_ = now_s;
  device_m_.clear();
  stage_m_.clear();
}

TouchTaker::Taken TouchTaker::step(double now_s, const xr::Controller& hand,
                                   std::span<const TipSample> fresh) {
  const bool pressed = hand.active && hand.grabs;
  if (pressed && !pressed_ && !since_s_) begin(now_s);
  pressed_ = pressed;
  if (!since_s_) return {};
  if (hand.active) stage_m_.push_back(hand.world_from_grip(tip_m_));
  for (const TipSample& sample : fresh) device_m_.push_back(sample.device_m);
  if (now_s - *since_s_ < kHold_s) return {};
  since_s_.reset();
  return judge();
}

TouchTaker::Taken TouchTaker::judge() const {
  if (device_m_.empty())
    return {std::nullopt, "The force device gives no position: check its cable, and press again."};
  if (stage_m_.size() < 2)
    return {std::nullopt,
            "The headset lost the controller: hold it where the headset sees it, and press again."};
  if (spread(device_m_) > kStill_m)
    return {std::nullopt, "The device's tip moved: hold it still, and press again."};
  if (spread(stage_m_) > kStill_m)
    return {std::nullopt, "The controller moved: rest it against the tip, and press again."};
  return {TouchedPoint{mean(device_m_), mean(stage_m_)}, ""};
}

}  // namespace palpate::headset
