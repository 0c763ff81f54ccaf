#pragma once

#include "module/haptics/servo/mailbox.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate::desktop {

/// The force of every tick, for a plot: heard on the servo thread, taken by one other. Real-time
/// safe; what nobody takes for eight seconds is lost.
class ForceTap final : public TickListener {
 public:
  struct Sample {
    int64_t now_ns = 0;
    double force_n = 0.0;
  };
  void hear(const TickInput& input, const TickOutput& output) noexcept override {
    samples_.push({input.now_ns, glm::length(output.command.force_n)});
  }
  /// The next one in order; false if there is none.
  bool take(Sample& sample) noexcept { return samples_.pop(sample); }

 private:
  Ring<Sample, 8192> samples_;
};

}  // namespace palpate::desktop
