#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "integration/devices/answer_judge.h"
#include "integration/devices/falcon_protocol.h"
#include "module/haptics/device.h"

namespace palpate::devices::falcon {

/// An AnswerJudge for a Falcon: makes positions of encoder counts, and finds one more fault that
/// only encoders show. Servo thread; real-time safe.
class FalconJudge {
 public:
  static constexpr int kPassed = 400;  ///< counts that both other arms move while one stands: stuck

  FalconJudge() noexcept;

  /// One exchange.
  struct FalconExchange {
    std::optional<FalconAnswer> answer;
    bool garbage = false;     ///< bytes came that were no answer
    int64_t time_ns = 0;      ///< monotonic, when it ended
    glm::dvec3 force_n{0.0};  ///< that the motors were told to make
  };
  DeviceReading judge(const FalconExchange& exchange) noexcept;

  /// As AnswerJudge has them.
  DeviceReading frozen(DeviceFault fault) const noexcept { return judge_.frozen(fault); }
  void fail(DeviceFault fault) noexcept { judge_.fail(fault); }
  void restart() noexcept;
  DeviceFault fault() const noexcept { return judge_.fault(); }
  bool hopeless() const noexcept { return judge_.hopeless(); }
  glm::dvec3 position() const noexcept { return judge_.position(); }

  bool homed() const noexcept { return homed_; }

 private:
  void examine(const FalconAnswer& answer, AnswerJudge::Exchange& seen) noexcept;
  bool one_stands(const std::array<int, 3>& moved, bool inside) noexcept;

  AnswerJudge judge_;
  bool homed_ = false;
  glm::dvec3 place_{0.0};  ///< where the last answer is, good or not
  std::array<int16_t, 3> counts_{};
  std::array<std::array<int, 3>, 3> path_{};  ///< [e][o]: counts o moved since e last did
};

}  // namespace palpate::devices::falcon
