#include "integration/files/dicom/dicom_elements.h"

#include <zlib.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstring>

#include "compute/volume/memory.h"
#include "integration/files/dicom/dicom_tags.h"
#include "integration/files/raster/raster.h"
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
constexpr size_t kFirstInflatedBytes = 1024 * 1024;

template <class T>
T number_at(std::string_view bytes, bool big_endian) {
  unsigned char raw[sizeof(T)];
  std::memcpy(raw, bytes.data(), sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  T value{};
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// How the elements of a file are written.
struct Syntax {
  bool explicit_vr = true;
  bool big_endian = false;
};

/// Without explicit VR only the standard's dictionary knows which elements are sequences; only
/// these are parsed if their length is known.
bool is_known_sequence(uint32_t tag) {
  using namespace tags;
  constexpr uint32_t kKnown[] = {kSharedGroups,
                                 kFrameGroups,
                                 kPixelMeasures,
                                 kPlanePosition,
                                 kPlaneOrientation,
                                 kPixelValueTransformation,
                                 kFrameContent,
                                 kCardiacSynchronization,
                                 kTemporalPositionGroup,
                                 kRespiratorySynchronization,
                                 kVolumePosition,
                                 kVolumeOrientation,
                                 kMrFrameType,
                                 kCtFrameType,
                                 kMrEcho,
                                 kMrModifier,
                                 kMrTiming,
                                 kMrDiffusion,
                                 kMrVelocity,
                                 kUsImage};
  return std::find(std::begin(kKnown), std::end(kKnown), tag) != std::end(kKnown);
}

struct Head {
  uint32_t tag = 0;
  uint32_t length = 0;
  bool is_sequence = false;
  bool is_unknown = false;  ///< VR "UN": whatever is in it has implicit VR
  bool is_words = false;    ///< VR "OW"
};

/// A position in the bytes that never passes their end. Every function returns false where the
/// structure breaks.
class Walker {
 public:
  Walker(std::string_view bytes, size_t at, Syntax syntax)
      : bytes_(bytes), at_(at), syntax_(syntax) {}

  size_t position() const { return at_; }

  bool head(size_t end, Head& head) {
    if (end - at_ < 8) return false;
    head = {};
    head.tag = uint32_t(number<uint16_t>(0)) << 16 | number<uint16_t>(2);
    const bool delimiter = head.tag >> 16 == 0xfffe;
    if (!syntax_.explicit_vr || delimiter) {
      head.length = number<uint32_t>(4);
      head.is_sequence = !delimiter && (head.length == kUndefined || is_known_sequence(head.tag));
      head.is_words = true;
      at_ += 8;
      return true;
    }
    const std::string_view vr = bytes_.substr(at_ + 4, 2);
    head.is_sequence = vr == "SQ";
    head.is_unknown = vr == "UN";
    head.is_words = vr == "OW";
    constexpr std::string_view kLong = "OB OW OF OD OL OV SQ UC UR UT UN SV UV";
    if (vr.find(' ') != std::string_view::npos || kLong.find(vr) == std::string_view::npos) {
      head.length = number<uint16_t>(6);
      at_ += 8;
      return true;
    }
    if (end - at_ < 12) return false;
    head.length = number<uint32_t>(8);
    at_ += 12;
    return true;
  }

  /// The value of an element, items and all, into `elements`.
  bool take_value(const Head& head, size_t end, int depth, DicomElements& elements) {
    const bool open = head.length == kUndefined;
    if (!open && head.length > end - at_) return false;
    if (!open && !head.is_sequence) {
      elements.values[head.tag] = bytes_.substr(at_, head.length);
      at_ += head.length;
      return true;
    }
    // The packed pixels of a small picture within the file.
    std::vector<std::string_view> fragments;
    if (head.tag == kPixels) return take_fragments(end, fragments);
    if (depth >= kMaxDepth) return false;
    const Syntax outside = syntax_;
    if (head.is_unknown) syntax_ = {.explicit_vr = false, .big_endian = false};
    const bool whole =
        take_items(open ? end : at_ + head.length, open, depth + 1, elements.sequences[head.tag]);
    syntax_ = outside;
    return whole;
  }

  /// The fragments of packed pixels: items of known length up to the sequence end.
  bool take_fragments(size_t end, std::vector<std::string_view>& fragments) {
    for (Head item; this->head(end, item);) {
      if (item.tag == kSequenceEnd) return true;
      if (item.tag != kItem || item.length > end - at_) return false;
      fragments.push_back(bytes_.substr(at_, item.length));
      at_ += item.length;
    }
    return false;
  }

 private:
  template <class T>
  T number(size_t offset) const {
    return number_at<T>(bytes_.substr(at_ + offset), syntax_.big_endian);
  }

  bool take_items(size_t end, bool open, int depth, std::vector<DicomElements>& items) {
    while (open || at_ < end) {
      Head item;
      if (!head(end, item)) return false;
      if (open && item.tag == kSequenceEnd) return true;
      if (item.tag != kItem) return false;
      if (item.length != kUndefined && item.length > end - at_) return false;
      const bool open_item = item.length == kUndefined;
      items.emplace_back();
      items.back().big_endian = syntax_.big_endian;
      const size_t item_end = open_item ? end : at_ + item.length;
      if (!take_elements(item_end, open_item, depth, items.back())) return false;
    }
    return true;
  }

  bool take_elements(size_t end, bool open, int depth, DicomElements& elements) {
    while (open || at_ < end) {
      Head element;
      if (!head(end, element)) return false;
      if (open && element.tag == kItemEnd) return true;
      if (!take_value(element, end, depth, elements)) return false;
    }
    return true;
  }

  std::string_view bytes_;
  size_t at_;
  Syntax syntax_;
};

std::string_view without_padding(std::string_view value) {
  while (!value.empty() && value.back() == '\0') value.remove_suffix(1);
  return trimmed(value);
}

/// True if the element at the start of the bytes has the two letters of an explicit VR.
bool has_vr(std::string_view bytes) {
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  return bytes.size() >= 6 && is_capital(bytes[4]) && is_capital(bytes[5]);
}

/// The standard's name of how the file is written, and where its elements begin.
Result<std::string> transfer_syntax(const std::filesystem::path& file, std::string_view bytes,
                                    size_t start, size_t& data_at) {
  Walker walker(bytes, start, Syntax());
  // Where nothing names it, explicit VR shows in the letters of the first element.
  const bool is_explicit = has_vr(bytes.substr(start));
  std::string syntax = is_explicit ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
  bool is_named = false;
  // The group with number 2 describes the file and is always explicit little endian.
  while (walker.position() + 8 <= bytes.size() &&
         number_at<uint16_t>(bytes.substr(walker.position()), false) == 2) {
    Head head;
    DicomElements description;
    if (!walker.head(bytes.size(), head)) break;
    if (head.length == kUndefined || !walker.take_value(head, bytes.size(), 0, description)) {
      return bad_input(file, "is cut short or damaged: export it again");
    }
    if (head.tag != kTransferSyntax) continue;
    syntax = description.text(kTransferSyntax);
    is_named = true;
  }
  data_at = walker.position();
  if (!is_named && data_at > start)
    syntax = has_vr(bytes.substr(data_at)) ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
  return syntax;
}

/// Inflates a bare deflate stream; memory grows with its actual content.
Result<std::string> inflated(const std::filesystem::path& file, std::string_view packed) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK)
    return Error{ErrorKind::kOutOfMemory,
                 "There is not enough memory to unpack a file: close other programs"};
  const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, inflateEnd);
  std::string bytes;
  for (int state = Z_OK; state != Z_STREAM_END;) {
    const size_t done = bytes.size(), wanted = std::max(kFirstInflatedBytes, 2 * done);
    const Status fits = check_fits_memory(fmt::format("'{}'", file.string()), double(wanted));
    if (!fits) return fits.error();
    bytes.resize(wanted);
    // The counters of zlib are 32 bits wide.
    for (size_t at = done; at < wanted && state == Z_OK;) {
      const uInt room = uInt(std::min<size_t>(wanted - at, 1u << 30)),
                 given = uInt(std::min<size_t>(packed.size(), 1u << 30));
      stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + at);
      stream.avail_out = room;
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
      stream.avail_in = given;
      state = inflate(&stream, Z_NO_FLUSH);
      packed.remove_prefix(given - stream.avail_in);
      at += room - stream.avail_out;
      if (state == Z_STREAM_END) bytes.resize(at);
    }
    if (state != Z_OK && state != Z_STREAM_END)
      return bad_input(file, "is cut short or damaged where it is deflated: export it again");
  }
  return bytes;
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
  if (found->second.size() < sizeof(uint32_t))
    return int(number_at<uint16_t>(found->second, big_endian));
  const auto value = number_at<uint32_t>(found->second, big_endian);
  return value <= uint32_t(INT_MAX) ? std::optional(int(value)) : std::nullopt;
}

