#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

/// Open files by their descriptors, with what Linux and Windows do differently behind it. Those
/// that return -1 or false set errno. Not real-time safe.
namespace palpate::files {

enum class SeekFrom { kStart, kHere, kEnd };

int open_to_read(const std::filesystem::path& path);
/// For writing; fails where something of that name is there already.
int create_new(const std::filesystem::path& path);
/// Fewer bytes than asked for where there are no more; 0 at the end.
int64_t read_some(int fd, void* to, size_t n);
/// Fewer than given where the system takes no more at a time.
int64_t write_some(int fd, const void* from, size_t n);
bool seek(int fd, int64_t offset, SeekFrom from);
/// False: what was written last may be lost.
bool close_descriptor(int fd);

/// Tells the system that the file is read from its start to its end.
void expect_in_order(int fd);
bool sync_to_disk(int fd);
/// So that a new name in the folder survives a power cut. Not every system can do this.
void sync_folder(const std::filesystem::path& folder);

/// Gives `from` the name `to`, replacing what has it. EXDEV: they are on two disks.
bool rename_over(const std::filesystem::path& from, const std::filesystem::path& to);
void remove_quietly(const std::filesystem::path& path);
/// Whether the open file has lost its name.
bool was_removed(int fd);
/// The disk and the number of a file on it: the same for all its names. Nothing where there is
/// none.
using FileId = std::pair<uint64_t, uint64_t>;
std::optional<FileId> file_id(const std::filesystem::path& path);
/// Gives the open file the permissions of another one, if that is there and the system has such.
bool copy_permissions(const std::filesystem::path& from, int fd);
/// So that it can be locked as alive.
int open_folder(const std::filesystem::path& folder);
/// Whether what is written there is seen on a screen at once, with colours and a cursor.
bool is_terminal(int fd);

int process_id();
/// Whether nobody holds the lock of lock_as_alive() on this path.
bool is_abandoned(const std::filesystem::path& path);

}  // namespace palpate::files
