#pragma once

#include "integration/files/raster/byte_source.h"
#include "integration/files/raster/raster.h"

namespace palpate::files {

/// Reads the samples of a Raster in file order and gives them as float, scaled once, lanes sorted
/// apart. One thread.
class SampleStream {
 public:
  /// Checks the claims of the header against the files first.
  static Result<SampleStream> open(const Raster& raster);

  /// The next n samples in file order. kBadInput if the data end early or are damaged.
  Status read(float* to, size_t n);

  /// Leaves n samples out.
  Status skip(uint64_t n);

  /// All samples that are left, lane l of voxel v to lanes[l][v * stride]. For files whose lanes
  /// are not slowest.
  Status read_lanes(const std::vector<float*>& lanes, size_t stride);

 private:
  SampleStream(Raster raster, ByteSource source);
  Status read_text(float* to, size_t n);
  Error ends_early() const;

  Raster raster_;
  ByteSource source_;
  std::vector<char> bytes_;
  std::string text_;  ///< characters read but not yet parsed
  bool text_ended_ = false;
  uint64_t position_ = 0;  ///< samples delivered
};

/// The sentence about values that are not finite, if there are any; kNotFinite for one component,
/// else kBadInput. Shape of values: (nz, ny, nx, components).
Status check_finite(const std::filesystem::path& file, size_t frame, const Grid& grid,
                    const float* values, size_t components);

}  // namespace palpate::files
