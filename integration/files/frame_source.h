#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compute/volume/volume.h"
#include "integration/files/raster/raster.h"

namespace palpate::files {

/// Frames of one grid that are read one by one. The base class has what is known before any sample
/// is read.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Frame k; cheapest in rising order. One thread at a time.
  virtual Result<Volume> frame(size_t k) = 0;

  Grid grid;
  size_t frame_count = 0;
  std::vector<double> times_s;
  bool times_known = false;
  std::string ordered_by;          ///< what gives the order of the frames; empty: the file itself
  std::vector<std::string> notes;  ///< what a person should know of the files, a sentence each

  std::optional<float> nan_as;  ///< what samples that are NaN become; without it they are refused
  /// 1 where no frame read so far had a NaN, shape (nz, ny, nx); empty: nowhere was one
  std::vector<uint8_t> numbers;

 protected:
  /// Replaces NaN and remembers where it was.
  void replace_nan(Volume& frame);
};

/// The frames of one file. kBadInput if it holds vectors.
Result<std::unique_ptr<FrameSource>> open_raster_frames(const Raster& raster);

/// One frame per file, in the order given. All headers are read and compared at once.
Result<std::unique_ptr<FrameSource>> open_frame_files(
    const std::vector<std::filesystem::path>& files);

/// What differs first between two grids, for a person ("a spacing of 1 x 1 x 2 mm where frame 0 has
/// ...").
std::string difference(const Grid& grid, const Grid& first);

}  // namespace palpate::files
