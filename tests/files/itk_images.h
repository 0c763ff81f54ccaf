#pragma once

#include <filesystem>
#include <vector>

#include "compute/volume/field.h"
#include "compute/volume/volume.h"
#include "integration/files/raster/raster.h"

/// ITK as the oracle of file formats: it writes files that palpate reads, and reads files that
/// palpate wrote.
namespace palpate::files::itk_oracle {

struct WriteOptions {
  SampleType type = SampleType::kInt16;
  bool compressed = false;
  bool four_d = false;        ///< a 4D image even if there is one frame
  double time_step_s = 1.0;   ///< the fourth spacing
  double time_start_s = 0.0;  ///< the fourth origin
};

/// Frames on one grid, written by ITK's reader/writer for the name's ending.
void write(const std::filesystem::path& path, const std::vector<Volume>& frames,
           const WriteOptions& options);

/// A vector image as ITK's own filters write displacement fields.
void write_field(const std::filesystem::path& path, const Field& field);

/// One DICOM file per slice of a straight volume of integers, written by ITK's GDCM; if `packed`,
/// as lossless JPEG.
void write_dicom_series(const std::filesystem::path& folder, const Volume& volume, bool packed);

/// A DICOM file with its pixels compressed by GDCM in a transfer syntax; false if GDCM can not.
/// With a rate, JPEG 2000 is lossy and gets that many times smaller.
bool pack_dicom(const std::filesystem::path& from, const std::filesystem::path& to,
                const char* syntax, double rate = 0.0);

/// The values that ITK finds in one DICOM file, slope and intercept applied.
std::vector<double> read_dicom(const std::filesystem::path& path);

/// The content of a file as ITK reads it: grid and float values, three per voxel for fields. Times
/// are not read.
struct Read {
  Grid grid;
  size_t components = 1;
  std::vector<float> values;
};
Read read(const std::filesystem::path& path);

/// `moving` warped onto its own grid by ITK's displacement-field transform with the field in the
/// file, linear interpolation; NaN where ITK finds no image.
std::vector<float> warp(const Volume& moving, const std::filesystem::path& field_file);

}  // namespace palpate::files::itk_oracle
