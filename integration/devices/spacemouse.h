#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "module/haptics/servo/second_hand.h"

namespace palpate::devices {

struct SpaceMouseOptions {
  /// Only the one that is plugged in there ("usb 1-2"); empty: the first that can be opened.
  std::string address;
  double full_speed_m_per_s = 0.15;
  double full_turn_rad_per_s = 1.5;
  int dead_zone = 8;  ///< counts of 350; a puck let go comes to rest near zero, not at it
  /// A puck that is held to one side repeats itself every 8 ms, a wireless one every 16 ms. Silence
  /// for so long means rest, even if the word that it came to rest was lost.
  int64_t silence_ns = 100'000'000;
};

/// What happened on the wire, since the object was made.
struct SpaceMouseCounts {
  uint64_t reports = 0;   ///< that moved or pressed something
  uint64_t rejected = 0;  ///< reports that mean nothing to us, a battery's state among them
  uint64_t opened = 0;    ///< times it became ready
};

/// A 3Dconnexion SpaceMouse (and its kin) as the second hand, without its maker's driver.
///
/// A thread of its own looks for it, takes its interface from the kernel's HID driver while this
/// object lives (and gives it back), listens, and looks for it again when it is unplugged. Not
/// finding one is no error: read() says so and means rest.
class SpaceMouse final : public SecondHand {
 public:
  explicit SpaceMouse(const SpaceMouseOptions& options = {});
  ~SpaceMouse() override;

  DeviceInfo info() const override;
  SecondHandReading read() const noexcept override;
  /// Any thread.
  SpaceMouseCounts counts() const noexcept;

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace palpate::devices
