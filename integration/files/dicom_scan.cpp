#include "integration/files/dicom_scan.h"

#include <algorithm>

#include "integration/files/dicom_elements.h"
#include "integration/files/dicom_tags.h"
#include "integration/files/mapped_file.h"
#include "integration/files/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

Result<std::vector<std::string>> dicom_files(const std::filesystem::path& input) {
  std::vector<std::string> files;
  std::error_code error;
  const auto consider = [&](const std::filesystem::path& file) {
    if (file.filename() == "DICOMDIR") return;
    const auto kind = sniff(file);
    if (kind && *kind == FileKind::kDicom) files.push_back(file.string());
  };
  if (std::filesystem::is_regular_file(input, error)) consider(input);
  if (std::filesystem::is_directory(input, error)) {
    constexpr auto kOptions = std::filesystem::directory_options::skip_permission_denied;
    std::filesystem::recursive_directory_iterator walk(input, kOptions, error), end;
    for (; !error && walk != end; walk.increment(error)) {
      if (walk->is_regular_file(error)) consider(walk->path());
    }
  }
  if (files.empty()) {
    return bad_input(input,
                     "holds nothing that palpate can read: name a folder with DICOM, NRRD, "
                     "MetaImage or NIfTI files");
  }
  std::sort(files.begin(), files.end(), natural_less);
  return files;
}

Status check_kind(const std::string& file, const DicomElements& elements) {
  if (elements.number(tags::kNumberOfFrames).value_or(1.0) > 1.0) {
    return bad_input(file,
                     "is a multi-frame DICOM file, which palpate does not read: split it into one "
                     "file per slice");
  }
  if (elements.whole(tags::kSamplesPerPixel).value_or(1) != 1) {
    return bad_input(file,
                     "is a colour picture, but palpate reads gray ones: keep it out of the folder");
  }
  if (elements.whole(tags::kRows).value_or(0) < 1 ||
      elements.whole(tags::kColumns).value_or(0) < 1) {
    return bad_input(file, "claims no pixels: the file is damaged, export it again");
  }
  return Nothing{};
}

Result<DicomSlice> slice_of(const std::string& file, const DicomElements& elements) {
  if (const Status sound = check_kind(file, elements); !sound) return sound.error();
  const auto position = elements.numbers(tags::kPosition, 3),
             orientation = elements.numbers(tags::kOrientation, 6),
             spacing = elements.numbers(tags::kPixelSpacing, 2);
  if (position.empty() || orientation.empty() || spacing.empty()) {
    return bad_input(file,
                     "does not say where its slice lies (image position, orientation or pixel "
                     "spacing is missing): "
                     "export the scan with these tags");
  }
  DicomSlice slice;
  slice.file = file;
  slice.series = elements.text(tags::kSeries);
  slice.series_number = elements.number(tags::kSeriesNumber).value_or(0.0);
  slice.series_description = elements.text(tags::kSeriesDescription);
  slice.size = {*elements.whole(tags::kColumns), *elements.whole(tags::kRows)};
  // The tag gives the distance between rows first.
  slice.spacing_mm = {spacing[1], spacing[0]};
  slice.thickness_mm = elements.number(tags::kSliceThickness).value_or(1.0);
  slice.position_mm = {position[0], position[1], position[2]};
  slice.along_row = {orientation[0], orientation[1], orientation[2]};
  slice.along_column = {orientation[3], orientation[4], orientation[5]};
  slice.temporal_position = elements.number(tags::kTemporalPosition);
  slice.trigger_time_ms = elements.number(tags::kTriggerTime);
  slice.cardiac_phase_percent = elements.real(tags::kCardiacPhase);
  slice.acquisition_number = elements.number(tags::kAcquisitionNumber);
  slice.temporal_resolution_ms = elements.number(tags::kTemporalResolution);
  return slice;
}

}  // namespace

Result<std::vector<DicomSlice>> scan_dicom(const std::filesystem::path& input) {
  const auto files = dicom_files(input);
  if (!files) return files.error();
  std::vector<DicomSlice> slices;
  for (const std::string& name : *files) {
    const auto file = MappedFile::open(name);
    if (!file) return file.error();
    const auto elements = parse_dicom(name, file->bytes());
    if (!elements) return elements.error();
    // Structured reports and the like have no rows; they are no part of the picture.
    if (elements->values.count(tags::kRows) == 0) continue;
    if (!elements->has_pixels)
      return bad_input(name, "has no pixels: the file is cut short, export it again");
    auto slice = slice_of(name, *elements);
    if (!slice) return slice.error();
    slices.push_back(std::move(*slice));
  }
  return slices;
}

}  // namespace palpate::files
