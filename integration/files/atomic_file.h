#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "compute/volume/result.h"

namespace palpate::files {

/// A file that appears whole or not at all: bytes go to a hidden temporary file in the same folder,
/// which takes the name only after everything has reached the disk. Without commit() nothing stays
/// behind, and what was there before is untouched. Move-only; one thread at a time.
class AtomicFile {
 public:
  /// kBadOutput if the folder is missing or can not be written, or the path is a folder or a
  /// device.
  static Result<AtomicFile> create(const std::filesystem::path& path);

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// kBadOutput if the disk is full or fails; the temporary file is gone then, and later calls fail
  /// too.
  Status write(const void* bytes, size_t n);

  /// Flushes to the disk and takes the final name, replacing what was there. kBadOutput as write().
  Status commit();

 private:
  AtomicFile() = default;
  Error fail(int error_number);
  void discard();

  std::filesystem::path path_;       ///< as the caller named it, for messages
  std::filesystem::path target_;     ///< what is replaced: path_ with links followed
  std::filesystem::path temporary_;  ///< empty once it is gone
  int fd_ = -1;
};

/// Writes a whole text file atomically.
Status write_text(const std::filesystem::path& path, std::string_view text);

/// To be asked before long work: can this file be written? Leaves nothing behind and touches no
/// existing file. With `bytes`, also whether the disk has room for that much. kBadOutput with a
/// sentence otherwise. Any thread.
Status check_can_write_file(const std::filesystem::path& path, double bytes = 0.0);

/// The same for a folder of outputs, which need not exist yet: then its nearest existing parent is
/// asked.
Status check_can_write_folder(const std::filesystem::path& folder, double bytes = 0.0);

}  // namespace palpate::files
