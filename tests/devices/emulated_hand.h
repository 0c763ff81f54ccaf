#pragma once

#include <cstddef>
#include <glm/glm.hpp>

namespace palpate::devices::test {

/// What every emulated force device shows of itself, whatever it is connected by. Any thread.
class EmulatedHand {
 public:
  virtual ~EmulatedHand() = default;
  /// Puts the grip somewhere: device space as DeviceInfo has it, m.
  virtual void place(glm::dvec3 position_m) = 0;
  /// Commands that it understood since it was made.
  virtual size_t received_count() const = 0;
  /// Whether one of them, counted from 0, was a force.
  virtual bool pushed(size_t command) const = 0;
  /// Whether the newest was.
  bool pushes() const {
    const size_t count = received_count();
    return count > 0 && pushed(count - 1);
  }
};

}  // namespace palpate::devices::test
