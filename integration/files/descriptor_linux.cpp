#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "integration/files/atomic_file.h"
#include "integration/files/descriptor.h"

namespace palpate::files {

namespace fs = std::filesystem;

int open_to_read(const fs::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
}

int create_new(const fs::path& path) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
}

int64_t read_some(int fd, void* to, size_t n) {
  return ::read(fd, to, n);
}

int64_t write_some(int fd, const void* from, size_t n) {
  return ::write(fd, from, n);
}

bool seek(int fd, int64_t offset, SeekFrom from) {
  const int whence = from == SeekFrom::kStart  ? SEEK_SET
                     : from == SeekFrom::kHere ? SEEK_CUR
                                               : SEEK_END;
  return ::lseek(fd, off_t(offset), whence) >= 0;
}

bool close_descriptor(int fd) {
  return ::close(fd) == 0;
}

void expect_in_order(int fd) {
  ::posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
}

bool sync_to_disk(int fd) {
  return ::fsync(fd) == 0;
}

void sync_folder(const fs::path& folder) {
  const int fd = open_folder(folder);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

bool rename_over(const fs::path& from, const fs::path& to) {
  return ::rename(from.c_str(), to.c_str()) == 0;
}

void remove_quietly(const fs::path& path) {
  ::unlink(path.c_str());
}

bool was_removed(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && status.st_nlink == 0;
}

std::optional<FileId> file_id(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileId{status.st_dev, status.st_ino};
}

bool copy_permissions(const fs::path& from, int fd) {
  struct stat old {};
  return ::stat(from.c_str(), &old) != 0 || ::fchmod(fd, old.st_mode & 07777) == 0;
}

int open_folder(const fs::path& folder) {
  return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

bool is_terminal(int fd) {
  return ::isatty(fd) == 1;
}

int process_id() {
  return ::getpid();
}

bool lock_as_alive(int fd) {
  return ::flock(fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

bool is_abandoned(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return false;
  const bool free = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  ::close(fd);
  return free;
}

}  // namespace palpate::files