std::optional<double> DicomElements::real(uint32_t tag) const {
  const auto found = values.find(tag);
  if (found == values.end() || found->second.size() < sizeof(float)) return std::nullopt;
  const double value = found->second.size() < sizeof(double)
                           ? double(number_at<float>(found->second, big_endian))
                           : number_at<double>(found->second, big_endian);
  return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
}

std::vector<double> DicomElements::reals(uint32_t tag, size_t count) const {
  const auto found = values.find(tag);
  if (found == values.end() || found->second.size() != count * sizeof(double)) return {};
  std::vector<double> all;
  for (size_t n = 0; n < count; ++n)
    all.push_back(number_at<double>(found->second.substr(n * sizeof(double)), big_endian));
  const bool finite =
      std::all_of(all.begin(), all.end(), [](double v) { return std::isfinite(v); });
  return finite ? all : std::vector<double>();
}

std::optional<size_t> start_of_dicom(std::string_view bytes) {
  if (bytes.size() >= kPreambleBytes && bytes.substr(128, 4) == "DICM") return kPreambleBytes;
  // Without a preamble: an element of the first groups, in explicit VR or with a short length.
  if (bytes.size() < kPreambleBytes) return std::nullopt;
  const auto group = number_at<uint16_t>(bytes, false);
  const auto element = number_at<uint16_t>(bytes.substr(2), false);
  const auto length = number_at<uint32_t>(bytes.substr(4), false);
  const bool is_first = (group == 2 && element <= 0x0102) || (group == 8 && element <= 0x0060);
  const bool is_plausible = has_vr(bytes) || (group == 8 && length <= 128 && length % 2 == 0);
  return is_first && is_plausible ? std::optional<size_t>(0) : std::nullopt;
}

