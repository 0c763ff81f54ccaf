#include "integration/devices/falcon_judge.h"

#include <algorithm>
#include <cstdlib>

#include "integration/devices/falcon_kinematics.h"

namespace palpate::devices::falcon {

FalconJudge::FalconJudge() noexcept : judge_(kWorkspaceCentre, kWorkspaceRadius) {}

DeviceReading FalconJudge::judge(const FalconExchange& exchange) noexcept {
  AnswerJudge::Exchange seen;
  seen.garbage = exchange.garbage;
  seen.time_ns = exchange.time_ns;
  seen.force_n = exchange.force_n;
  if (exchange.answer) examine(*exchange.answer, seen);
  return judge_.judge(seen);
}

void FalconJudge::restart() noexcept {
  AnswerJudge kept = judge_;
  *this = FalconJudge();
  kept.restart();
  judge_ = kept;
}

void FalconJudge::examine(const FalconAnswer& answer, AnswerJudge::Exchange& seen) noexcept {
  seen.answered = true;
  seen.buttons = answer.buttons;
  homed_ = answer.homed == kAllHomed;
  if (!homed_) {  // counts from a zero that nobody knows
    seen.said = DeviceFault::kNotHomed;
    return;
  }
  const auto place = forward(arm_angles(answer.encoders), place_);
  if (!place) {
    seen.said = DeviceFault::kOutOfReach;
    return;
  }
  place_ = seen.position_m = place->metres;
  std::array<int, 3> moved;
  for (size_t e = 0; e < 3; ++e) moved[e] = std::abs(int(answer.encoders[e]) - int(counts_[e]));
  counts_ = answer.encoders;
  seen.moved = moved != std::array<int, 3>{};
  seen.one_stands = one_stands(moved, judge_.is_inside(place_));
}

/// No hand moves the grip far while one arm's count stays exactly the same.
bool FalconJudge::one_stands(const std::array<int, 3>& moved, bool inside) noexcept {
  bool one = false;
  for (size_t e = 0; e < 3; ++e) {
    auto& path = path_[e];
    const size_t a = (e + 1) % 3, b = (e + 2) % 3;
    path[a] = std::min(path[a] + moved[a], 2 * kPassed);
    path[b] = std::min(path[b] + moved[b], 2 * kPassed);
    if (moved[e] || !inside) path[a] = path[b] = 0;
    one |= std::min(path[a], path[b]) >= kPassed;
  }
  return one;
}

}  // namespace palpate::devices::falcon
