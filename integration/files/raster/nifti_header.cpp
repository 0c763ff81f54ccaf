#include "integration/files/raster/nifti_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "integration/files/frame_times.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

constexpr int kIntentDisplacement = 1006, kIntentVector = 1007, kFirstCifti = 3000,
              kLastCifti = 3099;
constexpr int kScannerSpace = 1;
constexpr int64_t kMaxComponents = 1000;

/// Rows of the sform may differ from perpendicular by rounding to single precision and by hand
/// editing.
constexpr double kShearTolerance = 1e-4;

/// Forms that differ by less do not move any structure of the image to another voxel.
constexpr double kTwoPlacesVoxels = 0.5;

/// Where a value stands in each of the two headers.
struct HeaderOffsets {
  size_t nifti1;
  size_t nifti2;
};

constexpr HeaderOffsets kDim{40, 16}, kIntentP1{56, 80}, kIntent{68, 504}, kType{70, 12},
    kPixdim{76, 104}, kSamplesAt{108, 168}, kSlope{112, 176}, kIntercept{116, 184},
    kUnits{123, 500}, kTimeStart{136, 216}, kDescription{148, 240}, kQformCode{252, 344},
    kSformCode{254, 348}, kQuaternion{256, 352}, kQoffset{268, 376}, kSform{280, 400},
    kIntentName{328, 508}, kMagic{344, 4};
constexpr size_t kIntentNameBytes = 16, kDescriptionBytes = 80;

/// Typed look at the header bytes in the file's byte order. NIfTI-2 holds the same values as
/// NIfTI-1 in wider types.
class HeaderBytes {
 public:
  HeaderBytes(std::string_view bytes, bool swap, bool nifti2)
      : bytes_(bytes), swap_(swap), nifti2_(nifti2) {}

  int64_t dimensions() const { return dim_field(0); }
  /// Samples along dimension n, from 1; what lies beyond the last dimension says nothing.
  int64_t dim(size_t n) const { return int64_t(n) > dimensions() ? 1 : dim_field(n); }
  int type() const { return get<int16_t>(at(kType)); }
  /// Intent and form codes.
  int code(HeaderOffsets place) const {
    return nifti2_ ? get<int32_t>(place.nifti2) : get<int16_t>(place.nifti1);
  }
  int units() const { return nifti2_ ? get<int32_t>(kUnits.nifti2) : get<uint8_t>(kUnits.nifti1); }
  double real(HeaderOffsets place, size_t n = 0) const {
    return nifti2_ ? get<double>(place.nifti2 + 8 * n) : double(get<float>(place.nifti1 + 4 * n));
  }
  double pixdim(size_t n) const { return real(kPixdim, n); }
  double samples_at() const {
    return nifti2_ ? double(get<int64_t>(kSamplesAt.nifti2)) : real(kSamplesAt);
  }
  std::string_view magic() const { return bytes_.substr(at(kMagic), nifti2_ ? 8 : 4); }
  /// A text, up to its first zero.
  std::string_view text(HeaderOffsets place, size_t bytes) const {
    const std::string_view all = bytes_.substr(at(place), bytes);
    return trimmed(all.substr(0, all.find('\0')));
  }

 private:
  size_t at(HeaderOffsets place) const { return nifti2_ ? place.nifti2 : place.nifti1; }
  int64_t dim_field(size_t n) const {
    return nifti2_ ? get<int64_t>(kDim.nifti2 + 8 * n) : get<int16_t>(kDim.nifti1 + 2 * n);
  }

  template <class T>
  T get(size_t offset) const {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + offset, sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }

  std::string_view bytes_;
  bool swap_;
  bool nifti2_;
};

std::optional<SampleType> sample_type(int code) {
  switch (code) {
    case 2:
      return SampleType::kUint8;
    case 4:
      return SampleType::kInt16;
    case 8:
      return SampleType::kInt32;
    case 16:
      return SampleType::kFloat;
    case 64:
      return SampleType::kDouble;
    case 256:
      return SampleType::kInt8;
    case 512:
      return SampleType::kUint16;
    case 768:
      return SampleType::kUint32;
    case 1024:
      return SampleType::kInt64;
    case 1280:
      return SampleType::kUint64;
    default:
      return std::nullopt;
  }
}

