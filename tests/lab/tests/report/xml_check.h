#pragma once

#include <string>

namespace palpate::test {

/// Empty if xmllint reads the text as well-formed XML, else its first complaint.
std::string xml_trouble(const std::string& text);

/// How often a piece occurs in a text.
size_t count_of(const std::string& piece, const std::string& text);

}  // namespace palpate::test
