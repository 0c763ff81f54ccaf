#include "tests/view/picture_file.h"

#include <zlib.h>

#include <fstream>

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

}  // namespace palpate::test
