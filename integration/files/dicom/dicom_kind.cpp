#include "integration/files/dicom/dicom_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "integration/files/dicom/dicom_tags.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

/// Echo times and the like are equal if they agree to about a hundredth: scanners write what they
/// could realise.
std::string rounded(std::optional<double> value) {
  if (!value) return {};
  // Rounded, then written without an exponent: 1000, not 1e+03.
  return fmt::format("{:g}", to_number(fmt::format("{:.3g}", *value)).value_or(*value));
}

/// True if the block of private elements of `group` is the maker's.
bool is_private_of(const DicomElements& file, uint32_t group, std::string_view maker) {
  for (uint32_t block = 0x10; block < 0x20; ++block) {
    if (lowered(file.text(group << 16 | block)).find(maker) != std::string::npos) return true;
  }
  return false;
}

std::string private_text(const DicomElements& file, uint32_t tag, std::string_view maker) {
  return is_private_of(file, tag >> 16, maker) ? file.text(tag) : std::string();
}

/// Words that say how a picture was corrected for the screen, not what it shows.
bool is_display_word(std::string_view word) {
  for (const char* known : {"ND", "DIS2D", "DIS3D", "FIL", "MFSPLIT", "NONE"}) {
    if (word == known) return true;
  }
  return word.empty();
}

std::string image_type(const FrameTags& frame, bool first_two) {
  std::string text = frame.with(tags::kMrFrameType, tags::kFrameType).text(tags::kFrameType);
  if (text.empty()) text = frame.with(tags::kCtFrameType, tags::kFrameType).text(tags::kFrameType);
  if (text.empty()) text = frame.file().text(tags::kImageType);
  std::string kept;
  const auto parts = cells(text, '\\');
  for (size_t n = 0; n < parts.size(); ++n) {
    if ((n < 2) != first_two || is_display_word(parts[n])) continue;
    kept += (kept.empty() ? "" : "\\") + std::string(parts[n]);
  }
  return kept;
}

std::string complex_component(const FrameTags& frame) {
  std::string text =
      frame.with(tags::kMrFrameType, tags::kComplexComponent).text(tags::kComplexComponent);
  // "MIXED" stands at the top where frames differ.
  if (!text.empty() && text != "MIXED") return text;
  const DicomElements& file = frame.file();
  if (is_private_of(file, tags::kGeImageType >> 16, "gems")) {
    constexpr const char* kNames[] = {"MAGNITUDE", "PHASE", "REAL", "IMAGINARY"};
    const auto number = file.whole(tags::kGeImageType);
    if (number && *number >= 0 && *number < 4) return kNames[*number];
  }
  return private_text(file, tags::kPhilipsImageType, "philips");
}

std::string b_value(const FrameTags& frame) {
  const DicomElements& file = frame.file();
  if (const auto b = frame.real(tags::kMrDiffusion, tags::kBValue)) return rounded(b);
  if (is_private_of(file, tags::kSiemensB >> 16, "siemens"))
    return rounded(file.number(tags::kSiemensB));
  if (is_private_of(file, tags::kGeB >> 16, "gems")) {
    // "1000000800\0..": the value, and 1e9 added to it.
    const std::string all = file.text(tags::kGeB);
    const auto b = to_number(cells(all, '\\').front());
    return b ? rounded(std::fmod(*b, 1e5)) : std::string();
  }
  if (is_private_of(file, tags::kPhilipsB >> 16, "philips"))
    return rounded(file.real(tags::kPhilipsB));
  return {};
}

std::string first_of(std::string a, const std::string& b) {
  return a.empty() ? b : a;
}

/// One value of Siemens' own header: a list of named elements, each with texts in padded items.
std::vector<std::string> siemens_values(std::string_view header, std::string_view wanted) {
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    std::memcpy(&value, header.data() + at, sizeof(value));
    return size_t(value);
  };
  constexpr size_t kTagBytes = 84, kItemBytes = 16;
  if (header.size() < 16 || !header.starts_with("SV10")) return {};
  const size_t count = number(8);
  size_t at = 16;
  for (size_t tag = 0; tag < count && at + kTagBytes <= header.size(); ++tag) {
    const std::string_view name = header.substr(at, 64);
    const size_t items = number(at + 76);
    const bool is_wanted = name.substr(0, name.find('\0')) == wanted;
    std::vector<std::string> values;
    at += kTagBytes;
    for (size_t item = 0; item < items; ++item) {
      if (at + kItemBytes > header.size()) return {};
      const size_t length = number(at + 4);
      at += kItemBytes;
      if (length > header.size() - at) return {};
      const std::string_view value = header.substr(at, length);
      values.emplace_back(trimmed(value.substr(0, value.find('\0'))));
      at += std::min((length + 3) / 4 * 4, header.size() - at);
    }
    if (is_wanted) return values;
  }
  return {};
}

}  // namespace

