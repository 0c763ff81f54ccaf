#pragma once

#include <string>

namespace palpate::test::fake {

/// The parts of a controller by the specification (OpenXR 1.0, 6.4 "Interaction Profile Paths"), or
/// of a bare hand (XR_EXT_hand_interaction):
/// true if `path` is one of them. Unknown profiles have none.
bool has_part(const std::string& profile, const std::string& path);
bool is_profile(const std::string& profile);

}  // namespace palpate::test::fake