Result<DicomElements> parse_dicom(const std::filesystem::path& file, std::string_view bytes) {
  const auto start = start_of_dicom(bytes);
  if (!start) return bad_input(file, "is no DICOM file: check what wrote it");
  size_t at = 0;
  const auto name = transfer_syntax(file, bytes, *start, at);
  if (!name) return name.error();
  const Syntax syntax{.explicit_vr = *name != "1.2.840.10008.1.2",
                      .big_endian = *name == "1.2.840.10008.1.2.2"};
  DicomElements elements;
  elements.syntax = *name;
  elements.big_endian = syntax.big_endian;
  if (*name == "1.2.840.10008.1.2.1.99") {
    auto all = inflated(file, bytes.substr(at));
    if (!all) return all.error();
    elements.inflated = std::make_shared<const std::string>(std::move(*all));
    bytes = *elements.inflated;
    at = 0;
  }
  Walker walker(bytes, at, syntax);
  while (walker.position() < bytes.size()) {
    Head head;
    if (!walker.head(bytes.size(), head)) return bad_input(file, "is cut short: export it again");
    const bool is_real = head.tag == tags::kFloatPixels || head.tag == tags::kDoublePixels;
    if (head.tag == kPixels || is_real) {
      elements.has_pixels = true;
      elements.has_real_pixels = is_real;
      elements.is_packed = head.length == kUndefined;
      elements.has_word_pixels = head.is_words;
      const bool whole = elements.is_packed
                             ? walker.take_fragments(bytes.size(), elements.fragments)
                             : head.length <= bytes.size() - walker.position();
      if (!whole) return bad_input(file, "is cut short within its pixels: export it again");
      if (!elements.is_packed) elements.pixels = bytes.substr(walker.position(), head.length);
      return elements;
    }
    if (!walker.take_value(head, bytes.size(), 0, elements))
      return bad_input(file, "is cut short or damaged: export it again");
  }
  return elements;
}

}  // namespace palpate::files
