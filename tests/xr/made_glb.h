#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::test {

/// A binary glTF 2.0 of these parts: its JSON, and the bytes that it refers to as buffer 0.
std::vector<uint8_t> glb_of(const std::string& json, const std::vector<uint8_t>& bytes);

/// A controller: the red node "grip" with a box of 30 x 40 x 100 mm around its origin, and the
/// green node "trigger" below it, a box of 10 mm, 40 mm below the grip's middle.
std::vector<uint8_t> made_controller();

}  // namespace palpate::test
