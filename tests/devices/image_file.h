#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace palpate::devices::test {

/// Bytes that are no firmware, but are uploaded in the same way.
inline std::vector<uint8_t> made_image(size_t bytes) {
  std::vector<uint8_t> image(bytes);
  for (size_t n = 0; n < bytes; ++n) image[n] = uint8_t(31 * n + n / 256 + 7);
  return image;
}

/// A file of these bytes; removed at the end.
class ImageFile {
 public:
  explicit ImageFile(std::vector<uint8_t> image)
      : bytes_(std::move(image)),
        path_(std::filesystem::temp_directory_path() /
              ("palpate_image_" + std::to_string(getpid()) + ".bin")) {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes_.data()), std::streamsize(bytes_.size()));
  }
  ~ImageFile() { std::filesystem::remove(path_); }
  ImageFile(const ImageFile&) = delete;
  ImageFile& operator=(const ImageFile&) = delete;

  std::string path() const { return path_; }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
  std::filesystem::path path_;
};

}  // namespace palpate::devices::test
