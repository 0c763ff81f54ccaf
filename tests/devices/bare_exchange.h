#pragma once

#include <memory>
#include <string>

namespace palpate::devices::test {

/// The plainest exchange with a Falcon that libusb's own calls make, to be measured against: no
/// judging, no kinematics, no force. One thread.
class BareExchange {
 public:
  enum class Way {
    kOneAfterTheOther,  ///< libusb_bulk_transfer twice, as most programs do
    kTogether,          ///< both transfers in flight, libusb's own event handling
  };
  /// The Falcon at a place, opened and set up; valid() says whether that worked.
  explicit BareExchange(const std::string& place, bool event_character = true);
  ~BareExchange();
  bool valid() const;
  /// Sends zero force and waits for an answer; false if none came in 50 ms.
  bool exchange(Way way);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace palpate::devices::test
