#pragma once

#include <string>

#include "compute/volume/result.h"
#include "integration/devices/list.h"
#include "integration/headset/headset_event.h"
#include "module/haptics/device.h"
#include "module/session/note.h"

namespace palpate::app {

/// What libraries say, with what this program's own commands and options can do about it. Libraries
/// give values and neutral sentences; the names of options are said here and in the commands.

/// times_by: what says the times of frames instead of assumed ones, an option or a key of the
/// scene.
std::string advised(const Note& note, const char* times_by = "--fps");
std::string advised(const headset::HeadsetEvent& event);
std::string advised(DeviceFault fault);
/// Why the device can not be used as it is; empty if it can.
std::string advised(const devices::ListedDevice& device);
/// Of a window that could not be opened.
Error advised_window(Error error);

}  // namespace palpate::app
