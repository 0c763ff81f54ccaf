#include "integration/openigtlink/message.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace palpate::openigtlink {
namespace {

constexpr size_t kImageHeaderBytes = 72, kTransformBytes = 48, kExtendedBytes = 12;
constexpr size_t kWholeSizeAt = 6;       // in an image's header
constexpr double kAxesTolerance = 1e-3;  // of unit length and right angles: float32 on the wire
constexpr double kFarthest_mm = 1e4;

Error bad(std::string sentence) {
  return {ErrorKind::kBadInput, std::move(sentence)};
}

/// Reads numbers one after the other; the caller has checked that there are enough bytes.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  template <class T>
  T number() {
    T value = 0;
    for (size_t b = 0; b < sizeof(T); ++b) value = T(value << 8) | T(bytes_[at_ + b]);
    at_ += sizeof(T);
    return value;
  }
  uint8_t byte() { return uint8_t(bytes_[at_++]); }
  double real() { return double(std::bit_cast<float>(number<uint32_t>())); }
  std::string text(size_t most) {
    std::string text;
    for (size_t b = 0; b < most && bytes_[at_ + b] != std::byte{0}; ++b)
      text += char(bytes_[at_ + b]);
    at_ += most;
    return text;
  }

 private:
  std::span<const std::byte> bytes_;
  size_t at_ = 0;
};

class Writer {
 public:
  template <class T>
  void number(T value) {
    for (size_t b = sizeof(T); b-- > 0;) bytes.push_back(std::byte(uint8_t(value >> (8 * b))));
  }
  void byte(int value) { bytes.push_back(std::byte(uint8_t(value))); }
  void real(double value) { number(std::bit_cast<uint32_t>(float(value))); }
  void text(const std::string& text, size_t size) {
    for (size_t b = 0; b < size; ++b) byte(b < text.size() && b + 1 < size ? text[b] : 0);
  }
  Bytes bytes;
};

/// For messages: characters that could end a line or move a cursor become '?'.
std::string printable(std::string text) {
  for (char& c : text)
    if (c < 0x20 || c > 0x7e) c = '?';
  return text;
}

glm::dvec3 lps_from_ras(glm::dvec3 ras) {
  return {-ras.x, -ras.y, ras.z};
}

glm::dmat3 lps_from_ras(const glm::dmat3& columns) {
  return {lps_from_ras(columns[0]), lps_from_ras(columns[1]), lps_from_ras(columns[2])};
}

bool is_finite(const glm::dmat3& columns, glm::dvec3 place) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      if (!std::isfinite(columns[c][r]) || !std::isfinite(place[c])) return false;
  return true;
}

/// Orthogonal columns of length 1, exactly, from those that are nearly so.
std::optional<glm::dmat3> squared_up(const glm::dmat3& axes) {
  for (int c = 0; c < 3; ++c) {
    if (std::abs(glm::length(axes[c]) - 1.0) > kAxesTolerance) return std::nullopt;
    if (std::abs(glm::dot(axes[c], axes[(c + 1) % 3])) > kAxesTolerance) return std::nullopt;
  }
  const glm::dvec3 i = glm::normalize(axes[0]);
  const glm::dvec3 j = glm::normalize(axes[1] - i * glm::dot(i, axes[1]));
  const glm::dvec3 k = glm::cross(i, j);
  return glm::dmat3(i, j, glm::dot(k, axes[2]) < 0.0 ? -k : k);
}

size_t bytes_of_scalar(int type) {
  switch (type) {
    case 2:
    case 3:
      return 1;
    case 4:
    case 5:
      return 2;
    case 6:
    case 7:
    case 10:
      return 4;
    case 11:
      return 8;
    default:
      return 0;
  }
}

template <class Bits, class T>
void take_values(std::span<const std::byte> from, bool little, std::vector<float>& to) {
  for (size_t v = 0; v < to.size(); ++v) {
    Bits bits = 0;
    for (size_t b = 0; b < sizeof(Bits); ++b)
      bits = Bits(Bits(bits) | Bits(Bits(from[v * sizeof(Bits) + b])
                                    << (8 * (little ? b : sizeof(Bits) - 1 - b))));
    to[v] = float(std::bit_cast<T>(bits));
  }
}

void take_values(int type, std::span<const std::byte> from, bool little, std::vector<float>& to) {
  switch (type) {
    case 2:
      return take_values<uint8_t, int8_t>(from, little, to);
    case 3:
      return take_values<uint8_t, uint8_t>(from, little, to);
    case 4:
      return take_values<uint16_t, int16_t>(from, little, to);
    case 5:
      return take_values<uint16_t, uint16_t>(from, little, to);
    case 6:
      return take_values<uint32_t, int32_t>(from, little, to);
    case 7:
      return take_values<uint32_t, uint32_t>(from, little, to);
    case 10:
      return take_values<uint32_t, float>(from, little, to);
    default:
      return take_values<uint64_t, double>(from, little, to);
  }
}

