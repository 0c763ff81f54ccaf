#pragma once

#include <string>

#include "integration/loading/palpate_mode.h"
#include "module/haptics/modes/modes.h"

namespace palpate::loading {

/// Adds a kind of mode that was written against palpate_mode.h. `kind` and everything that it
/// points to must stay valid. Errors: kBadInput, with a sentence, if something is missing in it.
Status add_c_mode(const PalModeKind& kind, ModeKinds& kinds);

}  // namespace palpate::loading
