#include "integration/files/nifti_header.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "integration/files/frame_times.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

constexpr int kIntentDisplacement = 1006;
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

constexpr HeaderOffsets kDim{40, 16}, kIntent{68, 504}, kType{70, 12}, kPixdim{76, 104},
    kSamplesAt{108, 168}, kSlope{112, 176}, kIntercept{116, 184}, kUnits{123, 500},
    kTimeStart{136, 216}, kQformCode{252, 344}, kSformCode{254, 348}, kQuaternion{256, 352},
    kQoffset{268, 376}, kSform{280, 400}, kMagic{344, 4};

/// Typed look at the header bytes in the file's byte order. NIfTI-2 holds the same values as
/// NIfTI-1 in wider types.
class HeaderBytes {
 public:
  HeaderBytes(std::string_view bytes, bool swap, bool nifti2)
      : bytes_(bytes), swap_(swap), nifti2_(nifti2) {}

  int64_t dim(size_t n) const {
    return nifti2_ ? get<int64_t>(kDim.nifti2 + 8 * n) : get<int16_t>(kDim.nifti1 + 2 * n);
  }
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

 private:
  size_t at(HeaderOffsets place) const { return nifti2_ ? place.nifti2 : place.nifti1; }

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
  return frame;
}

/// The frame that is used, and its name in the standard.
struct ChosenFrame {
  RasFrame frame;
  const char* name = "pixdim";
};

ChosenFrame choose_frame(const HeaderBytes& header) {
  const int qform_code = header.code(kQformCode), sform_code = header.code(kSformCode);
  if (sform_code > 0 && (sform_code == kScannerSpace || qform_code <= 0)) {
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
  const auto [ras, name] = choose_frame(header);
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

Status find_lanes(const HeaderBytes& header, Raster& raster) {
  const auto dimensions = size_t(header.dim(0));
  const int64_t frames = dimensions >= 4 ? header.dim(4) : 1;
  int64_t components = 1;
  for (size_t d = 5; d <= dimensions; ++d) {
    const int64_t n = header.dim(d);
    if (n < 1 || n > kMaxComponents || components > kMaxComponents)
      return bad_input(raster.file, "has a damaged dim field: save the file again");
    components *= n;
  }
  if (frames < 1 || double(frames) > kMaxLanes)
    return bad_input(raster.file, "claims {} frames: the header is damaged, save the file again",
                     frames);
  if (frames > 1 && components > 1) {
    return bad_input(raster.file,
                     "has both frames and {} values per voxel, but palpate reads one of them: "
                     "export one component",
                     components);
  }
  raster.inner = raster.grid.count();
  raster.lanes = size_t(std::max(frames, components));
  raster.lane_kind = components > 1 ? LaneKind::kComponents : LaneKind::kFrames;
  raster.vectors_are_ras = components == 3 && header.code(kIntent) == kIntentDisplacement;
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
  if (header.dim(0) < 3 || header.dim(0) > 7) {
    return bad_input(file, "has {} dimensions, but 3 or 4 are needed: save it as a 3D or 4D image",
                     header.dim(0));
  }
  Raster raster;
  raster.file = file;
  raster.big_endian = swap;
  if (const Status done = place(header, raster); !done) return done.error();
  if (const Status done = find_lanes(header, raster); !done) return done.error();
  if (const Status done = find_samples(header, packed, raster); !done) return done.error();
  raster.data = {single ? file : image_beside(file)};
  const double offset = header.samples_at();
  if (!(offset >= 0.0 && offset < 1e9) || (single && offset < double(header_bytes))) {
    return bad_input(
        file, "says that its samples start at byte {}: the header is damaged, save the file again",
        offset);
  }
  raster.stream_skip = uint64_t(offset);
  return raster;
}

}  // namespace palpate::files
