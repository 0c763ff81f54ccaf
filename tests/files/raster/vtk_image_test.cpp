#include "docs/examples/vtk_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

/// The example format of the documentation, used as a user would. ITK is the oracle: it writes the
/// files.
class VtkImage : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { add_vtk_images(); }

  Result<Volume> read(const std::string& bytes) {
    write_bytes(folder_ / "image.vtk", bytes);
    return read_volume(folder_ / "image.vtk");
  }

  const TemporaryFolder folder_;
};

const std::string kHead =
    "# vtk DataFile Version 3.0\na title\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 "
    "2\nSPACING 1 2 3\nORIGIN 4 5 6\nPOINT_DATA 4\nSCALARS density short 1\n";

TEST_F(VtkImage, IsReadAsItkWroteIt) {
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat}) {
    const Volume volume = known_volume(straight_grid());
    itk_oracle::write(folder_ / "image.vtk", {volume}, {.type = type});
    const auto found = read_volume(folder_ / "image.vtk");
    ASSERT_TRUE(found) << found.error().message;
    expect_grid(found->grid, volume.grid, 1e-5);  // ITK prints six digits
    EXPECT_EQ(found->values, volume.values);
  }
}

TEST_F(VtkImage, IsReadAsText) {
  const auto found = read(kHead + "LOOKUP_TABLE default\n1 -2\n30\n4\n");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->grid.size, glm::ivec3(2, 1, 2));
  EXPECT_EQ(found->values, (std::vector<float>{1, -2, 30, 4}));
}

TEST_F(VtkImage, SaysWhyAFileCanNotBeRead) {
  const auto why = [&](const std::string& bytes) {
    const auto found = read(bytes);
    return found ? std::string("read") : found.error().message;
  };
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = kHead + "LOOKUP_TABLE default\n1 2 3 4\n";
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_THAT(why(kHead), HasSubstr("no scalars"));
  EXPECT_THAT(why(kHead + "LOOKUP_TABLE default\n1 2 3\n"), HasSubstr("too short"));
  EXPECT_THAT(why(with("ASCII", "GZIP")), HasSubstr("neither ASCII nor BINARY"));
  EXPECT_THAT(why(with("STRUCTURED_POINTS", "POLYDATA")), HasSubstr("no image"));
  EXPECT_THAT(why(with("short 1", "short 3")), HasSubstr("more than one value"));
  EXPECT_THAT(why(with("short", "bit")), HasSubstr("'bit'"));
  EXPECT_THAT(why(with("DIMENSIONS 2 1 2", "DIMENSIONS 2 1")), HasSubstr("three numbers"));
  EXPECT_THAT(why(with("SPACING 1 2 3", "SPACING 1 0 3")), HasSubstr("image.vtk"));
}

TEST_F(VtkImage, IsNamedAmongTheFormats) {
  write_bytes(folder_ / "a.txt", "nothing that is an image");
  const auto found = read_volume(folder_ / "a.txt");
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("NRRD, NIfTI, MetaImage, VTK and DICOM"));
  EXPECT_TRUE(has_raster_name("scan.VTK"));
}

}  // namespace
}  // namespace palpate::files
