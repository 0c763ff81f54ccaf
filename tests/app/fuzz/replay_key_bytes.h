#pragma once

#include <string_view>

namespace palpate::app::fuzz {

/// Reads the description of a run in a recording. Aborts if the reader's guarantee does not hold.
void parse_replay_key_bytes(std::string_view bytes);

}  // namespace palpate::app::fuzz
