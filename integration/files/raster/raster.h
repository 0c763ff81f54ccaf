#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "compute/volume/grid.h"
#include "compute/volume/result.h"
#include "compute/volume/sample_type.h"

namespace palpate::files {

size_t bytes_of(SampleType type);

enum class Encoding {
  kRaw,
  kDeflate,  ///< zlib or gzip stream
  kHex,      ///< two hexadecimal digits per byte, white space between
  kText      ///< numbers in ASCII
};

/// What one value of the axis beside i, j, k is.
enum class LaneKind { kFrames, kComponents };

/// More frames or components than this are a damaged header: a minute at 1 kHz has 60,000 frames.
inline constexpr double kMaxLanes = 1e6;

/// What a header says: where the samples of one file are, in memory and in space. All header
/// parsers give one, and one decoder reads it, so that each rule (sizes, units, scaling, byte
/// order) is written once.
///
/// Beside i, j, k there is at most one more axis, the lanes: frames of a sequence or components of
/// a vector. It may stand anywhere among the axes of the file: sample (voxel v, lane l) is sample
/// number (v / inner * lanes + l) * inner + v % inner of the stream, so inner = 1 means lanes
/// fastest and inner = grid.count() lanes slowest. Voxel v counts as the file does: where
/// grid.j_reversed_in_file, reverse_j() puts what was read in the grid's order.
struct Raster {
  std::filesystem::path file;               ///< the header, for messages
  std::vector<std::filesystem::path> data;  ///< files that hold the samples, one after the other
  uint64_t file_skip = 0;                   ///< bytes of each data file before its samples
  uint64_t line_skip = 0;                   ///< lines of each data file to leave out after that
  uint64_t stream_skip = 0;     ///< bytes to leave out after that and after decompression
  bool samples_at_end = false;  ///< the samples are the last bytes of the data file
  Encoding encoding = Encoding::kRaw;
  SampleType type = SampleType::kInt16;
  bool big_endian = false;
  double slope = 1.0;  ///< value = slope * sample + intercept
  double intercept = 0.0;
  Grid grid;
  LaneKind lane_kind = LaneKind::kFrames;
  size_t lanes = 1;
  size_t inner = 1;
  glm::dmat3 lps_from_vector{1.0};  ///< turns the components of a vector to L, P, S
  /// Vectors are the places (mm) to which their voxels move, not the displacements.
  bool vectors_are_places = false;
  std::vector<double> times_s;  ///< one per frame if times_known, else empty
  bool times_known = false;
  std::vector<std::string> notes;  ///< what a person should know of the file, a sentence each
  std::map<std::string, std::string> keys;  ///< "name:=value" lines of a NRRD header

  size_t frame_count() const { return lane_kind == LaneKind::kFrames ? lanes : 1; }
  size_t component_count() const { return lane_kind == LaneKind::kComponents ? lanes : 1; }
  uint64_t sample_count() const { return uint64_t(grid.count()) * lanes; }
  uint64_t byte_count() const { return sample_count() * bytes_of(type); }
};

/// Space as a file states it, before it is checked. The axes need not be of unit length.
struct Placement {
  /// samples along i, j, k; double, so that absurd claims survive until they are refused
  glm::dvec3 size{0.0};
  glm::dvec3 spacing_mm{1.0};
  glm::dvec3 origin_mm{0.0};  ///< LPS
  glm::dmat3 axes{1.0};       ///< columns: directions of i, j, k in LPS
};

/// Makes a slice of a picture of two dimensions. Where it has one sample along k and the file gives
/// no third axis, k is perpendicular to i and j, and where it gives no third spacing, the slice is
/// as thick as its larger pixel edge.
void complete_slice(Placement& placement);

/// The grid, or a sentence why it is not possible: empty or absurd size, spacing that is not
/// positive, axes that are not perpendicular. Left-handed axes become right-handed by counting j
/// from the other end: the same samples at the same places, and j_reversed_in_file is set.
Result<Grid> make_grid(const std::filesystem::path& file, const Placement& placement);

/// The samples in the order of the file that j_reversed_in_file remembers: its direction has a
/// negative determinant then. Any other grid as it is.
Grid as_in_file(const Grid& grid);

/// Values of one frame from the order of the file into that of the grid, or back; does nothing
/// unless j_reversed_in_file. Shape (nz, ny, nx, components).
void reverse_j(const Grid& grid, float* values, size_t components);

/// Compares what the header claims with the bytes that are there, before anything of that size is
/// allocated.
Status check_claims(const Raster& raster);

/// True for colours: three or four values of 8 bits without a sign, which no field and no flow has.
bool is_colour_picture(const Raster& raster);

/// The sentence that refuses one.
Error refuse_colours(const Raster& raster);

}  // namespace palpate::files
