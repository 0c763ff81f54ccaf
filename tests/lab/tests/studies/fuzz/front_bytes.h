#pragma once

#include <string_view>

namespace palpate::studies::fuzz {

/// Reads a measured front and asks it for settings. Aborts where a promise of the reader is broken.
void parse_front_bytes(std::string_view bytes);

}  // namespace palpate::studies::fuzz
