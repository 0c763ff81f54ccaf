#pragma once

#include <string_view>

namespace palpate::studies::fuzz {

/// Reads a measured front and chooses settings from it. Aborts if a guarantee of the reader does
/// not hold.
void parse_front_bytes(std::string_view bytes);

}  // namespace palpate::studies::fuzz
