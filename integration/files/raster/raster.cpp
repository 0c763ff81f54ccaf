#include "integration/files/raster/raster.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "compute/volume/memory.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

/// Axes of single-precision headers are perpendicular to 1e-6; text with four digits to 1e-4; a
/// sheared image is far beyond: 0.1 degrees is 1.7e-3.
constexpr double kPerpendicularTolerance = 1e-3;

/// Below this the axes are kept bit by bit as the file gives them.
constexpr double kExactTolerance = 1e-9;

/// 2^40 samples: no scanner or simulation writes one volume of 4 TB.
constexpr double kAbsurdSampleCount = 1099511627776.0;

/// Deflate packs at most 1032 bytes into one.
constexpr double kDeflateLimit = 1032.0;

Status check_size(const std::filesystem::path& file, glm::dvec3 n) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(n[axis] >= 1.0)) {
      return bad_input(
          file, "claims {} samples along axis {}: the header is damaged, save the file again",
          n[axis], axis);
    }
  }
  if (n.x > 2147483647.0 || n.y > 2147483647.0 || n.z > 2147483647.0 ||
      n.x * n.y * n.z > kAbsurdSampleCount) {
    return bad_input(file,
                     "claims an absurd size of {:.0f} x {:.0f} x {:.0f} samples: the header is "
                     "damaged, save the file "
                     "again",
                     n.x, n.y, n.z);
  }
  return Nothing{};
}

bool all_finite(const Placement& p) {
  for (int c = 0; c < 3; ++c) {
    if (!std::isfinite(p.spacing_mm[c]) || !std::isfinite(p.origin_mm[c])) return false;
    for (int r = 0; r < 3; ++r) {
      if (!std::isfinite(p.axes[c][r])) return false;
    }
  }
  return true;
}

/// The same samples at the same places, j counted from the other end.
void count_j_from_other_end(Grid& grid) {
  grid.origin_mm = grid.lps_from_index({0, grid.size.y - 1, 0});
  grid.direction[1] = -grid.direction[1];
}

/// Largest deviation of the axes from a rotation or mirrored rotation.
double departure_from_orthonormal(const glm::dmat3& axes) {
  const glm::dmat3 product = glm::transpose(axes) * axes;
  double worst = 0.0;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) worst = std::max(worst, std::abs(product[c][r] - (c == r ? 1 : 0)));
  }
  return worst;
}

glm::dmat3 orthonormalised(const glm::dmat3& axes) {
  glm::dmat3 straight;
  straight[0] = glm::normalize(axes[0]);
  straight[1] = glm::normalize(axes[1] - straight[0] * glm::dot(straight[0], axes[1]));
  straight[2] = glm::cross(straight[0], straight[1]);
  return straight;
}

}  // namespace

size_t bytes_of(SampleType type) {
  switch (type) {
    case SampleType::kInt8:
    case SampleType::kUint8:
      return 1;
    case SampleType::kInt16:
    case SampleType::kUint16:
      return 2;
    case SampleType::kInt32:
    case SampleType::kUint32:
    case SampleType::kFloat:
      return 4;
    case SampleType::kInt64:
    case SampleType::kUint64:
    case SampleType::kDouble:
      return 8;
  }
  return 1;
}

void complete_slice(Placement& placement) {
  if (placement.size.z != 1.0) return;
  if (!(glm::length(placement.axes[2]) > 0.0))
    placement.axes[2] =
        glm::cross(glm::normalize(placement.axes[0]), glm::normalize(placement.axes[1]));
  if (!(placement.spacing_mm.z > 0.0))
    placement.spacing_mm.z = std::max(placement.spacing_mm.x, placement.spacing_mm.y);
}

