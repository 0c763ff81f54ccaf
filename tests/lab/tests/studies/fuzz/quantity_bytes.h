#pragma once

#include <string_view>

namespace palpate::studies::fuzz {

/// Reads a deadline and an error from bytes. Aborts if a guarantee of the readers does not hold.
void parse_quantity_bytes(std::string_view bytes);

}  // namespace palpate::studies::fuzz
