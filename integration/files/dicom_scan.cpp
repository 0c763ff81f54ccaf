#include "integration/files/dicom_scan.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <tuple>

#include "integration/files/dicom_elements.h"
#include "integration/files/dicom_identity.h"
#include "integration/files/dicom_pixels.h"
#include "integration/files/dicom_tags.h"
#include "integration/files/mapped_file.h"
#include "integration/files/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Rows and columns are stored in 16 bits.
constexpr int kMostPixels = 65535;

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

/// Seconds of the day of "142501.25", "1425" or "14:25:01".
std::optional<double> time_of_day_s(std::string_view text) {
  std::string plain(text);
  std::erase(plain, ':');
  if (plain.size() < 2) return std::nullopt;
  const auto hours = to_integer(plain.substr(0, 2)),
             minutes = plain.size() < 4 ? int64_t{0} : to_integer(plain.substr(2, 2));
  const auto seconds = plain.size() < 6 ? 0.0 : to_number(plain.substr(4));
  if (!hours || !minutes || !seconds || *hours < 0 || *hours > 23 || *minutes < 0 ||
      *minutes > 59 || !(*seconds >= 0.0 && *seconds <= 60.0))
    return std::nullopt;
  return 3600.0 * double(*hours) + 60.0 * double(*minutes) + *seconds;
}

/// Seconds from 1970 to the start of "20240131" or "2024.01.31"; 0 where it is no date.
double start_of_day_s(std::string_view text) {
  std::string plain(text);
  std::erase(plain, '.');
  const auto number = plain.size() == 8 ? to_integer(plain) : std::nullopt;
  if (!number || *number < 0) return 0.0;
  const std::chrono::year_month_day date(std::chrono::year(int(*number / 10000)),
                                         std::chrono::month(unsigned(*number / 100 % 100)),
                                         std::chrono::day(unsigned(*number % 100)));
  if (!date.ok()) return 0.0;
  return 86400.0 * double(std::chrono::sys_days(date).time_since_epoch().count());
}

/// "20240131142501.25+0100"; the zone is the same for all slices of a scan.
std::optional<double> date_and_time_s(std::string_view text) {
  text = text.substr(0, text.find_first_of("+-&"));
  if (text.size() < 10) return std::nullopt;
  const auto time = time_of_day_s(text.substr(8));
  return time ? std::optional(start_of_day_s(text.substr(0, 8)) + *time) : std::nullopt;
}

/// One frame of a file: in an enhanced file most values stand in sequences, for this frame or for
/// all; in any other they stand at the top.
class FrameTags {
 public:
  FrameTags(const DicomElements& file, size_t frame) : file_(file) {
    const auto groups_of = [&](uint32_t tag, size_t n) -> const DicomElements* {
      const auto found = file.sequences.find(tag);
      return found == file.sequences.end() || n >= found->second.size() ? nullptr
                                                                        : &found->second[n];
    };
    groups_ = {groups_of(tags::kFrameGroups, frame), groups_of(tags::kSharedGroups, 0)};
  }

  /// The elements among which `tag` stands: those of `group` of the frame, of all frames, or those
  /// at the top.
  const DicomElements& with(uint32_t group, uint32_t tag) const {
    for (const DicomElements* const groups : groups_) {
      if (!groups) continue;
      const auto found = groups->sequences.find(group);
      if (found == groups->sequences.end() || found->second.empty()) continue;
      if (found->second.front().values.count(tag)) return found->second.front();
    }
    return file_;
  }
  std::optional<double> real(uint32_t group, uint32_t tag) const {
    return with(group, tag).real(tag);
  }

 private:
  const DicomElements& file_;
  std::array<const DicomElements*, 2> groups_;
};

/// Where the frame lies: as seen from the patient, or from the probe in volumes of ultrasound.
bool place(const FrameTags& frame, DicomSlice& slice) {
  auto position = frame.with(tags::kPlanePosition, tags::kPosition).numbers(tags::kPosition, 3);
  auto orientation =
      frame.with(tags::kPlaneOrientation, tags::kOrientation).numbers(tags::kOrientation, 6);
  if (position.empty() && orientation.empty()) {
    position = frame.with(tags::kVolumePosition, tags::kImagePositionVolume)
                   .reals(tags::kImagePositionVolume, 3);
    orientation = frame.with(tags::kVolumeOrientation, tags::kImageOrientationVolume)
                      .reals(tags::kImageOrientationVolume, 6);
  }
  const auto spacing =
      frame.with(tags::kPixelMeasures, tags::kPixelSpacing).numbers(tags::kPixelSpacing, 2);
  if (position.empty() || orientation.empty() || spacing.empty()) return false;
  // The tag gives the distance between rows first.
  slice.spacing_mm = {spacing[1], spacing[0]};
  slice.thickness_mm = frame.with(tags::kPixelMeasures, tags::kSliceThickness)
                           .number(tags::kSliceThickness)
                           .value_or(1.0);
  slice.position_mm = {position[0], position[1], position[2]};
  slice.along_row = {orientation[0], orientation[1], orientation[2]};
  slice.along_column = {orientation[3], orientation[4], orientation[5]};
  return true;
}

