#include "integration/files/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "integration/files/raster/write_field.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

/// Files of this process can not grow beyond this size: simulates a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    old_handler_ = ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &old_);
    rlimit limit = old_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    ::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_{};
  sighandler_t old_handler_;
};

/// Root may write anywhere, so the test runs as an ordinary user for a while.
class OrdinaryUser {
 public:
  OrdinaryUser() {
    if (::geteuid() == 0) changed_ = ::seteuid(65534) == 0;
  }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;
  ~OrdinaryUser() {
    if (changed_) restored_ = ::seteuid(0) == 0;
  }

 private:
  bool changed_ = false;
  bool restored_ = false;
};

TEST(AtomicFile, AppearsOnlyWithCommit) {
  const TemporaryFolder folder;
  {
    auto file = AtomicFile::create(folder / "a.txt");
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("hello", 5));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
    ASSERT_TRUE(file->commit());
  }
  EXPECT_EQ(read_bytes(folder / "a.txt"), "hello");
  EXPECT_EQ(folder.entry_count(), 1u);
}

TEST(AtomicFile, LeavesTheOldFileAloneWithoutCommit) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.txt", "old");
  {
    auto file = AtomicFile::create(folder / "a.txt");
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("new", 3));
  }
  EXPECT_EQ(read_bytes(folder / "a.txt"), "old");
  EXPECT_EQ(folder.entry_count(), 1u);
}

TEST(AtomicFile, ReplacesTheFileBehindALinkAndKeepsItsPermissions) {
  const TemporaryFolder folder;
  write_bytes(folder / "real.txt", "old");
  ::chmod((folder / "real.txt").c_str(), 0640);
  std::filesystem::create_symlink(folder / "real.txt", folder / "link.txt");
  ASSERT_TRUE(write_text(folder / "link.txt", "new"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.txt"));
  EXPECT_EQ(read_bytes(folder / "real.txt"), "new");
  EXPECT_EQ(std::filesystem::status(folder / "real.txt").permissions(),
            std::filesystem::perms(0640));
}

TEST(AtomicFile, SaysThatAFileMayNotGrowAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  Grid grid = straight_grid({32, 32, 32});
  for (const char* name : {"u.mha", "u.nrrd", "u.nii", "u.nii.gz"}) {
    const FullDisk disk(8192);
    const Status written = write_field(known_field(grid), folder / name);
    ASSERT_FALSE(written) << name;
    EXPECT_EQ(written.error().kind, ErrorKind::kBadOutput);
    EXPECT_THAT(written.error().message, HasSubstr("larger than this system allows"));
    EXPECT_EQ(folder.entry_count(), 0u) << name;
  }
}

TEST(AtomicFile, KeepsTheOldFileWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.txt", "old");
  {
    const FullDisk disk(1000);
    EXPECT_FALSE(write_text(folder / "a.txt", std::string(5000, 'x')));
  }
  EXPECT_EQ(read_bytes(folder / "a.txt"), "old");
  EXPECT_EQ(folder.entry_count(), 1u);
}

TEST(AtomicFile, NamesAMissingFolder) {
  const TemporaryFolder folder;
  const Status written = write_text(folder / "no/such/a.txt", "x");
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("there is no folder"));
}

TEST(AtomicFile, DoesNotReplaceDevicesOrFolders) {
  const TemporaryFolder folder;
  const Status device = write_text("/dev/full", "x");
  ASSERT_FALSE(device);
  EXPECT_THAT(device.error().message, HasSubstr("no ordinary file"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
  const Status written = write_text(folder.path(), "x");
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("is a folder"));
}

TEST(AtomicFile, SaysThatAProtectedFolderCanNotBeWritten) {
  const TemporaryFolder folder;
  ::chmod(folder.path().c_str(), 0555);
  const OrdinaryUser user;
  const Status written = write_text(folder / "a.txt", "x");
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("protected"));
  const Status asked = check_can_write_file(folder / "a.txt");
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().message, written.error().message);
  EXPECT_FALSE(check_can_write_folder(folder / "out"));
}

TEST(WriteCheck, LeavesNothingBehind) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.txt", "old");
  EXPECT_TRUE(check_can_write_file(folder / "a.txt"));
  EXPECT_TRUE(check_can_write_file(folder / "b.txt", 1000.0));
  EXPECT_TRUE(check_can_write_folder(folder / "new/deeper"));
  EXPECT_EQ(read_bytes(folder / "a.txt"), "old");
  EXPECT_EQ(folder.entry_count(), 1u);
}

TEST(WriteCheck, SaysWhenTheDiskHasNoRoom) {
  const TemporaryFolder folder;
  // 10^18 bytes: more than any disk has.
  const Status asked = check_can_write_file(folder / "a.mha", 1e18);
  ASSERT_FALSE(asked);
  EXPECT_THAT(asked.error().message, HasSubstr("free some space"));
  EXPECT_FALSE(check_can_write_folder(folder.path(), 1e18));
}

TEST(WriteCheck, RefusesAFolderBelowAFile) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.txt", "old");
  const Status asked = check_can_write_folder(folder / "a.txt");
  ASSERT_FALSE(asked);
  EXPECT_THAT(asked.error().message, HasSubstr("is a file"));
}

}  // namespace
}  // namespace palpate::files
