#pragma once

#include <string>

#include "integration/scenes/palpate_mode.h"
#include "module/haptics/modes/modes.h"

namespace palpate::scenes {

/// Adds a kind of mode that was written against palpate_mode.h. `kind` and what it points to must
/// stay. kBadInput, in a sentence, if something of it is missing.
Status add_c_mode(const PalModeKind& kind, ModeKinds& kinds);

}  // namespace palpate::scenes
