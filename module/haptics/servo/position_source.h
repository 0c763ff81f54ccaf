#pragma once

#include <glm/glm.hpp>
#include <string>

#include "module/haptics/device.h"
#include "module/haptics/servo/follower.h"
#include "module/haptics/servo/mailbox.h"

namespace palpate {

/// How a source of positions is used as a hand.
struct PositionSourceOptions {
  std::string kind = "mouse";
  glm::dvec3 start_m{0.0};  ///< device space
  bool waits = false;       ///< is not there before the first hold()
  double workspace_radius_m = 0.08;
  double settle_per_s = 60.0;   ///< of the follower: a hand's own quickest movements still pass
  double speed_m_per_s = 0.75;  ///< half of the speed from which on the guards damp
};

/// A mouse, a controller, a bare finger or a tracked tool as a force device: it gives positions,
/// and ignores the forces that it is sent. All guards run as for any hand, so that the arrow that
/// is drawn is the force that a device would give.
///
/// Its numbers, which the guards take: max_force_n 300, as motors may hold a third of their most
/// for ever and no scene asks for more than 100 N. The scene's own limit is the one that counts,
/// and nothing that does not exist is said to get hot. max_stiffness 0 (it does not say): a hand
/// that feels nothing can not hum, so every stiffness is stable. delay 0.
///
/// hold() is called on the thread that knows the position, exchange() on the servo's: they meet in
/// a mailbox and neither waits.
class PositionSource final : public ForceDevice {
 public:
  explicit PositionSource(const PositionSourceOptions& options = {});

  /// Where the hand is now, device space (kept within the workspace), and which buttons are down.
  /// Button 0: a mouse's left one, a controller's trigger. Not finite: ignored. Wait-free; one
  /// thread.
  void hold(glm::dvec3 place_m, uint32_t buttons) noexcept;
  /// No hand (DeviceFault::kNoHand) until the next hold(). The probe then begins there, since a
  /// hand that comes from elsewhere must not be drawn through the scene. As hold().
  void let_go() noexcept;

  DeviceInfo info() const override;
  /// Real-time safe. Every position is fresh: the follower gives the one of now.
  DeviceReading exchange(const DeviceCommand& command) noexcept override;
  /// The same at a given monotonic time: exchange() without a clock.
  DeviceReading exchange_at(int64_t now_ns) noexcept;

 private:
  struct HandPosition {
    glm::dvec3 place_m{0.0};
    uint32_t buttons = 0;
    bool there = true;
  };

  PositionSourceOptions options_;
  Newest<HandPosition> newest_;
  HandPosition position_;  ///< the servo's
  Follower follower_;
  glm::dvec3 last_m_{0.0};  ///< that was given
  int64_t last_ns_ = 0;
  bool started_ = false, there_;
};

}  // namespace palpate