FrameTags::FrameTags(const DicomElements& file, size_t frame) : file_(file) {
  const auto groups_of = [&](uint32_t tag, size_t n) -> const DicomElements* {
    const auto found = file.sequences.find(tag);
    return found == file.sequences.end() || n >= found->second.size() ? nullptr : &found->second[n];
  };
  groups_ = {groups_of(tags::kFrameGroups, frame), groups_of(tags::kSharedGroups, 0)};
}

const DicomElements& FrameTags::with(uint32_t group, uint32_t tag) const {
  for (const DicomElements* const groups : groups_) {
    if (!groups) continue;
    const auto found = groups->sequences.find(group);
    if (found == groups->sequences.end() || found->second.empty()) continue;
    if (found->second.front().values.count(tag)) return found->second.front();
  }
  return file_;
}

const char* name_of(KindTag tag) {
  switch (tag) {
    case KindTag::kImageType:
    case KindTag::kOriginality:
      return "image type (0008,0008)";
    case KindTag::kComplexComponent:
      return "complex component (0008,9208)";
    case KindTag::kEchoTime:
      return "echo time (0018,0081)";
    case KindTag::kEchoNumber:
      return "echo number (0018,0086)";
    case KindTag::kRepetitionTime:
      return "repetition time (0018,0080)";
    case KindTag::kInversionTime:
      return "inversion time (0018,0082)";
    case KindTag::kFlipAngle:
      return "flip angle (0018,1314)";
    case KindTag::kBValue:
      return "diffusion b-value (0018,9087)";
    case KindTag::kDiffusion:
      return "diffusion directionality (0018,9075)";
    case KindTag::kVelocity:
      return "direction of velocity (0018,9090)";
    case KindTag::kSequenceName:
      return "sequence name (0018,0024)";
    case KindTag::kScanningSequence:
      return "scanning sequence (0018,0020)";
    case KindTag::kContrast:
      return "contrast (0018,0010)";
    case KindTag::kCoil:
      return "receive coil (0018,1250)";
    case KindTag::kLabel:
      return "perfusion label (2005,1429)";
    case KindTag::kVoltage:
      return "tube voltage (0018,0060)";
    case KindTag::kKernel:
      return "convolution kernel (0018,1210)";
    case KindTag::kThickness:
      return "slice thickness (0018,0050)";
    case KindTag::kUnits:
      return "units (0054,1001)";
    case KindTag::kCorrections:
      return "corrections of PET (0028,0051)";
    case KindTag::kSeriesType:
      return "series type (0054,1000)";
    case KindTag::kDataType:
      return "data type (0018,9808)";
    case KindTag::kPatientPosition:
      return "patient position (0018,5100)";
    case KindTag::kCount:
      break;
  }
  return "";
}