/// The whole message: its header depends on the body.
Bytes message(const std::string& type, const std::string& device, double time_s,
              const Bytes& body) {
  Writer out;
  out.number(uint16_t(1));
  out.text(type, 12);
  out.text(device, 20);
  const double seconds = std::floor(std::max(time_s, 0.0));
  out.number(uint32_t(seconds));
  out.number(uint32_t((std::max(time_s, 0.0) - seconds) * 4294967296.0));
  out.number(uint64_t(body.size()));
  out.number(crc64(body));
  out.bytes.insert(out.bytes.end(), body.begin(), body.end());
  return std::move(out.bytes);
}

/// An image with so many float32 per sample.
Bytes image_message(const std::string& device, double time_s, const Grid& grid,
                    std::span<const float> values, int components) {
  Writer out;
  out.number(uint16_t(1));
  out.byte(components);
  out.byte(10);  // float32
  out.byte(2);   // little-endian
  out.byte(1);   // RAS
  for (int a = 0; a < 3; ++a) out.number(uint16_t(grid.size[a]));
  for (int c = 0; c < 3; ++c) {
    const glm::dvec3 axis = lps_from_ras(grid.direction[c] * grid.spacing_mm[c]);
    for (int r = 0; r < 3; ++r) out.real(axis[r]);
  }
  const glm::dvec3 centre = lps_from_ras(grid.lps_from_index(0.5 * glm::dvec3(grid.size - 1)));
  for (int r = 0; r < 3; ++r) out.real(centre[r]);
  for (int a = 0; a < 3; ++a) out.number(uint16_t(0));
  for (int a = 0; a < 3; ++a) out.number(uint16_t(grid.size[a]));
  static_assert(std::endian::native == std::endian::little);
  const std::span<const std::byte> raw = std::as_bytes(values);
  out.bytes.insert(out.bytes.end(), raw.begin(), raw.end());
  return message("IMAGE", device, time_s, out.bytes);
}

/// The header of an IMAGE as it is sent.
struct ImageFields {
  int components = 0, scalar_type = 0, endian = 0, coordinates = 0;
  glm::ivec3 whole, first, size;  ///< samples of the image, and of the part that was sent
  glm::dmat3 columns;             ///< from one sample to the next, mm
  glm::dvec3 centre;              ///< of the whole image, mm
};

ImageFields image_fields(std::span<const std::byte> content) {
  ImageFields fields;
  Reader in(content);
  in.number<uint16_t>();  // of the image's format: 1 or 2, of one layout
  fields.components = in.byte(), fields.scalar_type = in.byte();
  fields.endian = in.byte(), fields.coordinates = in.byte();
  for (int a = 0; a < 3; ++a) fields.whole[a] = in.number<uint16_t>();
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) fields.columns[c][r] = in.real();
  for (int r = 0; r < 3; ++r) fields.centre[r] = in.real();
  for (int a = 0; a < 3; ++a) fields.first[a] = in.number<uint16_t>();
  for (int a = 0; a < 3; ++a) fields.size[a] = in.number<uint16_t>();
  return fields;
}

/// Whether the samples are such as can be felt, and all there.
Status check_samples(const ImageFields& is, size_t bytes_sent) {
  if (is.components != 1)
    return bad(fmt::format("An IMAGE has {} values per sample: only one, a grey value, can be felt",
                           is.components));
  const size_t scalar_bytes = bytes_of_scalar(is.scalar_type);
  if (scalar_bytes == 0)
    return bad(
        fmt::format("An IMAGE has the scalar type {}, which does not exist", is.scalar_type));
  if (is.endian != 1 && is.endian != 2)
    return bad(fmt::format("An IMAGE has the endianness {}, which does not exist", is.endian));
  // Old senders leave the byte at 0.
  if (is.coordinates < 0 || is.coordinates > 2)
    return bad(
        fmt::format("An IMAGE has the coordinate system {}, which does not exist", is.coordinates));
  for (int a = 0; a < 3; ++a) {
    if (is.whole[a] < 2 || is.whole[a] > kMostSamplesPerAxis)
      return bad(
          fmt::format("An IMAGE has {} x {} x {} samples: from 2 to {} along each axis can "
                      "be felt",
                      is.whole.x, is.whole.y, is.whole.z, kMostSamplesPerAxis));
    if (is.size[a] < 1 || is.first[a] + is.size[a] > is.whole[a])
      return bad("The part of the IMAGE that was sent does not lie within it");
  }
  const size_t count = size_t(is.size.x) * size_t(is.size.y) * size_t(is.size.z);
  if (bytes_sent != count * scalar_bytes)
    return bad(fmt::format("An IMAGE of {} x {} x {} samples has {} bytes of them instead of {}",
                           is.size.x, is.size.y, is.size.z, bytes_sent, count * scalar_bytes));
  return Nothing{};
}

