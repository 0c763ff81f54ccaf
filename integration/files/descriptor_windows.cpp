#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <share.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include "integration/files/atomic_file.h"
#include "integration/files/descriptor.h"

namespace palpate::files {
namespace {

/// The runtime takes and gives counts of 32 bits.
constexpr size_t kMostBytes = size_t(1) << 30;

void set_errno_from_windows() {
  switch (GetLastError()) {
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_WRITE_PROTECT:
      errno = EACCES;
      break;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
      errno = ENOSPC;
      break;
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
      errno = ENOENT;
      break;
    case ERROR_NOT_SAME_DEVICE:
      errno = EXDEV;
      break;
    default:
      errno = EIO;
  }
}

}  // namespace

namespace fs = std::filesystem;

int open_to_read(const fs::path& path) {
  return _wsopen(path.c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT, _SH_DENYNO);
}

int create_new(const fs::path& path) {
  return _wsopen(path.c_str(), _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT,
                 _SH_DENYNO, _S_IREAD | _S_IWRITE);
}

int64_t read_some(int fd, void* to, size_t n) {
  return _read(fd, to, unsigned(std::min(n, kMostBytes)));
}

int64_t write_some(int fd, const void* from, size_t n) {
  return _write(fd, from, unsigned(std::min(n, kMostBytes)));
}

bool seek(int fd, int64_t offset, SeekFrom from) {
  const int whence = from == SeekFrom::kStart  ? SEEK_SET
                     : from == SeekFrom::kHere ? SEEK_CUR
                                               : SEEK_END;
  return _lseeki64(fd, offset, whence) >= 0;
}

bool close_descriptor(int fd) {
  return _close(fd) == 0;
}

void expect_in_order(int) {}

bool sync_to_disk(int fd) {
  return _commit(fd) == 0;
}

// rename_over() writes through.
void sync_folder(const fs::path&) {}

bool rename_over(const fs::path& from, const fs::path& to) {
  if (MoveFileExW(from.c_str(), to.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH))
    return true;
  set_errno_from_windows();
  return false;
}

void remove_quietly(const fs::path& path) {
  DeleteFileW(path.c_str());
}

// An open file keeps its name here.
bool was_removed(int) {
  return false;
}

std::optional<FileId> file_id(const fs::path& path) {
  // Asks for no right to read it. FILE_FLAG_BACKUP_SEMANTICS: folders, too.
  const HANDLE file =
      CreateFileW(path.c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                  OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  if (file == INVALID_HANDLE_VALUE) return std::nullopt;
  BY_HANDLE_FILE_INFORMATION about{};
  const bool known = GetFileInformationByHandle(file, &about);
  CloseHandle(file);
  if (!known) return std::nullopt;
  return FileId{about.dwVolumeSerialNumber,
                uint64_t(about.nFileIndexHigh) << 32 | about.nFileIndexLow};
}

// A new file has those of its folder.
bool copy_permissions(const fs::path&, int) {
  return true;
}

int open_folder(const fs::path& folder) {
  const HANDLE open = CreateFileW(folder.c_str(), GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE,
                                  nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  return open == INVALID_HANDLE_VALUE ? -1 : _open_osfhandle(intptr_t(open), _O_RDONLY);
}

bool is_terminal(int fd) {
  if (!_isatty(fd)) return false;
  // Consoles of Windows 10 understand the codes that move the cursor once they are asked to.
  const auto console = HANDLE(_get_osfhandle(fd));
  DWORD mode = 0;
  return GetConsoleMode(console, &mode) &&
         SetConsoleMode(console, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
}

int process_id() {
  return _getpid();
}

// To have it open is lock enough.
bool lock_as_alive(int) {
  return true;
}

bool is_abandoned(const fs::path& path) {
  // FILE_FLAG_BACKUP_SEMANTICS: folders, too.
  const HANDLE alone = CreateFileW(path.c_str(), GENERIC_READ, 0, nullptr, OPEN_EXISTING,
                                   FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  if (alone == INVALID_HANDLE_VALUE) return false;
  CloseHandle(alone);
  return true;
}

}  // namespace palpate::files
