#include "integration/files/atomic_file.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <vector>

#include "compute/volume/memory.h"
#include "integration/files/descriptor.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;

/// Some file systems refuse a single write of more than 2 GiB.
constexpr size_t kMaxWriteBytes = size_t(1) << 30;

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Unique within the process by the counter and among processes by the id.
fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  return folder_of(target) /
         fmt::format(".{}.{}-{}.part", target.filename().string(), process_id(), counter++);
}

Error explain(const fs::path& path, int error_number) {
  switch (error_number) {
    case EFBIG:
      return bad_output(path,
                        "could not be written because it is larger than this system allows: raise "
                        "the limit (ulimit -f), or write less");
    case ENOSPC:
#ifdef EDQUOT
    case EDQUOT:
#endif
      return bad_output(
          path,
          "could not be written because the disk is full: free some space, or write elsewhere");
    case EACCES:
    case EPERM:
    case EROFS:
      return bad_output(path,
                        "can not be written because its folder is protected: change the "
                        "permissions, or write elsewhere");
    case ENOENT:
    case ENOTDIR:
      return bad_output(
          path,
          "can not be written because there is no folder '{}': create it, or correct the name",
          folder_of(path).string());
    case ENAMETOOLONG:
      return bad_output(path,
                        "can not be written because the name is too long: choose a shorter one");
    default:
      return bad_output(path, "could not be written ({}): check the disk, or write elsewhere",
                        std::strerror(error_number));
  }
}

Status check_target(const fs::path& path, const fs::path& target) {
  std::error_code error;
  if (path.filename().empty() || fs::is_directory(target, error)) {
    return bad_output(path, "is a folder: add a file name");
  }
  // Renaming over a device would replace it.
  if (fs::exists(target, error) && !fs::is_regular_file(target, error)) {
    return bad_output(path, "is no ordinary file: choose another name");
  }
  return Nothing{};
}

Status check_room(const fs::path& path, const fs::path& folder, double bytes) {
  std::error_code error;
  const auto space = fs::space(folder, error);
  if (error || bytes <= 0.0 || double(space.available) >= bytes) return Nothing{};
  const auto [needed, there] = bytes_to_compare(bytes, double(space.available));
  return bad_output(path,
                    "needs {} but the disk has only {} free: free some space, or write elsewhere",
                    needed, there);
}

/// Copies bytes into a file that appears whole or not at all.
Status copy_into(const fs::path& from, const fs::path& to) {
  auto file = AtomicFile::create(to);
  if (!file) return file.error();
  const int fd = open_to_read(from);
  if (fd < 0) return explain(to, errno);
  std::vector<char> block(1 << 20);
  Status done = Nothing{};
  for (int64_t n = 0; done && (n = read_some(fd, block.data(), block.size())) > 0;)
    done = file->write(block.data(), size_t(n));
  close_descriptor(fd);
  return done ? file->commit() : done;
}

}  // namespace

fs::path behind_links(const fs::path& path) {
  constexpr int kMostLinks = 40;  // as the system itself follows
  fs::path target = path;
  std::error_code error;
  for (int n = 0; n < kMostLinks && fs::is_symlink(target, error); ++n) {
    const fs::path next = fs::read_symlink(target, error);
    if (error) return path;
    target = next.is_absolute() ? next : folder_of(target) / next;
  }
  return target;
}

Status replace_file(const fs::path& from, const fs::path& to) {
  const fs::path target = behind_links(to);
  if (rename_over(from, target)) return Nothing{};
  if (errno != EXDEV) return explain(to, errno);
  const Status copied = copy_into(from, target);
  if (copied) remove_quietly(from);
  return copied;
}

void remove_abandoned(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const bool part = name.starts_with('.') && name.ends_with(".part");
    if (!part && !name.starts_with(kHiddenFolder)) continue;
    if (is_abandoned(entry.path())) fs::remove_all(entry.path(), error);
  }
}

Result<AtomicFile> AtomicFile::create(const fs::path& path) {
  AtomicFile file;
  file.path_ = path;
  file.target_ = behind_links(path);
  if (const Status good = check_target(path, file.target_); !good) return good.error();
  // Again if another process took the file for an abandoned one before it was locked.
  do {
    file.discard();
    const fs::path temporary = temporary_beside(file.target_);
    file.fd_ = create_new(temporary);
    if (file.fd_ < 0) return explain(path, errno);
    file.temporary_ = temporary;
    lock_as_alive(file.fd_);
  } while (was_removed(file.fd_));
  // A file that is replaced keeps its permissions.
  if (!copy_permissions(file.target_, file.fd_)) return file.fail(errno);
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept {
  *this = std::move(other);
}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(target_, other.target_);
  std::swap(temporary_, other.temporary_);
  std::swap(fd_, other.fd_);
  return *this;
}

AtomicFile::~AtomicFile() {
  discard();
}

void AtomicFile::discard() {
  if (fd_ >= 0) close_descriptor(fd_);
  fd_ = -1;
  if (!temporary_.empty()) remove_quietly(temporary_);
  temporary_.clear();
}

Error AtomicFile::fail(int error_number) {
  discard();
  return explain(path_, error_number);
}

Status AtomicFile::write(const void* bytes, size_t n) {
  const char* from = static_cast<const char*>(bytes);
  while (n > 0) {
    const int64_t done = write_some(fd_, from, std::min(n, kMaxWriteBytes));
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return fail(errno);
    from += done;
    n -= size_t(done);
  }
  return Nothing{};
}

Status AtomicFile::commit() {
  if (!sync_to_disk(fd_)) return fail(errno);
  if (!close_descriptor(std::exchange(fd_, -1))) return fail(errno);
  if (!rename_over(temporary_, target_)) return fail(errno);
  temporary_.clear();
  // A power cut could otherwise lose the new name. The data are safe either way.
  sync_folder(folder_of(target_));
  return Nothing{};
}

Status write_text(const fs::path& path, std::string_view text) {
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  if (const Status written = file->write(text.data(), text.size()); !written) return written;
  return file->commit();
}

Status check_can_write_file(const fs::path& path, double bytes) {
  remove_abandoned(folder_of(behind_links(path)));
  const auto probe = AtomicFile::create(path);
  if (!probe) return probe.error();
  return check_room(path, folder_of(behind_links(path)), bytes);
}

Status check_can_write_folder(const fs::path& folder, double bytes) {
  std::error_code error;
  fs::path nearest = fs::absolute(folder, error);
  while (!fs::exists(nearest, error) && nearest.has_relative_path())
    nearest = nearest.parent_path();
  if (!fs::is_directory(nearest, error)) {
    return bad_output(folder, "can not be a folder because '{}' is a file: choose another name",
                      nearest.string());
  }
  const fs::path probe_path = nearest / "palpate-probe";
  const auto probe = AtomicFile::create(probe_path);
  if (!probe) {
    return bad_output(folder,
                      "can not be written because '{}' is protected or full: change the "
                      "permissions, or write elsewhere",
                      nearest.string());
  }
  return check_room(folder, nearest, bytes);
}

}  // namespace palpate::files
