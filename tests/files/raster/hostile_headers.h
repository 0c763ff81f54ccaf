#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "integration/files/raster/image_writer.h"
#include "tests/files/raster/nifti2.h"
#include "tests/files/raster/packed.h"
#include "tests/files/test_images.h"

namespace palpate::files {

/// A file of less than 1 kB on which the reader of ITK 5.2 fails: it ends the process, does not
/// return, allocates all memory, reads beyond its buffer, or returns values that are not in the
/// file (docs/decisions/files.md).
struct HostileFile {
  std::string name;
  std::string bytes;
  /// The error of palpate's reader; empty if the file is valid and is read.
  std::string refusal;
};

/// One voxel as NIfTI, rotated about the patient's axis, with this number in its sform.
inline std::string nifti_of_one_voxel(float in_sform, int16_t qform_code) {
  ImageToWrite picture;
  picture.grid = straight_grid({1, 1, 1});
  picture.grid.direction[0] = {0.6, 0.8, 0.0};
  picture.grid.direction[1] = {-0.8, 0.6, 0.0};
  picture.frames = {nullptr};
  std::string header = nifti_header_of(picture);
  put<int16_t>(header, 252, qform_code);
  put<float>(header, 300, in_sform);
  return header + std::string(4, '\0');
}

/// Several values of one or two bytes per voxel as NIfTI, to be scaled.
inline std::string nifti_to_be_scaled(int16_t type, int16_t bits, size_t components) {
  ImageToWrite picture;
  picture.grid = oblique_grid();
  picture.components = components;
  picture.frames = {nullptr};
  std::string header = nifti_header_of(picture);
  put<int16_t>(header, 70, type);
  put<int16_t>(header, 72, bits);
  put<float>(header, 112, 2.0f);
  return header + std::string(size_t(bits / 8) * components * picture.grid.count(), '\1');
}

inline std::vector<HostileFile> hostile_files() {
  const std::string size = "NDims = 3\nDimSize = 1 1 1\n", type = "ElementType = MET_UCHAR\n",
                    here = "ElementDataFile = LOCAL\nx", packed = "CompressedData = True\n";
  std::string damaged = gzip(std::string(60, 'x'));
  damaged[damaged.size() - 6] ^= 1;  // the checksum
  return {
      // A line that is longer than the buffer for the message about it ends the process.
      {"line.nrrd", "NRRD0004\n" + std::string(960, 'x') + "\n\n", "no NRRD field"},
      // A value that is longer than 254 characters ends the process.
      {"value.mha", "ObjectType = " + std::string(255, 'x') + "\n" + size + type + here, ""},
      // The name of the data file is passed to printf(): memory is written, or the process ends.
      {"pattern.mha", size + type + "ElementDataFile = %s%s%s%n\n", "by a pattern"},
      // Counting up to the number of dimensions takes minutes.
      {"dimensions.mha", "NDims = 2147483647\nDimSize = 1 1 1\n" + type + here, "dimensions"},
      // Compressed data without a file name: the size is taken as that of all memory.
      {"unnamed.mha", size + packed + type + "ElementDataFile =\nx", "names no data files"},
      // Compressed data that can not be decompressed: the values are whatever was in memory.
      {"damaged.mha",
       "NDims = 3\nDimSize = 5 4 3\nBinaryData = True\n" + packed + type +
           "ElementDataFile = LOCAL\n" + damaged,
       "is damaged"},
      // Infinity: the search for the nearest rotation does not end. NaN: the process ends.
      {"infinite.nii", nifti_of_one_voxel(INFINITY, 0), "direction that is not finite"},
      {"nan.nii", nifti_of_one_voxel(NAN, 0), "direction that is not finite"},
      // The qform is valid, and palpate uses it.
      {"qform.nii", nifti_of_one_voxel(INFINITY, 1), ""},
      // Four bytes are read for every one or two in the file.
      {"colours.nii", nifti_to_be_scaled(128, 24, 1), "NIfTI type 128"},
      {"vectors.nii", nifti_to_be_scaled(512, 16, 3), "holds 3 values per voxel"},
  };
}

}  // namespace palpate::files
