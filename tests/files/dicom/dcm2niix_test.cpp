// The path of most clinical data: DICOM, through dcm2niix, to NIfTI. DICOM, NIfTI, nibabel and ITK
// must all put every voxel at the same place.
#include <gtest/gtest.h>

#include <fstream>

#include "integration/files/raster/raster.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/itk_images.h"
#include "tests/files/other_programs.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

/// Tolerance between two programs for the place of a voxel: NIfTI stores single precision, 1e-5 of
/// 170 mm.
constexpr double kSamePlaceMm = 1e-4;

struct Voxel {
  glm::ivec3 index;
  glm::dvec3 lps_mm;
  double value;
};

/// Every voxel as nibabel reads it, in the order of the file. Empty if nibabel can not read the
/// file.
std::vector<Voxel> seen_by_nibabel(const std::string& python, const std::filesystem::path& file,
                                   const TemporaryFolder& folder) {
  write_bytes(folder / "look.py",
              "import sys, numpy, nibabel\n"
              "image = nibabel.load(sys.argv[1])\n"
              "values = image.get_fdata()\n"
              "for k, j, i in numpy.ndindex(values.shape[::-1]):\n"
              "    r, a, s = (image.affine @ [i, j, k, 1])[:3]\n"
              "    print(i, j, k, -r, -a, s, values[i, j, k])\n");
  const std::string command = python + " " + (folder / "look.py").string() + " " + file.string() +
                              " > " + (folder / "seen.txt").string();
  if (std::system(command.c_str()) != 0) return {};
  std::ifstream stream(folder / "seen.txt");
  std::vector<Voxel> voxels;
  for (Voxel v; stream >> v.index.x >> v.index.y >> v.index.z >> v.lps_mm.x >> v.lps_mm.y >>
                v.lps_mm.z >> v.value;)
    voxels.push_back(v);
  return voxels;
}

/// Each voxel of the other program must be found at the same place with the same value.
void expect_seen_alike(const Volume& ours, const std::vector<Voxel>& voxels) {
  ASSERT_EQ(voxels.size(), ours.grid.count());
  const Grid stored = as_in_file(ours.grid);
  for (const Voxel& v : voxels) {
    EXPECT_LT(glm::distance(stored.lps_from_index(glm::dvec3(v.index)), v.lps_mm), kSamePlaceMm);
    const glm::dvec3 at = ours.grid.index_from_lps(v.lps_mm);
    const glm::ivec3 nearest = glm::ivec3(glm::round(at));
    EXPECT_LT(glm::distance(glm::dvec3(nearest), at), 1e-3);
    EXPECT_EQ(ours.at(nearest.x, nearest.y, nearest.z), float(v.value));
  }
}

std::vector<Voxel> seen_by_itk(const std::filesystem::path& file) {
  const auto found = itk_oracle::read(file);
  std::vector<Voxel> voxels;
  for (int k = 0; k < found.grid.size.z; ++k) {
    for (int j = 0; j < found.grid.size.y; ++j) {
      for (int i = 0; i < found.grid.size.x; ++i) {
        voxels.push_back({{i, j, k},
                          found.grid.lps_from_index({i, j, k}),
                          found.values[found.grid.offset(i, j, k)]});
      }
    }
  }
  return voxels;
}

/// Axial, sagittal, coronal and oblique slices, of whole numbers.
std::vector<Grid> scans() {
  std::vector<Grid> grids(4, straight_grid({14, 12, 10}));
  grids[1].direction = glm::dmat3(0, 1, 0, 0, 0, -1, -1, 0, 0);
  grids[2].direction = glm::dmat3(1, 0, 0, 0, 0, -1, 0, 1, 0);
  grids[3].direction = oblique_grid().direction;
  return grids;
}

TEST(Dcm2niix, NiftiIsTheDicomSeriesVoxelByVoxelForUsItkAndNibabel) {
  if (!succeeds("command -v dcm2niix")) GTEST_SKIP() << "dcm2niix is not installed";
  const std::string python = python_with_nibabel();
  for (const Grid& grid : scans()) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder / "dicom");
    const Volume volume = known_volume(grid);
    write_dicom_volume(folder / "dicom", volume);
    ASSERT_TRUE(succeeds("dcm2niix -b n -z n -f v -o " + folder.path().string() + " " +
                         (folder / "dicom").string()));
    const auto dicom = read_volume(folder / "dicom"), nifti = read_volume(folder / "v.nii");
    ASSERT_TRUE(dicom) << dicom.error().message;
    ASSERT_TRUE(nifti) << nifti.error().message;
    expect_seen_alike(*nifti, seen_by_itk(folder / "v.nii"));
    if (!python.empty())
      expect_seen_alike(*nifti, seen_by_nibabel(python, folder / "v.nii", folder));
    // The slices may be in the opposite order, but every voxel of the scanner is at its place.
    std::vector<Voxel> scanned;
    for (int k = 0; k < grid.size.z; ++k) {
      for (int j = 0; j < grid.size.y; ++j) {
        for (int i = 0; i < grid.size.x; ++i) {
          EXPECT_EQ(dicom->at(i, j, k), volume.at(i, j, k));
          const glm::dvec3 x = grid.lps_from_index({i, j, k});
          EXPECT_NEAR(sample(*nifti, nifti->grid.index_from_lps(x)), volume.at(i, j, k), 1e-2);
        }
      }
    }
    EXPECT_TRUE(same_geometry(nifti->grid, dicom->grid));
    EXPECT_EQ(nifti->values, dicom->values);
  }
  if (python.empty()) GTEST_SKIP() << "compared with ITK only: nibabel is not installed";
}

