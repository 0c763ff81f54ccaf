#pragma once

#include <string>

namespace palpate::test::fake {

/// What the specification says that a controller has (OpenXR 1.0, 6.4 "Interaction Profile Paths"):
/// true if `path` is a part of it. Unknown profiles have nothing.
bool has_part(const std::string& profile, const std::string& path);
bool is_profile(const std::string& profile);

}  // namespace palpate::test::fake
