#include "integration/files/dicom/dicom_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "integration/files/atomic_file.h"

namespace palpate::files {
namespace {

constexpr const char* kMrImage = "1.2.840.10008.5.1.4.1.1.4";
constexpr const char* kExplicitLittleEndian = "1.2.840.10008.1.2.1";

/// The bytes of data elements, which have to be added with rising tags (PS3.5, 7.1.2).
class ElementWriter {
 public:
  /// A text; several values are separated by backslashes.
  void text(uint32_t tag, std::string_view vr, std::string value) {
    if (value.size() % 2 == 1) value += vr == "UI" ? '\0' : ' ';
    begin(tag, vr);
    number(uint16_t(value.size()));
    bytes_ += value;
  }
  void whole(uint32_t tag, uint16_t value) {
    begin(tag, "US");
    number(uint16_t(sizeof value));
    number(value);
  }
  /// Bytes with a length of 32 bits (OB, OW).
  void raw(uint32_t tag, std::string_view vr, std::string_view value) {
    begin(tag, vr);
    number(uint16_t(0));
    number(uint32_t(value.size()));
    bytes_ += value;
  }
  /// The length of what follows in the group of file meta information.
  void group_length(uint32_t tag, size_t bytes) {
    begin(tag, "UL");
    number(uint16_t(4));
    number(uint32_t(bytes));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void begin(uint32_t tag, std::string_view vr) {
    number(uint16_t(tag >> 16));
    number(uint16_t(tag));
    bytes_ += vr;
  }
  template <class T>
  void number(T value) {
    for (size_t b = 0; b < sizeof(T); ++b) bytes_ += char(uint8_t(value >> (8 * b)));
  }

  std::string bytes_;
};

/// A decimal string, 16 characters at most.
std::string decimal(double value) {
  return fmt::format("{:.10g}", value == 0.0 ? 0.0 : value);
}

std::string decimals(glm::dvec3 v) {
  return fmt::format("{}\\{}\\{}", decimal(v.x), decimal(v.y), decimal(v.z));
}

/// value = low + slope * sample, of all frames.
struct Scaling {
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();

  explicit Scaling(const Sequence& sequence) {
    for (const Volume& frame : sequence.frames) {
      const auto [least, most] = std::minmax_element(frame.values.begin(), frame.values.end());
      low = std::min(low, *least);
      high = std::max(high, *most);
    }
  }
  double slope() const { return high > low ? (double(high) - double(low)) / 65535.0 : 1.0; }
};

std::string samples_of(const Volume& frame, int slice, const Scaling& scaling) {
  const size_t count = size_t(frame.grid.size.x) * size_t(frame.grid.size.y);
  const float* const values = frame.values.data() + size_t(slice) * count;
  std::string bytes;
  for (size_t n = 0; n < count; ++n) {
    const auto sample = uint16_t(std::clamp(
        std::lround((double(values[n]) - double(scaling.low)) / scaling.slope()), 0L, 65535L));
    bytes += {char(uint8_t(sample)), char(uint8_t(sample >> 8))};
  }
  return bytes;
}

/// One file: preamble, file meta information (PS3.10, 7.1), and the image.
std::string slice_file(const Sequence& sequence, size_t k, int slice, const Scaling& scaling,
                       const std::string& description, uint64_t id) {
  const Volume& frame = sequence.frames[k];
  const Grid& grid = frame.grid;
  const size_t instance = k * size_t(grid.size.z) + size_t(slice) + 1;
  const std::string root = fmt::format("2.25.{}", id),
                    of_file = fmt::format("{}.4.{}", root, instance);

  ElementWriter image;
  image.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\OTHER");
  image.text(0x00080016, "UI", kMrImage);
  image.text(0x00080018, "UI", of_file);
  image.text(0x00080020, "DA", "");
  image.text(0x00080030, "TM", "");
  image.text(0x00080050, "SH", "");
  image.text(0x00080060, "CS", "MR");
  image.text(0x00080070, "LO", "palpate");
  image.text(0x00080090, "PN", "");
  image.text(0x0008103e, "LO", description);
  image.text(0x00100010, "PN", "Phantom");
  image.text(0x00100020, "LO", "phantom");
  image.text(0x00100030, "DA", "");
  image.text(0x00100040, "CS", "O");
  image.text(0x00180020, "CS", "RM");
  image.text(0x00180021, "CS", "NONE");
  image.text(0x00180022, "CS", "");
  image.text(0x00180023, "CS", "3D");
  image.text(0x00180050, "DS", decimal(grid.spacing_mm.z));
  image.text(0x00180081, "DS", "");
  image.text(0x00180091, "IS", "");
  image.text(0x00181060, "DS", decimal(1e3 * sequence.times_s[k]));
  image.text(0x0020000d, "UI", root + ".1");
  image.text(0x0020000e, "UI", root + ".2");
  image.text(0x00200010, "SH", "1");
  image.text(0x00200011, "IS", "1");
  image.text(0x00200013, "IS", fmt::format("{}", instance));
  image.text(0x00200032, "DS", decimals(grid.lps_from_index({0, 0, slice})));
  image.text(0x00200037, "DS", decimals(grid.direction[0]) + "\\" + decimals(grid.direction[1]));
  image.text(0x00200052, "UI", root + ".3");
  image.text(0x00200100, "IS", fmt::format("{}", k + 1));
  image.text(0x00200105, "IS", fmt::format("{}", sequence.frames.size()));
  image.text(0x00201040, "LO", "");
  image.whole(0x00280002, 1);
  image.text(0x00280004, "CS", "MONOCHROME2");
  image.whole(0x00280010, uint16_t(grid.size.y));
  image.whole(0x00280011, uint16_t(grid.size.x));
  // Between rows first, then between columns.
  image.text(0x00280030, "DS", decimal(grid.spacing_mm.y) + "\\" + decimal(grid.spacing_mm.x));
  image.whole(0x00280100, 16);
  image.whole(0x00280101, 16);
  image.whole(0x00280102, 15);
  image.whole(0x00280103, 0);
  image.text(0x00281052, "DS", decimal(scaling.low));
  image.text(0x00281053, "DS", decimal(scaling.slope()));
  image.raw(0x7fe00010, "OW", samples_of(frame, slice, scaling));

  ElementWriter about;
  about.raw(0x00020001, "OB", std::string_view("\0\1", 2));
  about.text(0x00020002, "UI", kMrImage);
  about.text(0x00020003, "UI", of_file);
  about.text(0x00020010, "UI", kExplicitLittleEndian);
  about.text(0x00020012, "UI", root + ".5");
  ElementWriter length;
  length.group_length(0x00020000, about.bytes().size());
  return std::string(128, '\0') + "DICM" + length.bytes() + about.bytes() + image.bytes();
}

}  // namespace

Status write_dicom(
    const Sequence& sequence, const std::string& description, uint64_t id,
    const std::function<Result<std::filesystem::path>(const std::string&)>& path_of) {
  const Scaling scaling(sequence);
  for (size_t k = 0; k < sequence.frames.size(); ++k)
    for (int slice = 0; slice < sequence.frames[k].grid.size.z; ++slice) {
      const auto path = path_of(fmt::format("frame_{:03}_slice_{:04}.dcm", k, slice));
      if (!path) return path.error();
      const Status written =
          write_text(*path, slice_file(sequence, k, slice, scaling, description, id));
      if (!written) return written;
    }
  return Nothing{};
}

}  // namespace palpate::files
