#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::files {

/// The bytes of several files one after the other, unpacked on the way if they are a zlib or gzip
/// stream, or written in hexadecimal digits. One thread.
class ByteSource {
 public:
  struct Options {
    bool deflate = false;
    bool hex = false;
    uint64_t file_skip = 0;   ///< bytes to leave out at the start of each file
    uint64_t line_skip = 0;   ///< lines to leave out of each file to leave out after that
    uint64_t last_bytes = 0;  ///< if not 0: only the last so many bytes of each file count
  };

  /// kBadInput if the first file can not be opened.
  static Result<ByteSource> open(std::vector<std::filesystem::path> paths, Options options);

  ByteSource(ByteSource&&) noexcept;
  ByteSource& operator=(ByteSource&&) noexcept;
  ~ByteSource();

  /// Reads n bytes, fewer only at the end of the data. kBadInput if a file can not be read or
  /// unpacked.
  Result<size_t> read(void* to, size_t n);

  /// Leaves n bytes out; returns how many there were. Fast where nothing has to be unpacked.
  Result<uint64_t> skip(uint64_t n);

 private:
  struct State;
  explicit ByteSource(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace palpate::files