/// Reads everything that may give the time of a frame.
void find_time(const DicomElements& file, const FrameTags& frame, DicomSlice& slice) {
  slice.temporal_position = file.number(tags::kTemporalPosition);
  if (const auto index = frame.with(tags::kFrameContent, tags::kTemporalPositionIndex)
                             .whole(tags::kTemporalPositionIndex))
    slice.temporal_position = *index;
  slice.trigger_time_ms = file.number(tags::kTriggerTime);
  for (const auto& [group, tag, ms] :
       {std::tuple(tags::kCardiacSynchronization, tags::kCardiacDelay, 1.0),
        std::tuple(tags::kRespiratorySynchronization, tags::kRespiratoryDelay, 1.0),
        std::tuple(tags::kTemporalPositionGroup, tags::kTemporalOffset, 1e3)}) {
    const auto time = frame.real(group, tag);
    if (!slice.trigger_time_ms && time) slice.trigger_time_ms = ms * *time;
  }
  slice.phase_percent = frame.real(tags::kCardiacSynchronization, tags::kCardiacPhase);
  if (!slice.phase_percent)
    slice.phase_percent = frame.real(tags::kRespiratorySynchronization, tags::kRespiratoryPhase);
  slice.acquisition_number = file.number(tags::kAcquisitionNumber);
  if (const auto number = frame.with(tags::kFrameContent, tags::kFrameAcquisitionNumber)
                              .whole(tags::kFrameAcquisitionNumber))
    slice.acquisition_number = *number;
  slice.frame_reference_ms = file.number(tags::kFrameReferenceTime);
  slice.temporal_resolution_ms = file.number(tags::kTemporalResolution);
  for (const uint32_t tag : {tags::kFrameAcquisitionTime, tags::kFrameReferenceDateTime}) {
    if (!slice.acquisition_time_s)
      slice.acquisition_time_s = date_and_time_s(frame.with(tags::kFrameContent, tag).text(tag));
  }
  if (!slice.acquisition_time_s)
    slice.acquisition_time_s = date_and_time_s(file.text(tags::kAcquisitionDateTime));
  const auto time = time_of_day_s(file.text(tags::kAcquisitionTime));
  if (!slice.acquisition_time_s && time)
    slice.acquisition_time_s = start_of_day_s(file.text(tags::kAcquisitionDate)) + *time;
}

/// How many frames there are, or why they can not be read.
Result<size_t> count_frames(const std::string& file, const DicomElements& elements) {
  if (elements.whole(tags::kSamplesPerPixel).value_or(1) != 1) {
    return bad_input(file,
                     "is a colour picture, but palpate reads gray ones: keep it out of the folder");
  }
  // Its values are numbers of colours in a table, in no order that means anything.
  if (elements.text(tags::kPhotometric) == "PALETTE COLOR") {
    return bad_input(file,
                     "is a picture of numbered colours (PALETTE COLOR), but palpate reads gray "
                     "ones: keep it out of the folder, or export it in gray");
  }
  for (const uint32_t tag : {tags::kRows, tags::kColumns}) {
    const int size = elements.whole(tag).value_or(0);
    if (size < 1 || size > kMostPixels) {
      return bad_input(file, "claims {} rows or columns: the file is damaged, export it again",
                       size);
    }
  }
  const double claimed = elements.number(tags::kNumberOfFrames).value_or(1.0);
  const auto groups = elements.sequences.find(tags::kFrameGroups);
  const size_t placed = groups == elements.sequences.end() ? 0 : groups->second.size();
  if (claimed <= 1.0) return size_t{1};
  if (placed == 0) {
    return bad_input(
        file,
        "is a multi-frame DICOM file that does not say where its frames lie: export it "
        "as enhanced multi-frame, or as one file per slice");
  }
  if (claimed != double(placed)) {
    return bad_input(file, "claims {} frames but describes {}: export it again", claimed, placed);
  }
  return placed;
}

Status add_slices(const std::string& file, const DicomElements& elements,
                  std::vector<DicomSlice>& slices) {
  const auto count = count_frames(file, elements);
  if (!count) return count.error();
  DicomSlice slice;
  slice.file = file;
  slice.series = elements.text(tags::kSeries);
  slice.series_number = elements.number(tags::kSeriesNumber).value_or(0.0);
  slice.series_description = without_identity(elements.text(tags::kSeriesDescription), elements);
  slice.size = {*elements.whole(tags::kColumns), *elements.whole(tags::kRows)};
  slice.frames_in_file = *count;
  if (const Status checked = check_pixels(elements, slice); !checked) return checked;
  for (slice.frame = 0; slice.frame < *count; ++slice.frame) {
    const FrameTags frame(elements, slice.frame);
    if (!place(frame, slice)) {
      return bad_input(file,
                       "does not say where its slice lies (image position, orientation or pixel "
                       "spacing is missing): export the scan with these tags");
    }
    slice.slope = frame.with(tags::kPixelValueTransformation, tags::kSlope)
                      .number(tags::kSlope)
                      .value_or(1.0);
    slice.intercept = frame.with(tags::kPixelValueTransformation, tags::kIntercept)
                          .number(tags::kIntercept)
                          .value_or(0.0);
    slice.acquisition_time_s.reset();
    find_time(elements, frame, slice);
    slices.push_back(slice);
  }
  return Nothing{};
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
    // Structured reports and the like have no rows; they are not part of the image.
    if (elements->values.count(tags::kRows) == 0) continue;
    if (!elements->has_pixels)
      return bad_input(name, "has no pixels: the file is cut short, export it again");
    if (const Status added = add_slices(name, *elements, slices); !added) return added.error();
  }
  return slices;
}

}  // namespace palpate::files
