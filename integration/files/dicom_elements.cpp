#include "integration/files/dicom_elements.h"

#include <cmath>
#include <cstring>

#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

constexpr size_t kPreambleBytes = 132;
constexpr uint32_t kUndefined = 0xffffffffu;
constexpr uint32_t kItem = 0xfffee000u, kItemEnd = 0xfffee00du, kSequenceEnd = 0xfffee0ddu;
constexpr uint32_t kPixels = 0x7fe00010u, kTransferSyntax = 0x00020010u;
/// Real files nest three or four sequences.
constexpr int kMaxDepth = 16;

template <class T>
T little(std::string_view bytes) {
  T value{};
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

struct Head {
  uint32_t tag = 0;
  uint32_t length = 0;
  bool is_sequence = false;
};

/// A position in the bytes that never passes their end. Every function returns false where the
/// structure breaks.
class Walker {
 public:
  Walker(std::string_view bytes, size_t at, bool explicit_vr)
      : bytes_(bytes), at_(at), explicit_vr_(explicit_vr) {}

  size_t position() const { return at_; }

  bool head(size_t end, Head& head) {
    if (end - at_ < 8) return false;
    head.tag = uint32_t(little<uint16_t>(bytes_.substr(at_))) << 16 |
               little<uint16_t>(bytes_.substr(at_ + 2));
    head.is_sequence = false;
    const bool delimiter = head.tag >> 16 == 0xfffe;
    if (!explicit_vr_ || delimiter) {
      head.length = little<uint32_t>(bytes_.substr(at_ + 4));
      head.is_sequence = !delimiter && head.length == kUndefined;
      at_ += 8;
      return true;
    }
    const std::string_view vr = bytes_.substr(at_ + 4, 2);
    head.is_sequence = vr == "SQ";
    constexpr std::string_view kLong = "OB OW OF OD OL OV SQ UC UR UT UN SV UV";
    if (vr.find(' ') != std::string_view::npos || kLong.find(vr) == std::string_view::npos) {
      head.length = little<uint16_t>(bytes_.substr(at_ + 6));
      at_ += 8;
      return true;
    }
    if (end - at_ < 12) return false;
    head.length = little<uint32_t>(bytes_.substr(at_ + 8));
    at_ += 12;
    return true;
  }

  /// Leaves the value of an element out, items and all.
  bool skip_value(const Head& head, size_t end, int depth) {
    if (head.length == kUndefined || head.is_sequence) {
      if (depth >= kMaxDepth) return false;
      const bool open = head.length == kUndefined;
      if (!open && head.length > end - at_) return false;
      return skip_items(open ? end : at_ + head.length, open, depth + 1);
    }
    if (head.length > end - at_) return false;
    at_ += head.length;
    return true;
  }

  /// The fragments of packed pixels: items of known length up to the sequence end.
  bool skip_fragments(size_t end) {
    for (Head item; this->head(end, item);) {
      if (item.tag == kSequenceEnd) return true;
      if (item.tag != kItem || item.length > end - at_) return false;
      at_ += item.length;
    }
    return false;
  }

 private:
  bool skip_items(size_t end, bool open, int depth) {
    while (open || at_ < end) {
      Head item;
      if (!head(end, item)) return false;
      if (open && item.tag == kSequenceEnd) return true;
      if (item.tag != kItem) return false;
      if (item.length != kUndefined && item.length > end - at_) return false;
      const bool open_item = item.length == kUndefined;
      if (!skip_elements(open_item ? end : at_ + item.length, open_item, depth)) return false;
    }
    return true;
  }

  bool skip_elements(size_t end, bool open, int depth) {
    while (open || at_ < end) {
      Head element;
      if (!head(end, element)) return false;
      if (open && element.tag == kItemEnd) return true;
      if (!skip_value(element, end, depth)) return false;
    }
    return true;
  }

  std::string_view bytes_;
  size_t at_;
  bool explicit_vr_;
};

std::string_view without_padding(std::string_view value) {
  while (!value.empty() && value.back() == '\0') value.remove_suffix(1);
  return trimmed(value);
}

/// The standard's name of how the file is written, or the sentence about one that is not read.
Result<std::string> transfer_syntax(const std::filesystem::path& file, std::string_view bytes,
                                    size_t& data_at) {
  Walker walker(bytes, kPreambleBytes, true);
  std::string syntax = "1.2.840.10008.1.2";
  // The group with number 2 describes the file and is always explicit little endian.
  while (walker.position() + 8 <= bytes.size() &&
         little<uint16_t>(bytes.substr(walker.position())) == 2) {
    Head head;
    if (!walker.head(bytes.size(), head)) break;
    const size_t value_at = walker.position();
    if (head.length == kUndefined || !walker.skip_value(head, bytes.size(), 0)) {
      return bad_input(file, "is cut short or damaged: export it again");
    }
    if (head.tag == kTransferSyntax) syntax = without_padding(bytes.substr(value_at, head.length));
  }
  if (syntax == "1.2.840.10008.1.2.2" || syntax == "1.2.840.10008.1.2.1.99") {
    return bad_input(file,
                     "is written in a DICOM syntax of the past (big endian or deflated): convert "
                     "it to little endian");
  }
  data_at = walker.position();
  return syntax;
}

}  // namespace

