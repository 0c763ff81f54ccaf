#pragma once

#include <string_view>

namespace palpate::app::fuzz {

/// Reads what a recording says of its run. Aborts where a promise of the reader is broken.
void parse_replay_key_bytes(std::string_view bytes);

}  // namespace palpate::app::fuzz