/// Index to RAS as the header states it: columns of unit length, spacing apart.
struct RasFrame {
  glm::dmat3 axes{1.0};
  glm::dvec3 spacing{1.0};
  glm::dvec3 origin{0.0};

  glm::dvec3 ras_from_index(glm::dvec3 index) const { return origin + axes * (spacing * index); }
};

/// One slice may come without a third axis or spacing, see complete_slice().
void complete_ras_slice(const HeaderBytes& header, RasFrame& frame) {
  Placement slice{
      .size = {1.0, 1.0, double(header.dim(3))}, .spacing_mm = frame.spacing, .axes = frame.axes};
  complete_slice(slice);
  frame.axes = slice.axes;
  frame.spacing = slice.spacing_mm;
}

RasFrame from_sform(const HeaderBytes& header) {
  RasFrame frame;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) frame.axes[c][r] = header.real(kSform, size_t(4 * r + c));
    frame.origin[r] = header.real(kSform, size_t(4 * r + 3));
  }
  for (int c = 0; c < 3; ++c) {
    frame.spacing[c] = glm::length(frame.axes[c]);
    if (frame.spacing[c] > 0.0) frame.axes[c] /= frame.spacing[c];
  }
  complete_ras_slice(header, frame);
  return frame;
}

bool is_straight(const RasFrame& frame) {
  for (int c = 0; c < 3; ++c) {
    if (!(std::abs(glm::dot(frame.axes[c], frame.axes[(c + 1) % 3])) < kShearTolerance))
      return false;
    if (!(frame.spacing[c] > 0.0)) return false;
  }
  return true;
}

/// Method 2 of the standard: the quaternion (a, b, c, d) with a >= 0 left out, and qfac for the
/// sign of k.
RasFrame from_qform(const HeaderBytes& header) {
  const double b = header.real(kQuaternion), c = header.real(kQuaternion, 1),
               d = header.real(kQuaternion, 2);
  const double a = std::sqrt(std::max(0.0, 1.0 - (b * b + c * c + d * d)));
  RasFrame frame;
  frame.axes[0] = {a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)};
  frame.axes[1] = {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)};
  frame.axes[2] = {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - c * c - b * b};
  if (header.pixdim(0) < 0.0) frame.axes[2] = -frame.axes[2];
  frame.spacing = {header.pixdim(1), header.pixdim(2), header.pixdim(3)};
  frame.origin = {header.real(kQoffset), header.real(kQoffset, 1), header.real(kQoffset, 2)};
  complete_ras_slice(header, frame);
  return frame;
}

/// The frame that is used, and its name in the standard.
struct ChosenFrame {
  RasFrame frame;
  const char* name = "pixdim";
};

/// sform_first: the sform is used wherever there is one.
ChosenFrame choose_frame(const HeaderBytes& header, bool sform_first) {
  const int qform_code = header.code(kQformCode), sform_code = header.code(kSformCode);
  if (sform_code > 0 && (sform_first || sform_code == kScannerSpace || qform_code <= 0)) {
    const RasFrame sform = from_sform(header);
    // A sheared sform can not be honoured; the qform next to it can not be sheared.
    if (is_straight(sform) || qform_code <= 0) return {sform, "sform"};
  }
  if (qform_code > 0) return {from_qform(header), "qform"};
  // Method 1: spacing is all that is known. ITK takes the axes as L, P, S then, and fields must fit
  // its reading.
  RasFrame plain;
  plain.axes = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1);
  plain.spacing = {header.pixdim(1), header.pixdim(2), header.pixdim(3)};
  complete_ras_slice(header, plain);
  return {plain, "pixdim"};
}

double mm_per_unit(const HeaderBytes& header) {
  // xyzt_units keeps space in its lowest bits: 1 metre, 2 mm, 3 micron.
  const int space_unit = header.units() & 7;
  return space_unit == 1 ? 1e3 : space_unit == 3 ? 1e-3 : 1.0;
}

