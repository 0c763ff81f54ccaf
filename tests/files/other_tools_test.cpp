// Fields of FSL, NiftyReg, SPM, ANTs and others in NIfTI: a known point goes where the tool's own
// documentation says, or the file is refused by the tool's name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/raster/image_writer.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/raster/nifti2.h"
#include "tests/files/raster/packed.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

/// Single precision of places of 200 mm.
constexpr double kMovedPointMm = 1e-4;

/// Where a point of the fixed image (LPS mm) is in the moving one: a turn, a stretch and a shift.
glm::dvec3 moved_point(glm::dvec3 x) {
  return {0.99 * x.x - 0.12 * x.y + 3.0, 0.11 * x.x + 1.02 * x.y - 1.0, 0.97 * x.z + 0.5};
}

glm::dvec3 turned_about_z(glm::dvec3 v) {
  return {-v.x, -v.y, v.z};
}

glm::dvec3 displacement_lps(glm::dvec3 x) {
  return moved_point(x) - x;
}
glm::dvec3 displacement_ras(glm::dvec3 x) {
  return turned_about_z(moved_point(x) - x);
}
glm::dvec3 place_ras(glm::dvec3 x) {
  return turned_about_z(moved_point(x));
}

enum class Layout { kFiveAxes, kFourAxes, kTrailingOne };

/// A field as a tool writes it.
struct Tool {
  const char* name;
  int intent;
  const char* intent_name;
  float intent_p1;
  const char* description;
  glm::dvec3 (*vector)(glm::dvec3 x);
  Layout layout = Layout::kFiveAxes;
};

std::string tool_header(const Grid& grid, const Tool& tool) {
  ImageToWrite picture;
  picture.grid = grid;
  picture.components = 3;
  picture.frames = {nullptr};
  std::string header = nifti_header_of(picture);
  if (tool.layout != Layout::kFiveAxes) {
    put<int16_t>(header, 40, tool.layout == Layout::kFourAxes ? 4 : 5);
    put<int16_t>(header, 48, 3);
    put<int16_t>(header, 50, 1);
  }
  put<float>(header, 56, tool.intent_p1);
  put<int16_t>(header, 68, int16_t(tool.intent));
  const auto text = [&](size_t at, size_t bytes, const std::string& words) {
    header.replace(at, bytes, words + std::string(bytes - words.size(), '\0'));
  };
  text(148, 80, tool.description);
  text(328, 16, tool.intent_name);
  return header;
}

/// The components lie one after the other; voxels in the order of the file.
std::string tool_samples(const Grid& grid, const Tool& tool) {
  const Grid stored = as_in_file(grid);
  std::vector<float> values;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < grid.size.z; ++k)
      for (int j = 0; j < grid.size.y; ++j)
        for (int i = 0; i < grid.size.x; ++i)
          values.push_back(float(tool.vector(stored.lps_from_index({i, j, k}))[c]));
  return bytes_of_values<float>(values);
}

void expect_moves_points(const std::filesystem::path& file, const Grid& grid) {
  const auto field = read_field(file);
  ASSERT_TRUE(field) << field.error().message;
  ASSERT_TRUE(same_geometry(field->grid, grid));
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = field->grid.lps_from_index({i, j, k});
        const glm::dvec3 y = x + glm::dvec3(field->at(i, j, k));
        EXPECT_LT(glm::length(y - moved_point(x)), kMovedPointMm) << i << ' ' << j << ' ' << k;
      }
}

TEST(FieldsOfOtherTools, MovePointsAsTheToolsSay) {
  const Tool tools[] = {
      {"ITK, ANTs", 1007, "", 0, "", displacement_lps},
      {"ITK, ANTs, four axes", 1007, "", 0, "", displacement_lps, Layout::kFourAxes},
      {"five axes, the last of one", 1007, "", 0, "", displacement_lps, Layout::kTrailingOne},
      {"the standard's displacement", 1006, "", 0, "", displacement_ras},
      {"the standard's, four axes", 1006, "", 0, "", displacement_ras, Layout::kFourAxes},
      {"AFNI, no intent", 0, "", 0, "", displacement_lps},
      {"NiftyReg, displacement", 1007, "NREG_TRANS", 1, "", displacement_ras},
      {"NiftyReg, deformation", 1007, "NREG_TRANS", 0, "", place_ras},
      {"NiftyReg, deformation, four axes", 1007, "NREG_TRANS", 0, "", place_ras, Layout::kFourAxes},
      {"SPM, deformation utility", 1007, "Mapping", 0, "Deformation field", place_ras},
      {"SPM, segmentation", 0, "", 0, "Deformation", place_ras},
      {"SPM, its inverse", 0, "", 0, "Inverse Deformation", place_ras}};
  Grid mirrored = oblique_grid();
  mirrored.j_reversed_in_file = true;
  const TemporaryFolder folder;
  for (const Tool& tool : tools) {
    for (const Grid& grid : {straight_grid(), oblique_grid(), mirrored}) {
      SCOPED_TRACE(tool.name);
      const std::string header = tool_header(grid, tool), samples = tool_samples(grid, tool);
      write_bytes(folder / "u.nii", header + samples);
      expect_moves_points(folder / "u.nii", grid);
      write_bytes(folder / "u.nii.gz", gzip(header + samples));
      expect_moves_points(folder / "u.nii.gz", grid);
      // No command takes it for a sequence.
      EXPECT_TRUE(holds_vectors({folder / "u.nii"}));
      const auto frames = SequenceReader::open({folder / "u.nii"});
      ASSERT_FALSE(frames);
      EXPECT_THAT(frames.error().message, HasSubstr("3 values per voxel"));
    }
  }
}

