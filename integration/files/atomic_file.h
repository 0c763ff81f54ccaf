#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "compute/volume/result.h"

namespace palpate::files {

/// The names of hidden folders for outputs that are not whole yet begin so.
inline constexpr std::string_view kHiddenFolder = ".palpate-";

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

/// The file that a path leads to when all links are followed, the last one too, also if that file
/// does not exist yet. A path that is no link is returned as it is.
std::filesystem::path behind_links(const std::filesystem::path& path);

/// Gives a finished file another name, on another disk if need be. `to` may be a link: it stays
/// one, and what it leads to is replaced. kBadOutput; then `from` may still be there.
Status replace_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// Writes a whole text file atomically.
Status write_text(const std::filesystem::path& path, std::string_view text);

/// Takes an exclusive lock on an open file or folder until it is closed, as a sign that its process
/// lives. False if another process has it. True where the file system knows no locks.
bool lock_as_alive(int fd);

/// Removes the temporary files and folders of palpate in `folder` whose process has ended without
/// clearing them away (kill -9, a power cut). Those of living processes stay.
void remove_abandoned(const std::filesystem::path& folder);

/// For before long work: whether this file can be written. Removes what ended processes left in its
/// folder, leaves nothing behind itself and touches no existing file. With `bytes`, also whether
/// the disk has room for that much. kBadOutput with a sentence otherwise. Any thread.
Status check_can_write_file(const std::filesystem::path& path, double bytes = 0.0);

/// The same for a folder of outputs, which need not exist yet: then its nearest existing parent is
/// asked.
Status check_can_write_folder(const std::filesystem::path& folder, double bytes = 0.0);

}  // namespace palpate::files