/// A sentence about forms that put the image at two different places, if they do.
void note_two_places(const HeaderBytes& header, const char* used, Raster& raster) {
  if (header.code(kQformCode) <= 0 || header.code(kSformCode) <= 0) return;
  const RasFrame sform = from_sform(header), qform = from_qform(header);
  double apart = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index =
        glm::dvec3(raster.grid.size - 1) * glm::dvec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    // Positions are linear in the index: nowhere is the distance larger than at a corner.
    apart = std::max(apart, glm::length(sform.ras_from_index(index) - qform.ras_from_index(index)));
  }
  apart *= mm_per_unit(header);
  if (apart <= kTwoPlacesVoxels * raster.grid.finest_mm()) return;
  raster.notes.push_back(fmt::format(
      "'{}' states its place in space twice, as sform and as qform, and these differ by up to "
      "{:.4g} mm: the {} is used; if the image lies at the wrong place, correct its header.",
      raster.file.string(), apart, used));
}

Status place(const HeaderBytes& header, Raster& raster) {
  // The tools that write places, SPM and NiftyReg, take the sform; a place and its voxel must be in
  // one space.
  const auto [ras, name] = choose_frame(header, raster.vectors_are_places);
  const double scale_mm = mm_per_unit(header);
  Placement placement;
  const glm::dvec3 lps_signs(-1.0, -1.0, 1.0);
  for (int c = 0; c < 3; ++c) {
    placement.size[c] = double(header.dim(size_t(c) + 1));
    placement.axes[c] = lps_signs * ras.axes[c];
  }
  placement.spacing_mm = ras.spacing * scale_mm;
  placement.origin_mm = lps_signs * ras.origin * scale_mm;
  auto grid = make_grid(raster.file, placement);
  if (!grid) return grid.error();
  raster.grid = *grid;
  note_two_places(header, name, raster);
  return Nothing{};
}

/// What FSL writes with intents of its own; nothing for all other intents.
const char* fsl_name(int intent) {
  switch (intent) {
    case 2006:
      return "a displacement field of FSL's FNIRT";
    case 2007:
      return "cubic spline coefficients of FSL's FNIRT";
    case 2008:
      return "DCT coefficients of FSL's FNIRT";
    case 2009:
      return "quadratic spline coefficients of FSL's FNIRT";
    case 2016:
      return "cubic spline coefficients of FSL's topup";
    case 2017:
      return "quadratic spline coefficients of FSL's topup";
    default:
      return nullptr;
  }
}

/// What NiftyReg says with intent_p1.
constexpr double kDeformation = 0.0, kDisplacement = 1.0;
const char* niftyreg_name(double kind) {
  constexpr std::array kNames = {"deformation field",           "displacement field",
                                 "cubic spline grid",           "deformation velocity field",
                                 "displacement velocity field", "spline velocity grid",
                                 "linear spline grid"};
  return kind >= 0.0 && kind < double(kNames.size()) ? kNames[size_t(kind)]
                                                     : "transformation of an unknown kind";
}

/// SPM's segmentation writes "Deformation" or "Inverse Deformation", its deformation utility the
/// intent name "Mapping".
bool is_spm_deformation(const HeaderBytes& header) {
  const std::string description = lowered(header.text(kDescription, kDescriptionBytes));
  return header.text(kIntentName, kIntentNameBytes) == "Mapping" || description == "deformation" ||
         description == "inverse deformation" || description == "deformation field";
}

