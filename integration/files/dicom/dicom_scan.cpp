#include "integration/files/dicom/dicom_scan.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "integration/files/dicom/dicom_elements.h"
#include "integration/files/dicom/dicom_identity.h"
#include "integration/files/dicom/dicom_kind.h"
#include "integration/files/dicom/dicom_pixels.h"
#include "integration/files/dicom/dicom_tags.h"
#include "integration/files/raster/mapped_file.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Rows and columns are stored in 16 bits.
constexpr int kMostPixels = 65535;

std::vector<std::string> dicom_files(const std::filesystem::path& input) {
  std::vector<std::string> files;
  std::error_code error;
  const auto consider = [&](const std::filesystem::path& file) {
    if (file.filename().string().starts_with("DICOMDIR")) return;
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

/// One unit of the last decimal of a number as it is written: 0.01 of "-12.25".
double unit_of(std::string_view text) {
  double unit = 1.0;
  bool behind_point = false;
  for (size_t at = 0; at < text.size(); ++at) {
    if (text[at] == 'e' || text[at] == 'E')
      return unit * std::pow(10.0, to_number(text.substr(at + 1)).value_or(0.0));
    if (behind_point && text[at] >= '0' && text[at] <= '9') unit *= 0.1;
    behind_point = behind_point || text[at] == '.';
  }
  return unit;
}

/// Where the frame lies: as seen from the patient, or from the probe in volumes of ultrasound.
bool place(const FrameTags& frame, DicomSlice& slice) {
  auto position = frame.with(tags::kPlanePosition, tags::kPosition).numbers(tags::kPosition, 3);
  // Trailing zeros may have been left out: the most decimals of the three count.
  const std::string text = frame.with(tags::kPlanePosition, tags::kPosition).text(tags::kPosition);
  double unit_mm = 1.0;
  for (const std::string_view cell : cells(text, '\\')) unit_mm = std::min(unit_mm, unit_of(cell));
  auto orientation =
      frame.with(tags::kPlaneOrientation, tags::kOrientation).numbers(tags::kOrientation, 6);
  if (position.empty() && orientation.empty()) {
    position = frame.with(tags::kVolumePosition, tags::kImagePositionVolume)
                   .reals(tags::kImagePositionVolume, 3);
    orientation = frame.with(tags::kVolumeOrientation, tags::kImageOrientationVolume)
                      .reals(tags::kImageOrientationVolume, 6);
    unit_mm = 0.0;
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
  slice.position_unit_mm = unit_mm;
  slice.along_row = {orientation[0], orientation[1], orientation[2]};
  slice.along_column = {orientation[3], orientation[4], orientation[5]};
  return true;
}

/// "TP20PC" -> 20: GE writes the phase of a gated CT among the options of the scan.
std::optional<double> percent_of_options(const std::string& options) {
  for (const std::string_view option : cells(options, '\\')) {
    if (option.starts_with("TP") && option.ends_with("PC") && option.size() > 4)
      return to_number(option.substr(2, option.size() - 4));
  }
  return std::nullopt;
}

/// Heart or breath steered the acquisition: its times are not those of the motion.
bool is_gated(const DicomElements& file) {
  const std::string technique = file.text(tags::kCardiacTechnique);
  if (!technique.empty() && technique != "NONE") return true;
  for (const uint32_t tag : {tags::kNominalInterval, tags::kHeartRate, tags::kCardiacImages}) {
    if (file.number(tag).value_or(0.0) > 0.0) return true;
  }
  for (const std::string_view option : cells(file.text(tags::kScanOptions), '\\')) {
    for (const char* gate : {"CG", "RG", "PPG", "CARD_GATE", "GATED", "RESP_GATE"}) {
      if (option == gate) return true;
    }
  }
  return false;
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
  if (!slice.phase_percent) slice.phase_percent = file.number(tags::kCardiacPhase);
  slice.phase_number = file.whole(tags::kPhilipsPhase);
  if (!slice.phase_number) slice.phase_number = file.number(tags::kPhilipsPhase);
  slice.scan_percent = percent_of_options(file.text(tags::kScanOptions));
  slice.instance_number = file.number(tags::kInstanceNumber);
  slice.is_gated = is_gated(file);
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
  if (const auto content = time_of_day_s(file.text(tags::kContentTime)))
    slice.content_time_s = start_of_day_s(file.text(tags::kContentDate)) + *content;
}

/// Why a whole and readable file holds no slices that palpate can use, if it does not.
std::optional<Error> not_a_slice(const std::string& file, const DicomElements& elements) {
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
  const std::string modality = elements.text(tags::kModality);
  if (modality == "SEG" || modality == "RTDOSE") {
    return bad_input(file, "is a {}, no image: name the folder of the images",
                     modality == "SEG" ? "segmentation in DICOM's own form" : "dose distribution");
  }
  if (elements.number(tags::kNumberOfFrames).value_or(1.0) > 1.0 &&
      elements.sequences.count(tags::kFrameGroups) == 0) {
    return bad_input(
        file,
        "is a multi-frame DICOM file that does not say where its frames lie: export it "
        "as enhanced multi-frame, or as one file per slice");
  }
  DicomSlice slice;
  if (!place(FrameTags(elements, 0), slice)) {
    return bad_input(file,
                     "does not say where its slice lies (image position, orientation or pixel "
                     "spacing is missing): export the scan with these tags");
  }
  return std::nullopt;
}

/// How many frames there are, or how the file is damaged.
Result<size_t> count_frames(const std::string& file, const DicomElements& elements) {
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
  if (claimed != double(placed)) {
    return bad_input(file, "claims {} frames but describes {}: export it again", claimed, placed);
  }
  return placed;
}

/// The slices of a mosaic: tiles in rows, the position is that of the whole picture's corner as if
/// it were one slice.
Status add_tiles(const DicomElements& elements, const DicomSlice& picture,
                 std::vector<DicomSlice>& slices) {
  const Mosaic mosaic = mosaic_of(elements);
  const int across = int(std::ceil(std::sqrt(double(mosaic.tiles))));
  if (mosaic.tiles > 0 && (picture.size.x % across != 0 || picture.size.y % across != 0)) {
    return bad_input(picture.file,
                     "is a mosaic of {} slices that do not fit its {} x {} pixels: convert the "
                     "original files with dcm2niix, and give palpate the NIfTI file",
                     mosaic.tiles, picture.size.x, picture.size.y);
  }
  if (mosaic.tiles < 1) {
    return bad_input(picture.file,
                     "is a mosaic of slices that does not say how many they are: convert "
                     "it with dcm2niix, and give palpate the NIfTI file");
  }
  DicomSlice slice = picture;
  slice.size = picture.size / across;
  const glm::dvec3 normal = glm::cross(picture.along_row, picture.along_column);
  const double direction = glm::dot(normal, mosaic.normal) < 0.0 ? -1.0 : 1.0;
  const double step_mm =
      elements.number(tags::kSpacingBetweenSlices).value_or(picture.thickness_mm);
  const glm::dvec2 beside = 0.5 * glm::dvec2(picture.size - slice.size) * picture.spacing_mm;
  const glm::dvec3 corner =
      picture.position_mm + beside.x * picture.along_row + beside.y * picture.along_column;
  for (int tile = 0; tile < mosaic.tiles; ++tile) {
    slice.first_pixel = slice.size * glm::ivec2(tile % across, tile / across);
    slice.position_mm = corner + double(tile) * direction * step_mm * normal;
    slices.push_back(slice);
  }
  return Nothing{};
}

Status add_slices(const std::string& file, const DicomElements& elements,
                  std::vector<DicomSlice>& slices) {
  const auto count = count_frames(file, elements);
  if (!count) return count.error();
  DicomSlice slice;
  slice.file = file;
  slice.owner = elements.text(tags::kPatient) + "|" + elements.text(tags::kStudy) + "|" +
                elements.text(tags::kModality);
  slice.instance = elements.text(tags::kSopInstance);
  slice.series = elements.text(tags::kSeries);
  slice.series_number = elements.number(tags::kSeriesNumber).value_or(0.0);
  slice.series_description = without_identity(elements.text(tags::kSeriesDescription), elements);
  slice.size = {*elements.whole(tags::kColumns), *elements.whole(tags::kRows)};
  slice.picture_size = slice.size;
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
    // No picture is meant to be one constant: GDCM and NIfTI read a slope of 0 as none.
    if (slice.slope == 0.0) slice.slope = 1.0;
    slice.intercept = frame.with(tags::kPixelValueTransformation, tags::kIntercept)
                          .number(tags::kIntercept)
                          .value_or(0.0);
    slice.kind = kind_of(frame);
    for (std::string& text : slice.kind) text = without_identity(text, elements);
    slice.acquisition_time_s.reset();
    find_time(elements, frame, slice);
    if (!is_mosaic(elements)) {
      slices.push_back(slice);
    } else if (const Status added = add_tiles(elements, slice, slices); !added) {
      return added;
    }
  }
  return Nothing{};
}

/// True if the pixels of two files are the same bytes.
bool have_equal_pixels(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto first = MappedFile::open(a), second = MappedFile::open(b);
  if (!first || !second) return false;
  const auto one = parse_dicom(a, first->bytes()), other = parse_dicom(b, second->bytes());
  return one && other && one->pixels == other->pixels && one->fragments == other->fragments;
}

/// Times without a date that pass midnight: those after it come last.
void unwrap_midnight(std::vector<DicomSlice>& slices, std::optional<double> DicomSlice::*time_s) {
  constexpr double kDay = 86400.0;
  std::map<std::string, std::vector<DicomSlice*>> series;
  for (DicomSlice& slice : slices)
    if (slice.*time_s && *(slice.*time_s) < kDay) series[slice.series].push_back(&slice);
  for (auto& [uid, all] : series) {
    const auto [first, last] = std::minmax_element(
        all.begin(), all.end(),
        [&](const DicomSlice* a, const DicomSlice* b) { return *(a->*time_s) < *(b->*time_s); });
    if (*((*last)->*time_s) - *((*first)->*time_s) <= 0.5 * kDay) continue;
    for (DicomSlice* slice : all)
      if (*(slice->*time_s) < 0.5 * kDay) slice->*time_s = *(slice->*time_s) + kDay;
  }
}

/// A whole file that holds no slice.
struct LeftOut {
  std::string name;
  Error why;
};

std::string left_out_note(const std::vector<LeftOut>& files) {
  std::string name = std::filesystem::path(files.front().name).filename().string();
  const std::string& message = files.front().why.message;
  // The sentence about the file, without its name and without the advice.
  const size_t begin = message.find("' ");
  std::string why = begin == std::string::npos ? message : message.substr(begin + 2);
  if (const size_t colon = why.find(": "); colon != std::string::npos) why.resize(colon);
  if (files.size() == 1) return fmt::format("'{}' is left out: it {}.", name, why);
  return fmt::format("{} files are left out, the first is '{}': it {}.", files.size(), name, why);
}

}  // namespace

Result<DicomScan> scan_dicom(const std::filesystem::path& input) {
  std::error_code error;
  // The directory of a disc lists what lies in its folder.
  const bool is_directory_file =
      input.filename() == "DICOMDIR" && std::filesystem::is_regular_file(input, error);
  const std::filesystem::path root = is_directory_file ? input.parent_path() : input;
  const bool is_folder = is_directory_file || std::filesystem::is_directory(root, error);
  const auto files = dicom_files(is_directory_file && root.empty() ? "." : root);
  if (files.empty()) {
    return bad_input(input,
                     "holds nothing that palpate can read: name a folder with DICOM, NRRD, "
                     "MetaImage or NIfTI files");
  }
  DicomScan scan;
  std::vector<LeftOut> left_out;
  std::map<std::string, std::string> file_of;  // of each instance, where it was seen first
  std::set<std::string> other_modalities;
  size_t copies = 0;
  for (const std::string& name : files) {
    const auto file = MappedFile::open(name);
    if (!file) return file.error();
    const auto elements = parse_dicom(name, file->bytes());
    if (!elements) return elements.error();
    // Structured reports and the like have no rows; they are not part of the image.
    if (elements->values.count(tags::kRows) == 0) {
      other_modalities.insert(elements->text(tags::kModality));
      continue;
    }
    if (!elements->has_pixels)
      return bad_input(name, "has no pixels: the file is cut short, export it again");
    // The same image exported twice is one image; some programs give one name to all, though.
    const std::string instance = elements->text(tags::kSopInstance);
    const auto [seen, is_new] = file_of.emplace(instance, name);
    if (!is_new && !instance.empty() && have_equal_pixels(seen->second, name)) {
      ++copies;
      continue;
    }
    if (const auto why = not_a_slice(name, *elements)) {
      if (!is_folder) return *why;
      left_out.push_back({name, *why});
    } else if (const Status added = add_slices(name, *elements, scan.slices); !added) {
      return added.error();
    }
  }
  if (scan.slices.empty() && !left_out.empty()) return left_out.front().why;
  if (scan.slices.empty()) {
    other_modalities.erase("");
    return bad_input(input, "is DICOM but {} no image{}: name the folder of the images",
                     is_folder ? "holds" : "is",
                     other_modalities.empty()
                         ? ""
                         : fmt::format(" (modality {})", fmt::join(other_modalities, ", ")));
  }
  unwrap_midnight(scan.slices, &DicomSlice::acquisition_time_s);
  unwrap_midnight(scan.slices, &DicomSlice::content_time_s);
  if (!left_out.empty()) scan.notes.push_back(left_out_note(left_out));
  if (copies > 0) {
    scan.notes.push_back(
        fmt::format("It holds {} {} twice (the same SOP instance): the copies are left out.",
                    copies, copies == 1 ? "image" : "images"));
  }
  return scan;
}

}  // namespace palpate::files
