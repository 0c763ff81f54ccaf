#include "integration/devices/bus_devices.h"

namespace palpate::devices {

void list_bus(DeviceList& list) {
  list.wrong =
      "On Windows palpate drives no device on USB itself: Falcon, Polhem and SpaceMouse can not be "
      "used.";
}

std::unique_ptr<SecondHand> make_second_hand() {
  return nullptr;
}

}  // namespace palpate::devices
