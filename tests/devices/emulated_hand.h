#pragma once

#include <cstddef>
#include <glm/glm.hpp>

namespace palpate::devices::test {

/// What a test can read and set on every emulated force device, whatever its connection. Any
/// thread.
class EmulatedHand {
 public:
  virtual ~EmulatedHand() = default;
  /// Moves the grip to a place: device space as in DeviceInfo, m.
  virtual void place(glm::dvec3 position_m) = 0;
  /// The number of commands that it has decoded.
  virtual size_t received_count() const = 0;
  /// Whether one of them, counted from 0, was a force.
  virtual bool pushed(size_t command) const = 0;
  /// Whether the newest one was.
  bool pushes() const {
    const size_t count = received_count();
    return count > 0 && pushed(count - 1);
  }
};

}  // namespace palpate::devices::test
