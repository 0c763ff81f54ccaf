// The mode of texture_mode.h as a library, built as snap_mode.cpp is.
#include "docs/examples/texture_mode.h"

PALPATE_MODES(add_texture)