std::string DicomElements::text(uint32_t tag) const {
  const auto found = values.find(tag);
  return found == values.end() ? std::string{} : std::string(without_padding(found->second));
}

std::optional<double> DicomElements::number(uint32_t tag) const {
  const auto value = to_number(text(tag));
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::vector<double> DicomElements::numbers(uint32_t tag, size_t count) const {
  const std::string all = text(tag);
  std::vector<double> found;
  for (const std::string_view cell : cells(all, '\\')) {
    const auto value = to_number(cell);
    if (value && std::isfinite(*value)) found.push_back(*value);
  }
  if (found.size() != count) found.clear();
  return found;
}

std::optional<int> DicomElements::whole(uint32_t tag) const {
  const auto found = values.find(tag);
  if (found == values.end() || found->second.size() < sizeof(uint16_t)) return std::nullopt;
  return int(little<uint16_t>(found->second));
}

std::optional<double> DicomElements::real(uint32_t tag) const {
  const auto found = values.find(tag);
  if (found == values.end() || found->second.size() < sizeof(double)) return std::nullopt;
  const double value = little<double>(found->second);
  return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
}

Result<DicomElements> parse_dicom(const std::filesystem::path& file, std::string_view bytes) {
  if (bytes.size() < kPreambleBytes || bytes.substr(128, 4) != "DICM") {
    return bad_input(file, "is no DICOM file: check what wrote it");
  }
  size_t at = 0;
  const auto syntax = transfer_syntax(file, bytes, at);
  if (!syntax) return syntax.error();
  Walker walker(bytes, at, *syntax != "1.2.840.10008.1.2");
  DicomElements elements;
  while (walker.position() < bytes.size()) {
    Head head;
    if (!walker.head(bytes.size(), head)) return bad_input(file, "is cut short: export it again");
    const size_t value_at = walker.position();
    if (head.tag == kPixels) {
      elements.has_pixels = true;
      elements.is_packed = head.length == kUndefined;
      const bool whole = elements.is_packed ? walker.skip_fragments(bytes.size())
                                            : head.length <= bytes.size() - value_at;
      if (!whole) return bad_input(file, "is cut short within its pixels: export it again");
      if (!elements.is_packed) elements.pixels = bytes.substr(value_at, head.length);
      return elements;
    }
    if (!walker.skip_value(head, bytes.size(), 0))
      return bad_input(file, "is cut short or damaged: export it again");
    if (head.length != kUndefined) elements.values[head.tag] = bytes.substr(value_at, head.length);
  }
  return elements;
}

}  // namespace palpate::files
