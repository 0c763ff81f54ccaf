#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "integration/files/raster/mapped_file.h"
#include "integration/files/sentences.h"

namespace palpate::files {

Result<MappedFile> MappedFile::open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat info {};
  if (fd < 0 || ::fstat(fd, &info) != 0) {
    const int cause = errno;
    if (fd >= 0) ::close(fd);
    return bad_input(path, "can not be opened ({}): check its name and the permissions",
                     std::strerror(cause));
  }
  if (info.st_size <= 0) {
    ::close(fd);
    return bad_input(path, "is empty: copy or export it again");
  }
  void* const bytes = ::mmap(nullptr, size_t(info.st_size), PROT_READ, MAP_PRIVATE, fd, 0);
  const int cause = errno;
  ::close(fd);
  if (bytes == MAP_FAILED)
    return bad_input(path, "can not be read ({}): check the disk", std::strerror(cause));
  MappedFile file;
  file.bytes_ = {static_cast<const char*>(bytes), size_t(info.st_size)};
  return file;
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

}  // namespace palpate::files
