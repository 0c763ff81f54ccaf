#pragma once

#include "integration/files/frame_source.h"

namespace palpate::files {

/// The 4D or 3D image that the DICOM files, of one slice or of many each, in the folders (and below
/// them) or files form. With several inputs, each is one frame. Reads the tags of every file at
/// once and pixels frame by frame. `series` chooses among several images, see choose_image().
/// kBadInput if there is none, or if several could be meant.
Result<std::unique_ptr<FrameSource>> open_dicom(const std::vector<std::filesystem::path>& inputs,
                                                const std::string& series = {});

}  // namespace palpate::files
