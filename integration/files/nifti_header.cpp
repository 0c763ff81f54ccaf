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

/// Rows of the sform may differ from perpendicular by rounding to single precision and by hand
/// editing.
constexpr double kShearTolerance = 1e-4;

/// Typed look at the header bytes in the file's byte order; offsets are those of the NIfTI-1
/// standard.
class HeaderBytes {
 public:
  HeaderBytes(std::string_view bytes, bool swap) : bytes_(bytes), swap_(swap) {}

  template <class T>
  T get(size_t offset) const {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + offset, sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }
  int short_at(size_t offset) const { return get<int16_t>(offset); }
  double float_at(size_t offset) const { return double(get<float>(offset)); }
  int dim(size_t n) const { return short_at(40 + 2 * n); }
  double pixdim(size_t n) const { return float_at(76 + 4 * n); }

 private:
  std::string_view bytes_;
  bool swap_;
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
};

RasFrame from_sform(const HeaderBytes& header) {
  RasFrame frame;
  for (int r = 0; r < 3; ++r) {
    const size_t row = 280 + 16 * size_t(r);
    for (int c = 0; c < 3; ++c) frame.axes[c][r] = header.float_at(row + 4 * size_t(c));
    frame.origin[r] = header.float_at(row + 12);
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

/// NIfTI-1, method 2: the quaternion (a, b, c, d) with a >= 0 left out, and qfac for the sign of k.
RasFrame from_qform(const HeaderBytes& header) {
  const double b = header.float_at(256), c = header.float_at(260), d = header.float_at(264);
  const double a = std::sqrt(std::max(0.0, 1.0 - (b * b + c * c + d * d)));
  RasFrame frame;
  frame.axes[0] = {a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)};
  frame.axes[1] = {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)};
  frame.axes[2] = {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - c * c - b * b};
  if (header.pixdim(0) < 0.0) frame.axes[2] = -frame.axes[2];
  frame.spacing = {header.pixdim(1), header.pixdim(2), header.pixdim(3)};
  frame.origin = {header.float_at(268), header.float_at(272), header.float_at(276)};
  return frame;
}

RasFrame choose_frame(const HeaderBytes& header) {
  const int qform_code = header.short_at(252), sform_code = header.short_at(254);
  if (sform_code > 0 && (sform_code == kScannerSpace || qform_code <= 0)) {
    const RasFrame sform = from_sform(header);
    // A sheared sform can not be honoured; the qform next to it can not be sheared.
    if (is_straight(sform) || qform_code <= 0) return sform;
  }
  if (qform_code > 0) return from_qform(header);
  // Method 1: spacing is all that is known. ITK takes the axes as L, P, S then, and fields must fit
  // its reading.
  RasFrame plain;
  plain.axes = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1);
  plain.spacing = {header.pixdim(1), header.pixdim(2), header.pixdim(3)};
  return plain;
}

Result<Grid> grid_of(const std::filesystem::path& file, const HeaderBytes& header) {
  RasFrame ras = choose_frame(header);
  // xyzt_units is one byte; the bits of space are 1 metre, 2 mm, 3 micron.
  const int space_unit = int(header.get<uint8_t>(123)) & 7;
  const double scale_mm = space_unit == 1 ? 1e3 : space_unit == 3 ? 1e-3 : 1.0;
  Placement placement;
  const glm::dvec3 lps_signs(-1.0, -1.0, 1.0);
  for (int c = 0; c < 3; ++c) {
    placement.size[c] = header.dim(size_t(c) + 1);
    placement.axes[c] = lps_signs * ras.axes[c];
  }
  placement.spacing_mm = ras.spacing * scale_mm;
  placement.origin_mm = lps_signs * ras.origin * scale_mm;
  return make_grid(file, placement);
}

Status find_lanes(const HeaderBytes& header, Raster& raster) {
  const int dimensions = header.dim(0);
  const int frames = dimensions >= 4 ? header.dim(4) : 1;
  int components = 1;
  for (int d = 5; d <= dimensions; ++d) {
    const int n = header.dim(size_t(d));
    if (n < 1 || components > 1000)
      return bad_input(raster.file, "has a damaged dim field: save the file again");
    components *= n;
  }
  if (frames < 1)
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
  raster.vectors_are_ras = components == 3 && header.short_at(68) == kIntentDisplacement;
  const double step = header.pixdim(4);
  const int time_unit = int(header.get<uint8_t>(123)) & 0x38;
  // Writers like ITK leave the unit out and mean seconds; a step of 1 is what they put where they
  // know none.
  double seconds = time_unit == 0 && step != 1.0 ? 1.0 : 0.0;
  if (time_unit == 8) seconds = 1.0;
  if (time_unit == 16) seconds = 1e-3;
  if (time_unit == 24) seconds = 1e-6;
  if (frames == 1 || seconds == 0.0 || !(step > 0.0) || !std::isfinite(step)) return Nothing{};
  const double start = std::isfinite(header.float_at(136)) ? header.float_at(136) : 0.0;
  raster.times_s = counted_times(raster.lanes);
  for (double& t : raster.times_s) t = (start + t * step) * seconds;
  raster.times_known = true;
  return check_rising(raster.file, raster.times_s);
}

Status find_samples(const HeaderBytes& header, bool packed, Raster& raster) {
  const int code = header.short_at(70);
  const auto type = sample_type(code);
  if (!type) {
    return bad_input(
        raster.file,
        "has samples of NIfTI type {}, which palpate does not read: save it as short or float",
        code);
  }
  raster.type = *type;
  raster.encoding = packed ? Encoding::kDeflate : Encoding::kRaw;
  const double slope = header.float_at(112), intercept = header.float_at(116);
  // A slope of 0 means by the standard that nothing is to be scaled.
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

}  // namespace

Result<Raster> parse_nifti_header(const std::filesystem::path& file, std::string_view bytes,
                                  bool packed) {
  if (bytes.size() < kNiftiHeaderBytes) {
    return bad_input(file,
                     "is too short for a NIfTI header ({} of {} bytes): copy or export it again",
                     bytes.size(), kNiftiHeaderBytes);
  }
  const bool swap = HeaderBytes(bytes, false).get<int32_t>(0) != int32_t(kNiftiHeaderBytes);
  const HeaderBytes header(bytes, swap);
  const std::string_view magic = bytes.substr(344, 4);
  const bool single = magic == std::string_view("n+1\0", 4);
  if (header.get<int32_t>(0) != int32_t(kNiftiHeaderBytes) ||
      (!single && magic != std::string_view("ni1\0", 4))) {
    return bad_input(
        file, "is not a NIfTI-1 file: check what wrote it, and save NIfTI-2 or Analyze as NIfTI-1");
  }
  if (header.dim(0) < 3 || header.dim(0) > 7) {
    return bad_input(file, "has {} dimensions, but 3 or 4 are needed: save it as a 3D or 4D image",
                     header.dim(0));
  }
  Raster raster;
  raster.file = file;
  raster.big_endian = swap;
  auto grid = grid_of(file, header);
  if (!grid) return grid.error();
  raster.grid = *grid;
  if (const Status done = find_lanes(header, raster); !done) return done.error();
  if (const Status done = find_samples(header, packed, raster); !done) return done.error();
  raster.data = {single ? file : image_beside(file)};
  const double offset = header.float_at(108);
  if (!(offset >= 0.0 && offset < 1e9) || (single && offset < double(kNiftiHeaderBytes))) {
    return bad_input(
        file, "says that its samples start at byte {}: the header is damaged, save the file again",
        offset);
  }
  raster.stream_skip = uint64_t(offset);
  return raster;
}

}  // namespace palpate::files