/// What the three components of a voxel mean to the tool that wrote them. Called before the image
/// is placed.
Status find_vectors(const HeaderBytes& header, Raster& raster) {
  const glm::dmat3 lps_from_ras(-1, 0, 0, 0, -1, 0, 0, 0, 1);
  const int intent = header.code(kIntent);
  if (const char* name = fsl_name(intent)) {
    return bad_input(
        raster.file,
        "holds {}, whose convention needs the moving image's header: convert it to an ITK field, "
        "for example with wb_command -convert-warpfield of Connectome Workbench",
        name);
  }
  if (header.text(kIntentName, kIntentNameBytes) == "NREG_TRANS") {
    const double kind = header.real(kIntentP1);
    if (kind != kDeformation && kind != kDisplacement) {
      return bad_input(
          raster.file,
          "holds a {} of NiftyReg, of which palpate reads deformation and displacement "
          "fields only: convert it with reg_transform -def",
          niftyreg_name(kind));
    }
    raster.lps_from_vector = lps_from_ras;
    raster.vectors_are_places = kind == kDeformation;
    return Nothing{};
  }
  if (intent == kIntentDisplacement) {
    raster.lps_from_vector = lps_from_ras;
    return Nothing{};
  }
  const std::string description = lowered(header.text(kDescription, kDescriptionBytes));
  if (description == "flow field" || description.starts_with("velocity (")) {
    return bad_input(raster.file,
                     "holds a flow field of SPM, which is a velocity in voxels: write it as a "
                     "deformation (y_) with SPM's deformation utility");
  }
  if (is_spm_deformation(header)) {
    raster.lps_from_vector = lps_from_ras;
    raster.vectors_are_places = true;
    raster.notes.push_back(fmt::format(
        "'{}' is a deformation of SPM: its vectors are places in mm, and become displacements.",
        raster.file.string()));
  } else if (intent == kIntentVector && header.dim(4) == 3) {
    raster.notes.push_back(fmt::format(
        "'{}' keeps vectors in the dimension of time: they are taken for mm along L, P, S, as ITK "
        "writes them.",
        raster.file.string()));
  } else if (intent != kIntentVector) {
    raster.notes.push_back(fmt::format(
        "'{}' does not say what its three values per voxel are: they are taken for vectors in mm "
        "along L, P, S.",
        raster.file.string()));
  }
  return Nothing{};
}

/// Frames of the file and values per voxel, before they are checked.
struct Lanes {
  int64_t frames = 1;
  int64_t components = 1;
};

Result<Lanes> lanes_of(const HeaderBytes& header, const Raster& raster) {
  const auto dimensions = size_t(header.dimensions());
  Lanes lanes{header.dim(4), 1};
  auto& [frames, components] = lanes;
  for (size_t d = 5; d <= dimensions; ++d) {
    const int64_t n = header.dim(d);
    if (n < 1 || n > kMaxComponents || components > kMaxComponents)
      return bad_input(raster.file, "has a damaged dim field: save the file again");
    components *= n;
  }
  // Some tools put the components where the standard has time.
  const int intent = header.code(kIntent);
  if (frames == 3 && components == 1 && (intent == kIntentVector || intent == kIntentDisplacement))
    std::swap(frames, components);
  if (frames < 1 || double(frames) > kMaxLanes)
    return bad_input(raster.file, "claims {} frames: the header is damaged, save the file again",
                     frames);
  if (frames > 1 && components > 1) {
    return bad_input(raster.file,
                     "has both frames and {} values per voxel, but palpate reads one of them: "
                     "export one component",
                     components);
  }
  return lanes;
}

Status find_lanes(const HeaderBytes& header, Lanes found, Raster& raster) {
  const auto [frames, components] = found;
  raster.inner = raster.grid.count();
  raster.lanes = size_t(std::max(frames, components));
  raster.lane_kind = components > 1 ? LaneKind::kComponents : LaneKind::kFrames;
  const double step = header.pixdim(4);
  const int time_unit = header.units() & 0x38;
  // Writers like ITK leave the unit out and mean seconds; they write a step of 1 where they do not
  // know it.
  double seconds = time_unit == 0 && step != 1.0 ? 1.0 : 0.0;
  if (time_unit == 8) seconds = 1.0;
  if (time_unit == 16) seconds = 1e-3;
  if (time_unit == 24) seconds = 1e-6;
  if (frames == 1 || seconds == 0.0 || !(step > 0.0) || !std::isfinite(step)) return Nothing{};
  const double first = header.real(kTimeStart), start = std::isfinite(first) ? first : 0.0;
  raster.times_s = counted_times(raster.lanes);
  for (double& t : raster.times_s) t = (start + t * step) * seconds;
  raster.times_known = true;
  return check_rising(raster.file, raster.times_s);
}

Status find_samples(const HeaderBytes& header, bool packed, Raster& raster) {
  const int code = header.type();
  const auto type = sample_type(code);
  if (!type) {
    return bad_input(
        raster.file,
        "has samples of NIfTI type {}, which palpate does not read: save it as short or float",
        code);
  }
  raster.type = *type;
  raster.encoding = packed ? Encoding::kDeflate : Encoding::kRaw;
  const double slope = header.real(kSlope), intercept = header.real(kIntercept);
  // By the standard a slope of 0 means that values are not scaled.
  if (slope != 0.0 && std::isfinite(slope) && std::isfinite(intercept)) {
    raster.slope = slope;
    raster.intercept = intercept;
  }
  return Nothing{};
}

