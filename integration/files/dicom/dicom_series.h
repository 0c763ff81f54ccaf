#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "integration/files/dicom/dicom_layout.h"

namespace palpate::files {

/// Images of one folder that belong together: one sequence or one volume, or what looks like one
/// and can not be read.
struct DicomImage {
  std::string label;           ///< "4 'cine SAX', echo time 4.9": number, name, what else differs
  std::vector<size_t> slices;  ///< numbers of slices
  std::string differs_in;      ///< from other images at the same places; empty if in nothing
  Result<DicomLayout> layout;
};

/// All images of a folder: slices of one patient, study, modality, shape, name (but for its
/// numbers) and kind. A series is an image; series with one image of each place are its frames, and
/// series of one slice each are its stack.
std::vector<DicomImage> images_of(const std::filesystem::path& name,
                                  const std::vector<DicomSlice>& slices);

/// "12 frames of 256 x 256 x 10", or why it can not be read.
std::string describe(const DicomImage& image);

/// The image that is meant: the only sequence, else the only volume; a stack rather than single
/// slices, magnitude rather than phase. What else the folder holds is said in the notes.
/// `wanted` chooses by number or name ("4", "cine", "4 'cine SAX', echo time 4.9"; "3,5": both, in
/// this order); empty: not chosen. kBadInput with the choices if several could be meant.
Result<DicomLayout> choose_image(const std::filesystem::path& name, std::vector<DicomSlice>& slices,
                                 const std::string& wanted);

}  // namespace palpate::files
