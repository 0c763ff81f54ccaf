#pragma once

#include <string>

namespace palpate::test {

/// Empty if xmllint reads the text as well-formed XML, else its first error message.
std::string xml_trouble(const std::string& text);

/// How often a text contains a piece.
size_t count_of(const std::string& piece, const std::string& text);

}  // namespace palpate::test
