#include "integration/files/frame_source.h"

#include <algorithm>
#include <cmath>

#include "compute/volume/memory.h"
#include "integration/files/frame_times.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/raster/samples.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

/// Integers within a finite scaling are finite; only real numbers need the check.
bool may_hold_nan(const Raster& raster) {
  return raster.type == SampleType::kFloat || raster.type == SampleType::kDouble ||
         raster.encoding == Encoding::kText || raster.slope != 1.0 || raster.intercept != 0.0;
}

/// One file whose frames follow each other, or lie interleaved.
class RasterFrames : public FrameSource {
 public:
  explicit RasterFrames(Raster raster) : raster_(std::move(raster)) {
    grid = raster_.grid;
    frame_count = raster_.frame_count();
    times_known = raster_.times_known;
    times_s = times_known ? raster_.times_s : counted_times(frame_count);
    notes = raster_.notes;
    interleaved_ = frame_count > 1 && raster_.inner != grid.count();
  }

  Status open() {
    auto stream = SampleStream::open(raster_);
    if (!stream) return stream.error();
    stream_ = std::make_unique<SampleStream>(std::move(*stream));
    next_ = 0;
    return Nothing{};
  }

  Result<Volume> frame(size_t k) override {
    if (k >= frame_count)
      return bad_input(raster_.file, "has {} frames, so there is no frame {}", frame_count, k);
    return interleaved_ ? interleaved_frame(k) : following_frame(k);
  }

 private:
  Result<Volume> following_frame(size_t k) {
    if (k < next_ || !stream_) {
      if (const Status opened = open(); !opened) return opened.error();
    }
    if (k > next_) {
      if (const Status skipped = stream_->skip((k - next_) * grid.count()); !skipped)
        return fail(skipped.error());
    }
    Volume volume{grid, std::vector<float>(grid.count())};
    if (const Status got = stream_->read(volume.values.data(), volume.values.size()); !got)
      return fail(got.error());
    next_ = k + 1;
    return checked(k, std::move(volume));
  }

  /// Every frame is spread over the whole file, so the first call reads all. Each frame is moved
  /// out once; asking for it again reads the file again.
  Result<Volume> interleaved_frame(size_t k) {
    if (buffered_.empty() || buffered_[k].values.empty()) {
      if (const Status got = read_all(); !got) return fail(got.error());
    }
    return checked(k, std::move(buffered_[k]));
  }

  Status read_all() {
    const auto bytes = double(grid.count()) * double(frame_count) * sizeof(float);
    const Status fits = check_fits_memory(fmt::format("'{}'", raster_.file.string()), bytes);
    if (!fits) return fits;
    if (const Status opened = open(); !opened) return opened;
    buffered_.clear();
    std::vector<float*> lanes;
    for (size_t k = 0; k < frame_count; ++k) {
      buffered_.push_back(Volume{grid, std::vector<float>(grid.count())});
      lanes.push_back(buffered_.back().values.data());
    }
    return stream_->read_lanes(lanes, 1);
  }

  Result<Volume> checked(size_t k, Volume volume) {
    // What was replaced is remembered in the grid's order.
    if (nan_as) reverse_j(grid, volume.values.data(), 1);
    if (may_hold_nan(raster_)) {
      replace_nan(volume);
      const Status finite = check_finite(raster_.file, k, grid, volume.values.data(), 1);
      if (!finite) return finite.error();
    }
    if (!nan_as) reverse_j(grid, volume.values.data(), 1);
    return volume;
  }

  /// After an error the position in the stream is not known, so the next call starts again.
  Error fail(Error error) {
    stream_.reset();
    buffered_.clear();
    next_ = 0;
    return error;
  }

  Raster raster_;
  bool interleaved_ = false;
  std::unique_ptr<SampleStream> stream_;
  size_t next_ = 0;  ///< the frame at which the stream stands
  std::vector<Volume> buffered_;
};

class FrameFiles : public FrameSource {
 public:
  explicit FrameFiles(std::vector<Raster> rasters) : rasters_(std::move(rasters)) {
    grid = rasters_.front().grid;
    frame_count = rasters_.size();
    times_s = counted_times(frame_count);
    // A note on one file mostly holds for all, so it is given once.
    const auto noted = [](const Raster& raster) { return !raster.notes.empty(); };
    const auto first = std::find_if(rasters_.begin(), rasters_.end(), noted);
    if (first == rasters_.end()) return;
    notes = first->notes;
    const auto others = std::count_if(first + 1, rasters_.end(), noted);
    if (others > 0) notes.push_back(fmt::format("So it is with {} more of the frames.", others));
  }

