#include "integration/files/dicom/dicom_identity.h"

#include <algorithm>
#include <cctype>
#include <vector>

#include "integration/files/dicom/dicom_tags.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Initials stand in most words. Short names ("Max") are parts of other words ("MaxIP"), and short
/// numbers may be those of a phase: they count as whole words, or not at all.
constexpr size_t kShortestName = 3, kShortestNumber = 4, kAnywhere = 5;

bool is_word_at(std::string_view text, size_t at, size_t size) {
  const auto is_part = [&](size_t k) { return std::isalnum(static_cast<unsigned char>(text[k])); };
  return (at == 0 || !is_part(at - 1)) && (at + size == text.size() || !is_part(at + size));
}

}  // namespace

std::string without_identity(const std::string& text, const DicomElements& file) {
  std::vector<std::string> parts;
  for (const uint32_t tag : tags::kPatientNames) {
    const std::string names = lowered(file.text(tag));
    for (const std::string_view part : words(names, "^=\\ ,;"))
      if (part.size() >= kShortestName) parts.emplace_back(part);
  }
  for (const uint32_t tag : tags::kPatientNumbers) {
    const std::string numbers = lowered(file.text(tag));
    for (const std::string_view part : words(numbers, "\\"))
      if (trimmed(part).size() >= kShortestNumber) parts.emplace_back(trimmed(part));
  }
  // "Mertens" before "Mert": the longer one leaves nothing behind.
  std::sort(parts.begin(), parts.end(),
            [](const std::string& a, const std::string& b) { return a.size() > b.size(); });
  std::string shown = text;
  for (const std::string& part : parts)
    for (size_t at = 0; (at = lowered(shown).find(part, at)) != std::string::npos; ++at)
      if (part.size() >= kAnywhere || is_word_at(shown, at, part.size()))
        shown.replace(at, part.size(), "***");
  return shown;
}

}  // namespace palpate::files