TEST(Dcm2niix, ReadsEnhancedAndFourDimensionalDicomAsWeDo) {
  if (!succeeds("command -v dcm2niix")) GTEST_SKIP() << "dcm2niix is not installed";
  const TemporaryFolder folder;
  const Grid grid = straight_grid({14, 12, 10});
  const auto stored = [&](int s, size_t k) {
    const size_t n = size_t(grid.size.x) * size_t(grid.size.y);
    std::vector<int> values;
    for (size_t v = 0; v < n; ++v) values.push_back(int(known_value(size_t(s) * n + v, k)));
    return values;
  };
  EnhancedFile enhanced;
  enhanced.grid = grid;
  for (const char* name : {"series", "enhanced"}) std::filesystem::create_directory(folder / name);
  for (int s = 0; s < grid.size.z; ++s) {
    enhanced.frames.push_back({s, stored(s, 0), 1.0, 0.0, {}});
    for (size_t k = 0; k < 3; ++k) {
      DicomFile file;
      file.grid = grid;
      file.slice = s;
      file.stored = stored(s, k);
      file.instance = int(k) * grid.size.z + s + 1;
      file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
      write_dicom(folder / "series" / std::to_string(file.instance), file);
    }
  }
  write_enhanced(folder / "enhanced/e", enhanced);
  for (const std::string name : {"series", "enhanced"}) {
    ASSERT_TRUE(succeeds("dcm2niix -b n -z n -f " + name + " -o " + folder.path().string() + " " +
                         (folder / name).string()));
  }

  const auto series = read_sequence({folder / "series"}),
             series_nifti = read_sequence({folder / "series.nii"});
  ASSERT_TRUE(series) << series.error().message;
  ASSERT_TRUE(series_nifti) << series_nifti.error().message;
  ASSERT_EQ(series->frames.size(), 3U);
  ASSERT_EQ(series_nifti->frames.size(), 3U);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_TRUE(same_geometry(series_nifti->frames[k].grid, series->frames[k].grid));
    EXPECT_EQ(series_nifti->frames[k].values, series->frames[k].values) << k;
  }
  const auto volume = read_volume(folder / "enhanced"),
             volume_nifti = read_volume(folder / "enhanced.nii");
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_TRUE(volume_nifti) << volume_nifti.error().message;
  EXPECT_TRUE(same_geometry(volume_nifti->grid, volume->grid));
  EXPECT_EQ(volume_nifti->values, volume->values);
  EXPECT_EQ(volume->values, known_volume(grid).values);
}

TEST(Nibabel, ReadsWhatWeWriteOnTheGridOfAMirroredFileWhereItIs) {
  const std::string python = python_with_nibabel();
  if (python.empty()) GTEST_SKIP() << "nibabel is not installed";
  const TemporaryFolder folder;
  Grid grid = oblique_grid();
  grid.direction[2] = -grid.direction[2];
  itk_oracle::write(folder / "v.nii", {known_volume(grid)}, {});
  const auto found = read_volume(folder / "v.nii");
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_TRUE(write_volume(*found, folder / "w.nii"));
  const auto before = seen_by_nibabel(python, folder / "v.nii", folder),
             after = seen_by_nibabel(python, folder / "w.nii", folder);
  ASSERT_EQ(before.size(), after.size());
  for (size_t v = 0; v < before.size(); ++v) {
    EXPECT_EQ(before[v].index, after[v].index);
    EXPECT_LT(glm::distance(before[v].lps_mm, after[v].lps_mm), kSamePlaceMm);
    EXPECT_EQ(before[v].value, after[v].value);
  }
}

TEST(Nibabel, Nifti2IsReadAsItSays) {
  const std::string python = python_with_nibabel();
  if (python.empty()) GTEST_SKIP() << "nibabel is not installed";
  const TemporaryFolder folder;
  write_bytes(folder / "make.py",
              "import sys, numpy, nibabel\n"
              "values = numpy.arange(60, dtype=numpy.int16).reshape((5, 4, 3), order='F') - 20\n"
              "affine = numpy.array([[-0.75, 0, 0, 31.5], [0, 1.2, 0.3, -12.25],\n"
              "                      [0, -0.16, 2.25, 170.125], [0, 0, 0, 1.0]])\n"
              "for name, order in (('little', '<'), ('big', '>')):\n"
              "    header = nibabel.Nifti2Header(endianness=order)\n"
              "    header.set_data_dtype(numpy.dtype(numpy.int16).newbyteorder(order))\n"
              "    image = nibabel.Nifti2Image(values, affine, header)\n"
              "    image.header.set_slope_inter(0.5, -3.0)\n"
              "    nibabel.save(image, sys.argv[1] + '/' + name + '.nii')\n"
              "    nibabel.save(image, sys.argv[1] + '/' + name + '.nii.gz')\n");
  ASSERT_TRUE(
      succeeds(python + " " + (folder / "make.py").string() + " " + folder.path().string()));
  for (const char* name : {"little.nii", "little.nii.gz", "big.nii", "big.nii.gz"}) {
    const auto found = read_volume(folder / name);
    ASSERT_TRUE(found) << found.error().message;
    expect_seen_alike(*found, seen_by_nibabel(python, folder / name, folder));
  }
}

}  // namespace
}  // namespace palpate::files