/// Where the image is: its grid in LPS.
Status place_grid(ImageFields is, ImageMessage& image) {
  if (!is_finite(is.columns, is.centre)) return bad("The matrix of an IMAGE is not finite");
  if (is.coordinates != 2) {
    is.columns = lps_from_ras(is.columns);
    is.centre = lps_from_ras(is.centre);
  }
  for (int c = 0; c < 3; ++c) {
    const double length = glm::length(is.columns[c]);
    if (!(length > 1e-4 && length < 1e3))
      return bad(fmt::format("An IMAGE has samples {:.3g} mm apart, which can not be", length));
    image.grid.spacing_mm[c] = length;
    is.columns[c] /= length;
  }
  if (glm::length(is.centre) > kFarthest_mm) return bad("An IMAGE lies farther away than 10 m");
  const auto axes = squared_up(is.columns);
  if (!axes) return bad("The axes of an IMAGE are not at right angles");
  image.grid.direction = *axes;
  // The wire gives the middle of the image, a Grid begins at its first sample.
  const glm::dvec3 half = 0.5 * glm::dvec3(is.whole - 1) * image.grid.spacing_mm;
  if (glm::determinant(*axes) < 0.0) {
    image.j_reversed = true;
    image.grid.direction[1] = -image.grid.direction[1];
    image.grid.j_reversed_in_file = true;
  }
  image.grid.origin_mm = is.centre - image.grid.direction * half;
  return Nothing{};
}

}  // namespace

uint64_t crc64(std::span<const std::byte> bytes) {
  static const std::array<uint64_t, 256> table = [] {
    std::array<uint64_t, 256> made{};
    for (uint64_t n = 0; n < 256; ++n) {
      uint64_t sum = n << 56;
      for (int bit = 0; bit < 8; ++bit)
        sum = (sum << 1) ^ ((sum >> 63) ? 0x42F0E1EBA9EA3693ULL : 0);
      made[n] = sum;
    }
    return made;
  }();
  uint64_t sum = 0;
  for (const std::byte b : bytes) sum = table[(sum >> 56) ^ uint64_t(b)] ^ (sum << 8);
  return sum;
}

Result<Header> read_header(std::span<const std::byte, kHeaderBytes> bytes) {
  Reader in(bytes);
  Header header;
  header.version = in.number<uint16_t>();
  header.type = printable(in.text(12));
  header.device = printable(in.text(20));
  const uint32_t seconds = in.number<uint32_t>();
  header.time_s = double(seconds) + double(in.number<uint32_t>()) / 4294967296.0;
  header.body_bytes = in.number<uint64_t>();
  header.crc = in.number<uint64_t>();
  if (header.version < 1 || header.version > 3)
    return bad(
        fmt::format("The other side does not speak OpenIGTLink 1 to 3 (a message says "
                    "version {}): is it the right port?",
                    header.version));
  if (header.type.empty() || !std::all_of(header.type.begin(), header.type.end(), [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
      }))
    return bad("A message has no type that could be one: is it OpenIGTLink, and the right port?");
  if (header.body_bytes > kLargestBody)
    return bad(fmt::format("A message {} claims {} bytes, and at most {} are taken in", header.type,
                           header.body_bytes, kLargestBody));
  if (header.type == "TRANSFORM" && header.body_bytes > (1 << 20))
    return bad(fmt::format("A TRANSFORM claims {} bytes: the stream is broken", header.body_bytes));
  return header;
}

Result<std::span<const std::byte>> content_of(const Header& header, std::span<const std::byte> body,
                                              bool accepts_no_crc) {
  const bool has_none = accepts_no_crc && header.crc == 0;
  if (!has_none && crc64(body) != header.crc)
    return bad(fmt::format("A message {} was damaged on its way (its CRC is wrong)", header.type));
  if (header.version == 1) return body;
  if (body.size() < kExtendedBytes)
    return bad(fmt::format("A message {} of version {} has no extended header", header.type,
                           header.version));
  Reader in(body);
  const uint64_t extended = in.number<uint16_t>(), meta_header = in.number<uint16_t>(),
                 meta = in.number<uint32_t>();
  if (extended < kExtendedBytes || extended + meta_header + meta > body.size())
    return bad(fmt::format("The sizes in a message {} of version {} do not fit its body",
                           header.type, header.version));
  return body.subspan(extended, body.size() - extended - meta_header - meta);
}

