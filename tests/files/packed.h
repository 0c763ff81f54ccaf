#pragma once

#include <string>
#include <string_view>

namespace palpate::files {

/// One gzip member.
std::string gzip(std::string_view bytes);

}  // namespace palpate::files
