#include "tests/files/raster/packed.h"

#include <zlib.h>

#include <stdexcept>

namespace palpate::files {

std::string gzip(std::string_view bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("zlib");
  std::string packed(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string gzip_of_length(std::string_view bytes, size_t length) {
  z_stream stream{};
  if (deflateInit2(&stream, 0, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("zlib");
  const auto pack = [&](gz_header& header) {
    deflateReset(&stream);
    deflateSetHeader(&stream, &header);
    std::string packed(bytes.size() + bytes.size() / 1000 + 200'000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = uInt(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = uInt(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    return packed;
  };
  gz_header header{};
  Bytef none = 0;
  header.extra = &none;
  const size_t plain = pack(header).size();
  std::string filling(length < plain ? 0 : length - plain, '\0');
  header.extra = reinterpret_cast<Bytef*>(filling.data());
  header.extra_len = uInt(filling.size());
  std::string packed = pack(header);
  deflateEnd(&stream);
  if (packed.size() != length) throw std::runtime_error("a member can not be so long");
  return packed;
}

}  // namespace palpate::files