std::array<std::string, kKindTags> kind_of(const FrameTags& frame) {
  const DicomElements& file = frame.file();
  std::array<std::string, kKindTags> kind;
  const auto set = [&](KindTag tag, std::string value) { kind[size_t(tag)] = std::move(value); };
  set(KindTag::kImageType, image_type(frame, false));
  set(KindTag::kOriginality, image_type(frame, true));
  set(KindTag::kComplexComponent, complex_component(frame));
  const auto echo = frame.real(tags::kMrEcho, tags::kEffectiveEchoTime);
  set(KindTag::kEchoTime, rounded(echo ? echo : file.number(tags::kEchoTime)));
  set(KindTag::kEchoNumber, file.text(tags::kEchoNumber));
  set(KindTag::kRepetitionTime,
      rounded(frame.with(tags::kMrTiming, tags::kRepetitionTime).number(tags::kRepetitionTime)));
  const auto inversion = frame.real(tags::kMrModifier, tags::kInversionTimes);
  set(KindTag::kInversionTime, rounded(inversion ? inversion : file.number(tags::kInversionTime)));
  set(KindTag::kFlipAngle,
      rounded(frame.with(tags::kMrTiming, tags::kFlipAngle).number(tags::kFlipAngle)));
  set(KindTag::kBValue, b_value(frame));
  set(KindTag::kDiffusion, frame.with(tags::kMrDiffusion, tags::kDiffusionDirectionality)
                               .text(tags::kDiffusionDirectionality));
  std::string velocity;
  for (const double along :
       frame.with(tags::kMrVelocity, tags::kVelocityDirection).reals(tags::kVelocityDirection, 3))
    velocity += (velocity.empty() ? "" : " ") + fmt::format("{:.2g}", along);
  set(KindTag::kVelocity,
      first_of(velocity, private_text(file, tags::kSiemensVelocity, "siemens")));
  set(KindTag::kSequenceName,
      first_of(file.text(tags::kSequenceName), file.text(tags::kPulseSequence)));
  set(KindTag::kScanningSequence, file.text(tags::kScanningSequence));
  set(KindTag::kContrast, first_of(file.text(tags::kContrastAgent),
                                   frame.with(tags::kMrFrameType, tags::kAcquisitionContrast)
                                       .text(tags::kAcquisitionContrast)));
  set(KindTag::kCoil,
      first_of(private_text(file, tags::kSiemensCoil, "siemens"), file.text(tags::kCoil)));
  set(KindTag::kLabel, private_text(file, tags::kPhilipsLabel, "philips"));
  set(KindTag::kVoltage, rounded(file.number(tags::kKilovolts)));
  set(KindTag::kKernel, file.text(tags::kKernel));
  set(KindTag::kThickness,
      rounded(
          frame.with(tags::kPixelMeasures, tags::kSliceThickness).number(tags::kSliceThickness)));
  set(KindTag::kUnits, file.text(tags::kUnits));
  set(KindTag::kCorrections, file.text(tags::kCorrectedImage) + file.text(tags::kAttenuation) +
                                 file.text(tags::kReconstruction));
  set(KindTag::kSeriesType, file.text(tags::kSeriesType));
  set(KindTag::kDataType, frame.with(tags::kUsImage, tags::kUsDataType).text(tags::kUsDataType));
  set(KindTag::kPatientPosition, file.text(tags::kPatientPosition));
  return kind;
}

SignalPart component_of(const DicomSlice& slice) {
  SignalPart found = SignalPart::kUnknown;
  const auto look_at = [&](const std::string& text) {
    for (const std::string_view cell : cells(text, '\\')) {
      const std::string word(cell);
      if (word == "P" || word == "R" || word == "I" || word == "REAL" || word == "IMAGINARY" ||
          word.starts_with("PHASE") || word.starts_with("VELOCITY") || word.starts_with("P_") ||
          word.starts_with("R_") || word.starts_with("I_")) {
        // Philips writes PHASE CONTRAST M: the value after it has the last word.
        found = SignalPart::kOther;
      } else if (word == "M" || word.starts_with("MAG") || word.starts_with("M_")) {
        if (found == SignalPart::kUnknown) found = SignalPart::kMagnitude;
      }
    }
  };
  look_at(slice.kind[size_t(KindTag::kComplexComponent)]);
  if (found == SignalPart::kUnknown) look_at(slice.kind[size_t(KindTag::kImageType)]);
  return found;
}

bool is_mosaic(const DicomElements& file) {
  // XA software leaves the word in the image type of files whose frames are slices.
  if (file.sequences.count(tags::kFrameGroups) != 0 ||
      file.number(tags::kNumberOfFrames).value_or(1.0) > 1.0)
    return false;
  const std::string type = file.text(tags::kImageType);
  const auto words = cells(type, '\\');
  // VFRAME is UIH's word for it.
  return std::any_of(words.begin(), words.end(),
                     [](std::string_view word) { return word == "MOSAIC" || word == "VFRAME"; });
}

Mosaic mosaic_of(const DicomElements& file) {
  Mosaic mosaic;
  const auto element = file.values.find(tags::kSiemensHeader);
  const std::string_view header =
      element == file.values.end() ? std::string_view() : element->second;
  const auto tiles = siemens_values(header, "NumberOfImagesInMosaic");
  const auto from_header = tiles.empty() ? std::nullopt : to_integer(tiles.front());
  if (from_header && *from_header > 0 && *from_header < 10000) mosaic.tiles = int(*from_header);
  // A binary number, or text where a program rewrote the element.
  if (mosaic.tiles == 0) {
    const auto as_text = file.number(tags::kMosaicTiles);
    mosaic.tiles =
        as_text ? int(std::clamp(*as_text, 0.0, 1e4)) : file.whole(tags::kMosaicTiles).value_or(0);
  }
  const auto normal = siemens_values(header, "SliceNormalVector");
  for (int axis = 0; axis < 3 && size_t(axis) < normal.size(); ++axis)
    mosaic.normal[axis] = to_number(normal[size_t(axis)]).value_or(0.0);
  if (std::abs(glm::length(mosaic.normal) - 1.0) > 0.01) mosaic.normal = glm::dvec3(0.0);
  return mosaic;
}

}  // namespace palpate::files
