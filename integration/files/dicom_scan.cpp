#include "integration/files/dicom_scan.h"

#include <gdcmScanner.h>
#include <gdcmTrace.h>
#include <itkGDCMImageIO.h>

#include <algorithm>
#include <cmath>

#include "integration/files/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

const gdcm::Tag kDescription(0x0008, 0x103e), kThickness(0x0018, 0x0050), kTrigger(0x0018, 0x1060),
    kSeries(0x0020, 0x000e), kSeriesNumber(0x0020, 0x0011), kAcquisition(0x0020, 0x0012),
    kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037), kTemporal(0x0020, 0x0100),
    kResolution(0x0020, 0x0110), kPhase(0x0020, 0x9241), kFrames(0x0028, 0x0008),
    kRows(0x0028, 0x0010), kColumns(0x0028, 0x0011), kSpacing(0x0028, 0x0030);

/// Both libraries talk to the console of their own accord; a library must not.
void silence_once() {
  static const bool done = [] {
    gdcm::Trace::DebugOff();
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    itk::Object::GlobalWarningDisplayOff();
    return true;
  }();
  (void)done;
}

/// Tags of one file as text.
class Tags {
 public:
  Tags(const gdcm::Scanner& scanner, const std::string& file) : scanner_(scanner), file_(file) {}

  std::string text(const gdcm::Tag& tag) const {
    const char* value = scanner_.GetValue(file_.c_str(), tag);
    return value == nullptr ? std::string{} : std::string(trimmed(value));
  }
  std::optional<double> number(const gdcm::Tag& tag) const { return to_number(text(tag)); }

  /// "1\2\3" -> 1 2 3; empty if there are not `count` finite numbers.
  std::vector<double> numbers(const gdcm::Tag& tag, size_t count) const {
    std::vector<double> values;
    for (const std::string_view cell : cells(text(tag), '\\')) {
      const auto value = to_number(cell);
      if (value && std::isfinite(*value)) values.push_back(*value);
    }
    if (values.size() != count) values.clear();
    return values;
  }

 private:
  const gdcm::Scanner& scanner_;
  const std::string& file_;
};

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

Result<DicomSlice> slice_of(const std::string& file, const Tags& tags) {
  DicomSlice slice;
  slice.file = file;
  if (tags.number(kFrames).value_or(1.0) > 1.0) {
    return bad_input(file,
                     "is a multi-frame DICOM file, which palpate does not read: split it into one "
                     "file per slice");
  }
  const auto position = tags.numbers(kPosition, 3), orientation = tags.numbers(kOrientation, 6),
             spacing = tags.numbers(kSpacing, 2);
  if (position.empty() || orientation.empty() || spacing.empty()) {
    return bad_input(file,
                     "does not say where its slice lies (image position, orientation or pixel "
                     "spacing is missing): "
                     "export the scan with these tags");
  }
  slice.series = tags.text(kSeries);
  slice.series_number = tags.number(kSeriesNumber).value_or(0.0);
  slice.series_description = tags.text(kDescription);
  const double columns = tags.number(kColumns).value_or(0.0),
               rows = tags.number(kRows).value_or(0.0);
  if (!(columns >= 1.0 && columns <= 65535.0 && rows >= 1.0 && rows <= 65535.0)) {
    return bad_input(file, "claims {} x {} pixels: the file is damaged, export it again", columns,
                     rows);
  }
  slice.size = glm::ivec2(int(columns), int(rows));
  // The tag gives the distance between rows first.
  slice.spacing_mm = {spacing[1], spacing[0]};
  slice.thickness_mm = tags.number(kThickness).value_or(1.0);
  slice.position_mm = {position[0], position[1], position[2]};
  slice.along_row = {orientation[0], orientation[1], orientation[2]};
  slice.along_column = {orientation[3], orientation[4], orientation[5]};
  slice.temporal_position = tags.number(kTemporal);
  slice.trigger_time_ms = tags.number(kTrigger);
  slice.cardiac_phase_percent = tags.number(kPhase);
  slice.acquisition_number = tags.number(kAcquisition);
  slice.temporal_resolution_ms = tags.number(kResolution);
  return slice;
}

/// The type that ITK chose after it applied slope and intercept.
bool copy_samples(itk::IOComponentEnum type, const std::vector<char>& from, size_t n, float* to) {
  const auto as_float = [&](auto zero) {
    using T = decltype(zero);
    const T* values = reinterpret_cast<const T*>(from.data());
    std::transform(values, values + n, to, [](T value) { return float(value); });
    return true;
  };
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return as_float(uint8_t{});
    case itk::IOComponentEnum::CHAR:
      return as_float(int8_t{});
    case itk::IOComponentEnum::USHORT:
      return as_float(uint16_t{});
    case itk::IOComponentEnum::SHORT:
      return as_float(int16_t{});
    case itk::IOComponentEnum::UINT:
      return as_float(uint32_t{});
    case itk::IOComponentEnum::INT:
      return as_float(int32_t{});
    case itk::IOComponentEnum::FLOAT:
      return as_float(float{});
    case itk::IOComponentEnum::DOUBLE:
      return as_float(double{});
    default:
      return false;
  }
}

}  // namespace

Result<std::vector<DicomSlice>> scan_dicom(const std::filesystem::path& input) {
  silence_once();
  const auto files = dicom_files(input);
  if (!files) return files.error();
  std::vector<DicomSlice> slices;
  try {
    gdcm::Scanner scanner;
    for (const auto& tag :
         {kDescription, kThickness, kTrigger, kSeries, kSeriesNumber, kAcquisition, kPosition,
          kOrientation, kTemporal, kResolution, kPhase, kFrames, kRows, kColumns, kSpacing}) {
      scanner.AddTag(tag);
    }
    if (!scanner.Scan(*files))
      return bad_input(input, "holds DICOM files that can not be read: export the scan again");
    for (const std::string& file : *files) {
      const Tags tags(scanner, file);
      if (!scanner.IsKey(file.c_str()))
        return bad_input(file, "is a damaged DICOM file: export it again");
      // Structured reports and the like have no rows; they are no part of the picture.
      if (tags.text(kRows).empty()) continue;
      auto slice = slice_of(file, tags);
      if (!slice) return slice.error();
      slices.push_back(std::move(*slice));
    }
  } catch (const std::exception&) {
    return bad_input(input, "holds a damaged DICOM file: export the scan again");
  }
  return slices;
}

Status read_dicom_slice(const DicomSlice& slice, float* values) {
  silence_once();
  const auto damaged = [&] {
    return bad_input(slice.file, "is damaged or cut short: export it again");
  };
  try {
    auto io = itk::GDCMImageIO::New();
    io->SetFileName(slice.file.string());
    io->ReadImageInformation();
    const size_t n = size_t(slice.size.x) * size_t(slice.size.y);
    if (io->GetNumberOfComponents() != 1) {
      return bad_input(slice.file, "holds a colour picture: palpate reads gray images");
    }
    if (io->GetImageSizeInPixels() != itk::ImageIOBase::SizeType(n)) return damaged();
    std::vector<char> bytes(size_t(io->GetImageSizeInBytes()));
    io->Read(bytes.data());
    if (bytes.size() < n * io->GetComponentSize() ||
        !copy_samples(io->GetComponentType(), bytes, n, values)) {
      return damaged();
    }
  } catch (const std::exception&) {
    return damaged();
  }
  return Nothing{};
}

}  // namespace palpate::files
