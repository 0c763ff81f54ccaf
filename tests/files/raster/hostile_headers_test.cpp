// Files on which ITK's readers of the same formats fail; palpate's readers must handle them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/read_volume.h"
#include "tests/files/raster/hostile_headers.h"
#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

TEST(HostileHeaders, AreAnswered) {
  const TemporaryFolder folder;
  for (const HostileFile& file : hostile_files()) {
    EXPECT_LT(file.bytes.size(), 1000U) << file.name;
    write_bytes(folder / file.name, file.bytes);
    const auto found = read_volume(folder / file.name);
    EXPECT_EQ(bool(found), file.refusal.empty()) << file.name;
    if (found) continue;
    EXPECT_THAT(found.error().message, HasSubstr(file.refusal));
    EXPECT_THAT(found.error().message, HasSubstr(file.name));
  }
}

}  // namespace
}  // namespace palpate::files
