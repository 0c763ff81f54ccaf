#pragma once

#include <string>
#include <string_view>

namespace palpate::files {

/// One gzip member.
std::string gzip(std::string_view bytes);

/// One gzip member of exactly this many bytes, stored and filled up by an extra field.
std::string gzip_of_length(std::string_view bytes, size_t length);

}  // namespace palpate::files
