#pragma once

#include <string_view>

namespace palpate::studies::fuzz {

/// Reads a deadline and an error from bytes. Aborts where a promise of the readers is broken.
void parse_quantity_bytes(std::string_view bytes);

}  // namespace palpate::studies::fuzz