  Result<Volume> frame(size_t k) override {
    if (k >= frame_count) {
      return bad_input(rasters_.back().file, "is the last of {} frames, so there is no frame {}",
                       frame_count, k);
    }
    auto source = open_raster_frames(rasters_[k]);
    if (!source) return source.error();
    (*source)->nan_as = nan_as;
    (*source)->numbers = std::move(numbers);
    auto volume = (*source)->frame(0);
    numbers = std::move((*source)->numbers);
    // The same grid to a thousandth of a voxel becomes the same grid bit by bit.
    if (volume) volume->grid = grid;
    return volume;
  }

 private:
  std::vector<Raster> rasters_;
};

std::string triple(const char* format, glm::dvec3 v) {
  return fmt::format(fmt::runtime(format), v.x, v.y, v.z);
}

}  // namespace

void FrameSource::replace_nan(Volume& frame) {
  if (!nan_as) return;
  for (size_t v = 0; v < frame.values.size(); ++v) {
    if (!std::isnan(frame.values[v])) continue;
    if (numbers.empty()) numbers.assign(frame.values.size(), 1);
    numbers[v] = 0;
    frame.values[v] = *nan_as;
  }
}

std::string difference(const Grid& grid, const Grid& first) {
  constexpr const char* kTimes = "{:.6g} x {:.6g} x {:.6g}";
  constexpr const char* kPoint = "({:.6g}, {:.6g}, {:.6g})";
  if (grid.size != first.size) {
    return fmt::format("a size of {} where frame 0 has {}", triple(kTimes, glm::dvec3(grid.size)),
                       triple(kTimes, glm::dvec3(first.size)));
  }
  // Each difference counts by how far it moves the far end of the image, as in same_geometry().
  const double tolerance_mm =
      1e-3 * first.finest_mm() / double(std::max({grid.size.x, grid.size.y, grid.size.z}));
  if (glm::length(grid.spacing_mm - first.spacing_mm) > tolerance_mm) {
    return fmt::format("a spacing of {} mm where frame 0 has {} mm",
                       triple(kTimes, grid.spacing_mm), triple(kTimes, first.spacing_mm));
  }
  for (int c = 0; c < 3; ++c) {
    if (glm::length(grid.direction[c] - first.direction[c]) * first.finest_mm() > tolerance_mm) {
      return fmt::format("a direction of axis {} of {} where frame 0 has {}", c,
                         triple(kPoint, grid.direction[c]), triple(kPoint, first.direction[c]));
    }
  }
  return fmt::format("an origin of {} mm where frame 0 has {} mm", triple(kPoint, grid.origin_mm),
                     triple(kPoint, first.origin_mm));
}

Result<std::unique_ptr<FrameSource>> open_raster_frames(const Raster& raster) {
  if (is_colour_picture(raster)) return refuse_colours(raster);
  if (raster.component_count() > 1) {
    return bad_input(
        raster.file,
        "holds {} values per voxel where one is needed: export one component as a gray image",
        raster.component_count());
  }
  auto frames = std::make_unique<RasterFrames>(raster);
  if (const Status opened = frames->open(); !opened) return opened.error();
  return std::unique_ptr<FrameSource>(std::move(frames));
}

Result<std::unique_ptr<FrameSource>> open_frame_files(
    const std::vector<std::filesystem::path>& files) {
  std::vector<Raster> rasters;
  for (const auto& file : files) {
    auto raster = read_raster_header(file);
    if (!raster) return raster.error();
    if (is_colour_picture(*raster)) return refuse_colours(*raster);
    if (raster->component_count() > 1) {
      return bad_input(
          file,
          "holds {} values per voxel where one is needed: leave it out, or export one component",
          raster->component_count());
    }
    if (raster->frame_count() > 1) {
      return bad_input(
          file,
          "holds {} frames itself, but as one of several files it must hold one: name it alone",
          raster->frame_count());
    }
    if (const Status good = check_claims(*raster); !good) return good.error();
    if (!rasters.empty() && !same_geometry(raster->grid, rasters.front().grid)) {
      return bad_input(file, "(frame {}) has {}: resample all frames to one grid", rasters.size(),
                       difference(raster->grid, rasters.front().grid));
    }
    rasters.push_back(std::move(*raster));
  }
  return std::unique_ptr<FrameSource>(std::make_unique<FrameFiles>(std::move(rasters)));
}

}  // namespace palpate::files
