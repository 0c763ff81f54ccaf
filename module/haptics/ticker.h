#pragma once

#include "module/haptics/tick.h"

namespace palpate {

/// One haptic frame after another: what the servo thread runs. Its result depends on its state and
/// its input alone, so that a recorded run can be repeated bit by bit.
class Ticker {
 public:
  virtual ~Ticker() = default;
  /// Real-time safe: no allocation, no lock, no log, no exception. One thread.
  virtual TickOutput tick(const TickInput& input) noexcept = 0;
};

}  // namespace palpate
