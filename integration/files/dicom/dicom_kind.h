#pragma once

#include <array>
#include <string>

#include "integration/files/dicom/dicom_elements.h"
#include "integration/files/dicom/dicom_layout.h"

namespace palpate::files {

/// One frame of a file: in an enhanced file most values stand in sequences, for this frame or for
/// all; in any other they stand at the top.
class FrameTags {
 public:
  FrameTags(const DicomElements& file, size_t frame);

  /// The elements among which `tag` stands: those of `group` of the frame, of all frames, or those
  /// at the top.
  const DicomElements& with(uint32_t group, uint32_t tag) const;
  std::optional<double> real(uint32_t group, uint32_t tag) const {
    return with(group, tag).real(tag);
  }
  const DicomElements& file() const { return file_; }

 private:
  const DicomElements& file_;
  std::array<const DicomElements*, 2> groups_;
};

/// The kind of the frame, see KindTag.
std::array<std::string, kKindTags> kind_of(const FrameTags& frame);

/// What a complex image shows of its signal, by image type and component.
enum class SignalPart { kUnknown, kMagnitude, kOther };
SignalPart component_of(const DicomSlice& slice);

/// Which of a mosaic's tiles is a slice, and along which direction they follow; see kMosaicTiles.
struct Mosaic {
  int tiles = 0;           ///< 0: the file does not say it
  glm::dvec3 normal{0.0};  ///< from slice to slice; 0 where the file does not say it
};
/// True if the image type says that the picture is a mosaic and it is not already unfolded.
bool is_mosaic(const DicomElements& file);
Mosaic mosaic_of(const DicomElements& file);

}  // namespace palpate::files
