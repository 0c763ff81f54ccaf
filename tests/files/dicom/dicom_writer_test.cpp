#include "integration/files/dicom/dicom_writer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "integration/files/read_sequence.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

/// Read by palpate and, slice by slice, by ITK's GDCM: the values to half a step of 16 bits.
TEST(DicomWriter, WritesAnObliqueSequenceThatOthersRead) {
  const TemporaryFolder folder;
  Sequence sequence{"s", {}, {0.0, 0.25, 0.75}, true};
  float low = 1e30F, high = -1e30F;
  for (size_t k = 0; k < 3; ++k) {
    sequence.frames.push_back(known_volume(oblique_grid(), k));
    for (float& value : sequence.frames.back().values) {
      value = 0.37F * value - 80.0F;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  std::vector<std::filesystem::path> written;
  const auto path_of = [&](const std::string& name) -> Result<std::filesystem::path> {
    written.push_back(folder / name);
    return written.back();
  };
  const Status done = write_dicom(sequence, "made", 17, path_of);
  ASSERT_TRUE(done) << done.error().message;
  const Grid& grid = sequence.frames[0].grid;
  ASSERT_EQ(written.size(), 3U * size_t(grid.size.z));
  const double step = (double(high) - double(low)) / 65535.0;

  const auto read = read_sequence({folder.path()});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->frames.size(), 3U);
  EXPECT_TRUE(read->times_known);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(read->times_s[k], sequence.times_s[k], 1e-9);
    EXPECT_TRUE(same_geometry(read->frames[k].grid, grid));
    for (size_t n = 0; n < grid.count(); ++n)
      ASSERT_NEAR(read->frames[k].values[n], sequence.frames[k].values[n], 0.51 * step) << k;
  }
  const size_t in_slice = size_t(grid.size.x) * size_t(grid.size.y);
  const std::vector<double> slice = itk_oracle::read_dicom(written[1]);
  ASSERT_EQ(slice.size(), in_slice);
  for (size_t n = 0; n < in_slice; ++n)
    ASSERT_NEAR(slice[n], sequence.frames[0].values[in_slice + n], 0.51 * step);
}

}  // namespace
}  // namespace palpate::files