TEST(FieldsOfOtherTools, KeepTheirNamesInNifti2) {
  const TemporaryFolder folder;
  const Tool tool{"NiftyReg", 1007, "NREG_TRANS", 0, "", place_ras};
  std::string header = nifti2_of(tool_header(oblique_grid(), tool));
  header.replace(508, 10, tool.intent_name);
  write_bytes(folder / "u.nii", header + tool_samples(oblique_grid(), tool));
  expect_moves_points(folder / "u.nii", oblique_grid());
  header.replace(508, 16, std::string("Mapping") + std::string(9, '\0'));
  write_bytes(folder / "u.nii", header + tool_samples(oblique_grid(), tool));
  expect_moves_points(folder / "u.nii", oblique_grid());
  put<double>(header, 80, 3.0);  // intent_p1
  header.replace(508, 10, tool.intent_name);
  write_bytes(folder / "u.nii", header + tool_samples(oblique_grid(), tool));
  const auto refused = read_field(folder / "u.nii");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("deformation velocity field"));
}

TEST(FieldsOfOtherTools, TakePlacesAndTheirVoxelsInOneSpace) {
  // SPM and NiftyReg place by the sform. A qform that names scanner space lies 5 mm beside it.
  const TemporaryFolder folder;
  const Tool tool{"SPM", 1007, "Mapping", 0, "", place_ras};
  std::string header = tool_header(straight_grid(), tool);
  put<int16_t>(header, 254, 4);  // the sform is a template's
  float shifted = 0.0F;
  std::memcpy(&shifted, header.data() + 268, sizeof shifted);
  put<float>(header, 268, shifted + 5.0F);
  write_bytes(folder / "u.nii", header + tool_samples(straight_grid(), tool));
  expect_moves_points(folder / "u.nii", straight_grid());
}

TEST(FieldsOfOtherTools, AreRefusedByNameWhereTheirConventionIsNotRead) {
  struct RefusedTool {
    Tool tool;
    const char* sentence;
  };
  const RefusedTool cases[] = {
      {{"", 2006, "", 0, "", place_ras, Layout::kFourAxes}, "displacement field of FSL's FNIRT"},
      {{"", 2006, "", 0, "", place_ras}, "displacement field of FSL's FNIRT"},
      {{"", 2007, "", 0, "", place_ras, Layout::kFourAxes}, "cubic spline coefficients of FSL"},
      {{"", 2008, "", 0, "", place_ras, Layout::kFourAxes}, "DCT coefficients of FSL"},
      {{"", 2009, "", 0, "", place_ras, Layout::kFourAxes}, "quadratic spline coefficients of FSL"},
      {{"", 2016, "", 0, "", place_ras, Layout::kFourAxes}, "FSL's topup"},
      {{"", 1007, "NREG_TRANS", 2, "", place_ras}, "cubic spline grid of NiftyReg"},
      {{"", 1007, "NREG_TRANS", 3, "", place_ras}, "velocity field of NiftyReg"},
      {{"", 1007, "NREG_TRANS", 4, "", place_ras}, "displacement velocity field of NiftyReg"},
      {{"", 1007, "NREG_TRANS", 5, "", place_ras}, "spline velocity grid of NiftyReg"},
      {{"", 1007, "NREG_TRANS", 6, "", place_ras}, "linear spline grid of NiftyReg"},
      {{"", 1007, "NREG_TRANS", 9, "", place_ras}, "unknown kind of NiftyReg"},
      {{"", 0, "", 0, "Flow Field", place_ras}, "flow field of SPM"}};
  const TemporaryFolder folder;
  for (const auto& [tool, sentence] : cases) {
    write_bytes(folder / "u.nii",
                tool_header(straight_grid(), tool) + tool_samples(straight_grid(), tool));
    const auto field = read_field(folder / "u.nii");
    ASSERT_FALSE(field) << sentence;
    EXPECT_THAT(field.error().message, HasSubstr(sentence));
    const auto frames = SequenceReader::open({folder / "u.nii"});
    ASSERT_FALSE(frames) << sentence;
    EXPECT_THAT(frames.error().message, HasSubstr(sentence));
  }
}

TEST(FieldsOfOtherTools, SayWhatIsNotSure) {
  const TemporaryFolder folder;
  const auto notes_of = [&](const Tool& tool) {
    write_bytes(folder / "u.nii",
                tool_header(straight_grid(), tool) + tool_samples(straight_grid(), tool));
    Notes notes;
    EXPECT_TRUE(read_field(folder / "u.nii", &notes));
    return notes.size() == 1 ? notes.front() : std::string();
  };
  EXPECT_EQ(notes_of({"", 1007, "", 0, "", displacement_lps}), "");
  EXPECT_THAT(notes_of({"", 0, "", 0, "", displacement_lps}), HasSubstr("does not say"));
  EXPECT_THAT(notes_of({"", 1007, "", 0, "", displacement_lps, Layout::kFourAxes}),
              HasSubstr("dimension of time"));
  EXPECT_THAT(notes_of({"", 0, "", 0, "Deformation", place_ras}), HasSubstr("deformation of SPM"));
}

}  // namespace
}  // namespace palpate::files