std::optional<glm::ivec3> flat_size(std::span<const std::byte> content) {
  if (content.size() < kImageHeaderBytes) return std::nullopt;
  Reader in(content.subspan(kWholeSizeAt));
  glm::ivec3 whole;
  for (int a = 0; a < 3; ++a) whole[a] = in.number<uint16_t>();
  const bool flat = std::min({whole.x, whole.y, whole.z}) == 1;
  return flat ? std::optional(whole) : std::nullopt;
}

Result<ImageMessage> read_image(std::span<const std::byte> content) {
  if (content.size() < kImageHeaderBytes) return bad("An IMAGE ends before its own header does");
  const ImageFields is = image_fields(content);
  const auto samples = content.subspan(kImageHeaderBytes);
  if (const Status good = check_samples(is, samples.size()); !good) return good.error();
  ImageMessage image;
  image.is_ras_assumed = is.coordinates == 0;
  image.grid.size = is.whole;
  image.first = is.first;
  image.size = is.size;
  if (const Status placed = place_grid(is, image); !placed) return placed.error();
  image.values.resize(size_t(is.size.x) * size_t(is.size.y) * size_t(is.size.z));
  take_values(is.scalar_type, samples, is.endian == 2, image.values);
  if (!std::all_of(image.values.begin(), image.values.end(),
                   [](float value) { return std::isfinite(value); }))
    return bad("An IMAGE has values that are not finite");
  return image;
}

Result<Rigid> read_transform(std::span<const std::byte> content) {
  if (content.size() != kTransformBytes)
    return bad(
        fmt::format("A TRANSFORM has {} bytes instead of {}", content.size(), kTransformBytes));
  Reader in(content);
  glm::dmat3 columns;
  glm::dvec3 way;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) columns[c][r] = in.real();
  for (int r = 0; r < 3; ++r) way[r] = in.real();
  if (!is_finite(columns, way)) return bad("A TRANSFORM is not finite");
  if (glm::length(way) > kFarthest_mm)
    return bad("A TRANSFORM has a translation of more than 10 m");
  const auto axes = squared_up(columns);
  if (!axes || glm::determinant(*axes) < 0.0)
    return bad(
        "A TRANSFORM scales, shears or mirrors: only a rotation and a translation can be followed");
  // Both sides are LPS here: R' = S R S with S = diag(-1, -1, 1).
  const glm::dmat3 s(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1));
  return Rigid{s * *axes * s, s * way};
}

Bytes write_image(const std::string& device, double time_s, const Grid& grid,
                  std::span<const float> values) {
  return image_message(device, time_s, grid, values, 1);
}

Bytes write_image(const std::string& device, double time_s, const Grid& grid,
                  std::span<const glm::vec3> vectors) {
  std::vector<float> ras;
  ras.reserve(3 * vectors.size());
  for (const glm::vec3& v : vectors) ras.insert(ras.end(), {-v.x, -v.y, v.z});
  return image_message(device, time_s, grid, ras, 3);
}

Bytes write_transform(const std::string& device, double time_s, const Rigid& rigid) {
  const glm::dmat3 s(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1));
  const glm::dmat3 rotation = s * rigid.rotation * s;
  const glm::dvec3 way = s * rigid.translation_mm;
  Writer out;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) out.real(rotation[c][r]);
  for (int r = 0; r < 3; ++r) out.real(way[r]);
  return message("TRANSFORM", device, time_s, out.bytes);
}

Bytes write_force(const std::string& device, double time_s, glm::dvec3 force_n) {
  Writer out;
  out.byte(3);                               // numbers
  out.byte(0);                               // status
  out.number(uint64_t(0x02C4000000000000));  // newton, in OpenIGTLink's coding of units
  for (const double n : {-force_n.x, -force_n.y, force_n.z}) out.number(std::bit_cast<uint64_t>(n));
  return message("SENSOR", device, time_s, out.bytes);
}

Bytes write_status(const std::string& device, double time_s, int code, const std::string& text) {
  Writer out;
  out.number(uint16_t(code));
  out.number(uint64_t(0));
  out.text(code == 1 ? "" : "NotReady", 20);
  for (const char c : text.substr(0, 200)) out.byte(c);
  out.byte(0);
  return message("STATUS", device, time_s, out.bytes);
}

}  // namespace palpate::openigtlink
