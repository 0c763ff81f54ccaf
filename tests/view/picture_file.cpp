#include "tests/view/picture_file.h"

#include <zlib.h>

#include <fstream>
#include <sstream>

namespace palpate::test {
namespace {

void append_number(std::string& out, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(char(value >> shift & 255U));
}

std::string chunk(const std::string& kind, const std::string& content) {
  std::string out;
  append_number(out, uint32_t(content.size()));
  const std::string body = kind + content;
  out += body;
  append_number(out,
                uint32_t(crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()))));
  return out;
}

}  // namespace

bool write_png(const Picture& picture, const std::string& path) {
  std::string rows;
  for (int y = 0; y < picture.height; ++y) {
    rows.push_back(0);  // no filter
    for (int x = 0; x < picture.width; ++x) {
      const uint32_t c = picture.colours[size_t(y) * size_t(picture.width) + size_t(x)];
      for (int shift = 0; shift < 24; shift += 8) rows.push_back(char(c >> shift & 255U));
    }
  }
  std::string packed(compressBound(uLong(rows.size())), '\0');
  uLongf bytes = uLongf(packed.size());
  if (compress(reinterpret_cast<Bytef*>(packed.data()), &bytes,
               reinterpret_cast<const Bytef*>(rows.data()), uLong(rows.size())) != Z_OK)
    return false;
  packed.resize(bytes);
  std::string header;
  append_number(header, uint32_t(picture.width));
  append_number(header, uint32_t(picture.height));
  header += std::string("\x08\x02\x00\x00\x00", 5);
  std::ofstream file(path, std::ios::binary);
  file << "\x89PNG\r\n\x1a\n"
       << chunk("IHDR", header) << chunk("IDAT", packed) << chunk("IEND", "");
  return bool(file);
}

std::optional<Picture> read_png(const std::string& path) {
  std::ostringstream all;
  all << std::ifstream(path, std::ios::binary).rdbuf();
  const std::string bytes = all.str();
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    for (size_t k = 0; k < 4; ++k) value = value << 8 | uint8_t(bytes[at + k]);
    return value;
  };
  // Signature, IHDR (13 bytes), IDAT, IEND, as write_png() puts them.
  constexpr size_t kHeader = 16, kData = 33;
  if (bytes.size() < kData + 8 || bytes.compare(kData + 4, 4, "IDAT") != 0) return std::nullopt;
  Picture picture{int(number(kHeader)), int(number(kHeader + 4)), {}, {}};
  const size_t row = 1 + 3 * size_t(picture.width);
  std::string rows(row * size_t(picture.height), '\0');
  uLongf length = uLongf(rows.size());
  const uint32_t packed = number(kData);
  if (bytes.size() < kData + 8 + packed ||
      uncompress(reinterpret_cast<Bytef*>(rows.data()), &length,
                 reinterpret_cast<const Bytef*>(bytes.data() + kData + 8), packed) != Z_OK ||
      length != rows.size())
    return std::nullopt;
  for (size_t y = 0; y < size_t(picture.height); ++y)
    for (size_t x = 0; x < size_t(picture.width); ++x) {
      uint32_t colour = 0xff000000U;
      for (size_t c = 0; c < 3; ++c)
        colour |= uint32_t(uint8_t(rows[y * row + 1 + 3 * x + c])) << (8 * c);
      picture.colours.push_back(colour);
    }
  return picture;
}

}  // namespace palpate::test
