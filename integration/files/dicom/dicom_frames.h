#pragma once

#include "integration/files/frame_source.h"

namespace palpate::files {

/// The 4D or 3D image that the DICOM files, of one slice or of many each, in the folders (and below
/// them) or files form. With several inputs, each is one frame. "FOLDER#SERIES" chooses among
/// several images of a folder, see split_series() and choose_image(). Reads the tags of every file
/// at once and pixels frame by frame. kBadInput if there is none, or if several could be meant.
Result<std::unique_ptr<FrameSource>> open_dicom(const std::vector<std::filesystem::path>& inputs);

/// An image of a folder, for a list to choose from.
struct DicomEntry {
  std::string label;  ///< "4 'cine SAX'": what `series` of open_dicom() may be
  std::string what;   ///< "12 frames of 256 x 256 x 10", or why it can not be read
};

/// All images of a folder of DICOM files, by their numbers. kBadInput as open_dicom()'s scan.
Result<std::vector<DicomEntry>> list_dicom(const std::filesystem::path& folder);

}  // namespace palpate::files
