#pragma once

#include <memory>

#include "integration/devices/list.h"
#include "module/haptics/servo/second_hand.h"

/// What palpate drives itself, over USB: Falcon and SpaceMouse. On Linux alone: Windows gives a bus
/// to programs only through drivers that somebody installs for each device.
namespace palpate::devices {

/// Appends what is on the bus, or says in `list.wrong` why nothing is.
void list_bus(DeviceList& list);

/// Null where palpate drives none.
std::unique_ptr<SecondHand> make_second_hand();

}  // namespace palpate::devices
