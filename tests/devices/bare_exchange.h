#pragma once

#include <memory>
#include <string>

namespace palpate::devices::test {

/// The simplest exchange with a Falcon by libusb's own functions, as a reference for time: no
/// checks of answers, no kinematics, no force. One thread.
class BareExchange {
 public:
  enum class Way {
    kOneAfterTheOther,  ///< libusb_bulk_transfer twice, as most programs do
    kTogether,          ///< both transfers in flight, libusb's own event handling
  };
  /// Opens and sets up the Falcon at a place; valid() returns whether that worked.
  explicit BareExchange(const std::string& place, bool event_character = true);
  ~BareExchange();
  bool valid() const;
  /// Sends zero force and waits for an answer; false if none arrived in 50 ms.
  bool exchange(Way way);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace palpate::devices::test
