#pragma once

#include <filesystem>
#include <string_view>
#include <utility>

#include "compute/volume/result.h"

namespace palpate::files {

/// A file's bytes, of which only the parts that are accessed are read. Move-only; any thread.
class MappedFile {
 public:
  /// kBadInput if the file is missing, empty or can not be read.
  static Result<MappedFile> open(const std::filesystem::path& path);

  MappedFile(MappedFile&& other) noexcept : bytes_(std::exchange(other.bytes_, {})) {}
  MappedFile& operator=(MappedFile&& other) noexcept {
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~MappedFile();

  std::string_view bytes() const { return bytes_; }

 private:
  MappedFile() = default;
  std::string_view bytes_;
};

}  // namespace palpate::files