/// "scan.hdr" -> "scan.img", "scan.hdr.gz" -> "scan.img.gz".
std::filesystem::path image_beside(const std::filesystem::path& header) {
  const std::string name = header.string();
  const size_t at = name.rfind(".hdr");
  if (at == std::string::npos) return header;
  return name.substr(0, at) + ".img" + name.substr(at + 4);
}

bool is_nifti_size(int32_t header_bytes) {
  return header_bytes == int32_t(kNiftiHeaderBytes) || header_bytes == int32_t(kNifti2HeaderBytes);
}

/// The first number of the file in its own byte order; `swap` says that this is not ours.
int32_t header_size(std::string_view bytes, bool& swap) {
  uint32_t size = 0;
  if (bytes.size() >= sizeof(size)) std::memcpy(&size, bytes.data(), sizeof(size));
  swap = !is_nifti_size(int32_t(size));
  return int32_t(swap ? __builtin_bswap32(size) : size);
}

}  // namespace

bool starts_like_nifti(std::string_view bytes) {
  bool swap = false;
  return is_nifti_size(header_size(bytes, swap));
}

Result<Raster> parse_nifti_header(const std::filesystem::path& file, std::string_view bytes,
                                  bool packed) {
  bool swap = false;
  const int32_t size = header_size(bytes, swap);
  const bool nifti2 = size == int32_t(kNifti2HeaderBytes);
  const size_t header_bytes = nifti2 ? kNifti2HeaderBytes : kNiftiHeaderBytes;
  if (bytes.size() < header_bytes) {
    return bad_input(file,
                     "is too short for a NIfTI header ({} of {} bytes): copy or export it again",
                     bytes.size(), header_bytes);
  }
  const HeaderBytes header(bytes, swap, nifti2);
  const std::string_view magic = header.magic();
  const bool single =
      magic == (nifti2 ? std::string_view("n+2\0\r\n\032\n", 8) : std::string_view("n+1\0", 4));
  const bool pair =
      magic == (nifti2 ? std::string_view("ni2\0\r\n\032\n", 8) : std::string_view("ni1\0", 4));
  if (!is_nifti_size(size) || (!single && !pair)) {
    return bad_input(file, "is not a NIfTI file: check what wrote it, and save Analyze as NIfTI");
  }
  if (const int intent = header.code(kIntent); intent >= kFirstCifti && intent <= kLastCifti) {
    return bad_input(file,
                     "is a CIFTI file, which holds values of surfaces and regions rather than an "
                     "image: export a volume of it");
  }
  if (header.dimensions() < 2 || header.dimensions() > 7) {
    return bad_input(file, "has {} dimensions, but 2 to 4 are needed: save it as a 3D or 4D image",
                     header.dimensions());
  }
  Raster raster;
  raster.file = file;
  raster.big_endian = swap;
  const auto lanes = lanes_of(header, raster);
  if (!lanes) return lanes.error();
  if (lanes->components == 3 || fsl_name(header.code(kIntent)) != nullptr)
    if (const Status done = find_vectors(header, raster); !done) return done.error();
  if (const Status done = place(header, raster); !done) return done.error();
  if (const Status done = find_lanes(header, *lanes, raster); !done) return done.error();
  if (const Status done = find_samples(header, packed, raster); !done) return done.error();
  raster.data = {single ? file : image_beside(file)};
  double offset = header.samples_at();
  // Some writers leave the field empty; the samples follow the header and its four bytes for
  // extensions then.
  if (single && offset == 0.0) offset = double(header_bytes) + 4.0;
  if (!(offset >= 0.0 && offset < 1e9) || (single && offset < double(header_bytes))) {
    return bad_input(
        file, "says that its samples start at byte {}: the header is damaged, save the file again",
        offset);
  }
  raster.stream_skip = uint64_t(offset);
  return raster;
}

}  // namespace palpate::files