Result<Grid> make_grid(const std::filesystem::path& file, const Placement& placement) {
  if (const Status good = check_size(file, placement.size); !good) return good.error();
  if (!all_finite(placement)) {
    return bad_input(file,
                     "has a spacing, origin or direction that is not finite: correct its header");
  }
  Grid grid;
  grid.size = glm::ivec3(placement.size);
  grid.spacing_mm = placement.spacing_mm;
  grid.origin_mm = placement.origin_mm;
  grid.direction = placement.axes;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = glm::length(grid.direction[axis]);
    if (!(grid.spacing_mm[axis] > 0.0) || !(length > 0.0)) {
      return bad_input(
          file,
          "has a spacing of {} mm along axis {}, but spacings must be positive: correct its header",
          grid.spacing_mm[axis] * length, axis);
    }
    // A unit axis stays bit by bit what the file says.
    if (std::abs(length - 1.0) > kExactTolerance) grid.direction[axis] /= length;
  }
  const double departure = departure_from_orthonormal(grid.direction);
  if (departure > kPerpendicularTolerance) {
    return bad_input(file,
                     "has axes that are not perpendicular (a tilted gantry, or a sheared header): "
                     "resample it to a "
                     "straight grid first");
  }
  // DICOM is never left-handed, and converters to NIfTI (dcm2niix) reverse the rows of a picture:
  // to reverse j gives the grid that the scanner wrote.
  grid.j_reversed_in_file = glm::determinant(grid.direction) < 0.0;
  if (grid.j_reversed_in_file) count_j_from_other_end(grid);
  if (departure > kExactTolerance) grid.direction = orthonormalised(grid.direction);
  return grid;
}

bool is_colour_picture(const Raster& raster) {
  return raster.type == SampleType::kUint8 &&
         (raster.component_count() == 3 || raster.component_count() == 4);
}

Error refuse_colours(const Raster& raster) {
  return bad_input(raster.file,
                   "is a colour picture ({} values of 8 bits per voxel): convert it to one gray "
                   "value per voxel",
                   raster.component_count());
}

Grid as_in_file(const Grid& grid) {
  Grid stored = grid;
  if (grid.j_reversed_in_file) count_j_from_other_end(stored);
  return stored;
}

void reverse_j(const Grid& grid, float* values, size_t components) {
  if (!grid.j_reversed_in_file) return;
  const size_t row = size_t(grid.size.x) * components, ny = size_t(grid.size.y);
  for (size_t k = 0; k < size_t(grid.size.z); ++k) {
    float* const slice = values + k * ny * row;
    for (size_t low = 0, high = ny - 1; low < high; ++low, --high)
      std::swap_ranges(slice + low * row, slice + (low + 1) * row, slice + high * row);
  }
}

Status check_claims(const Raster& raster) {
  const double claimed =
      double(raster.grid.count()) * double(raster.lanes) * double(bytes_of(raster.type));
  if (raster.lanes == 0) return bad_input(raster.file, "holds no frames: save the file again");
  double available = 0.0;
  for (const auto& path : raster.data) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    if (error) {
      return bad_input(raster.file,
                       "keeps its samples in '{}', which can not be read: put that file beside it",
                       path.string());
    }
    available += std::max(0.0, double(bytes) - double(raster.file_skip));
  }
  if (raster.encoding == Encoding::kRaw)
    available = std::max(0.0, available - double(raster.stream_skip));
  double least = claimed;
  if (raster.encoding == Encoding::kDeflate) least = claimed / kDeflateLimit;
  if (raster.encoding == Encoding::kText)
    least = 2.0 * claimed / double(bytes_of(raster.type)) - 1.0;
  if (raster.encoding == Encoding::kHex) least = 2.0 * claimed;
  if (available < least) {
    const auto [promised, there] = bytes_to_compare(claimed, available);
    return bad_input(raster.file,
                     "is too short: its header promises {} of samples ({} x {} x {} x {}) but the "
                     "file holds {}: copy "
                     "or export it again",
                     promised, raster.grid.size.x, raster.grid.size.y, raster.grid.size.z,
                     raster.lanes, there);
  }
  // One frame as float is the least that any use of the file needs.
  return check_fits_memory(
      fmt::format("one frame of '{}'", raster.file.string()),
      double(raster.grid.count()) * double(raster.component_count()) * sizeof(float));
}

}  // namespace palpate::files
