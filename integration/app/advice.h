#pragma once

#include <string>

#include "compute/volume/result.h"
#include "integration/headset/headset_event.h"

namespace palpate::app {

/// Sentences of libraries, with what the program's own commands and options can do about them:
/// those that are no options of a session, whose keys with_flags() spells.

std::string advised(const headset::HeadsetEvent& event);
/// Of a window that could not be opened.
Error advised_window(Error error);

}  // namespace palpate::app
