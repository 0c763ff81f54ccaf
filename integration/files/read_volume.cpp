#include "integration/files/read_volume.h"

#include "compute/volume/memory.h"
#include "integration/files/frame_names.h"
#include "integration/files/frame_source.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/raster/raw_header.h"
#include "integration/files/raster/samples.h"
#include "integration/files/read_sequence.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;

/// A single folder stands for the images in it.
std::vector<fs::path> files_of(const std::vector<fs::path>& inputs) {
  std::error_code error;
  if (inputs.size() == 1 && fs::is_directory(inputs.front(), error))
    return images_in(inputs.front());
  return inputs;
}

/// Components as the file has them become displacements in mm along L, P, S.
void turn_to_lps(const Raster& raster, VectorFrame& vectors) {
  const glm::ivec3 size = raster.grid.size;
  glm::vec3* v = vectors.values.data();
  for (int k = 0; k < size.z; ++k) {
    for (int j = 0; j < size.y; ++j) {
      for (int i = 0; i < size.x; ++i, ++v) {
        glm::dvec3 lps = raster.lps_from_vector * glm::dvec3(*v);
        if (raster.vectors_are_places) lps -= raster.grid.lps_from_index({i, j, k});
        *v = lps;
      }
    }
  }
}

Result<VectorFrame> vectors_of(const Raster& raster, size_t frame) {
  auto stream = SampleStream::open(raster);
  if (!stream) return stream.error();
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "vectors are read as runs of floats");
  VectorFrame vectors{raster.grid, std::vector<glm::vec3>(raster.grid.count())};
  float* const values = &vectors.values.front().x;
  const Status got = raster.inner == 1 ? stream->read(values, 3 * vectors.values.size())
                                       : stream->read_lanes({values, values + 1, values + 2}, 3);
  if (!got) return got.error();
  const Status finite = check_finite(raster.file, frame, vectors.grid, values, 3);
  if (!finite) return finite.error();
  reverse_j(vectors.grid, values, 3);
  if (raster.lps_from_vector != glm::dmat3(1.0) || raster.vectors_are_places)
    turn_to_lps(raster, vectors);
  return vectors;
}

/// The header of a file that has none, and whether the file fits it: that is all there is to tell a
/// wrong size by.
Result<Raster> fitting_raw_header(const fs::path& file, const RawSamples& samples) {
  auto raster = raw_header(file, samples);
  if (!raster) return raster;
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  if (error) return bad_input(file, "can not be read: check its name and its permissions");
  if (bytes != raster->byte_count())
    return bad_input(
        file,
        "holds {} bytes, but {} x {} x {} samples of {} bytes are {}: correct what the "
        "scene says of it",
        bytes, samples.size.x, samples.size.y, samples.size.z,
        bytes_of(raster->type) * raster->component_count(), raster->byte_count());
  return raster;
}

}  // namespace

Result<Volume> read_volume(const std::filesystem::path& input, Notes* notes,
                           std::optional<float> nan_as) {
  auto reader = SequenceReader::open({input}, nan_as);
  if (!reader) return reader.error();
  if (reader->frame_count() != 1) {
    return bad_input(input,
                     "holds {} frames where one volume is needed: export the frame you mean to a "
                     "file of its own",
                     reader->frame_count());
  }
  if (notes) notes->insert(notes->end(), reader->notes().begin(), reader->notes().end());
  return reader->frame(0);
}

Result<Mask> read_mask(const std::filesystem::path& input, Notes* notes) {
  const auto volume = read_volume(input, notes);
  if (!volume) return volume.error();
  Mask mask{volume->grid, std::vector<uint8_t>(volume->values.size())};
  for (size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = volume->values[i] != 0.0f;
  return mask;
}

Result<std::vector<VectorFrame>> read_vectors(const std::vector<fs::path>& inputs) {
  const std::vector<fs::path> files = files_of(inputs);
  if (files.empty()) return Error{ErrorKind::kBadInput, "There is no input: name a file or folder"};
  if (const Status order = check_listed_order(files); !order) return order.error();
  std::vector<Raster> rasters;
  double bytes = 0.0;
  for (const fs::path& file : files) {
    auto raster = read_raster_header(file);
    if (!raster) return raster.error();
    if (is_colour_picture(*raster)) return refuse_colours(*raster);
    if (raster->component_count() != 3)
      return bad_input(file,
                       "holds {} values per voxel where vectors have three: leave it out, or give "
                       "scalar frames only",
                       raster->component_count());
    if (!rasters.empty() && !same_geometry(raster->grid, rasters.front().grid))
      return bad_input(file, "(frame {}) has {}: resample all frames to one grid", rasters.size(),
                       difference(raster->grid, rasters.front().grid));
    bytes += double(raster->grid.count()) * sizeof(glm::vec3);
    rasters.push_back(std::move(*raster));
  }
  const Status fits = check_fits_memory(fmt::format("'{}'", inputs.front().string()), bytes);
  if (!fits) return fits.error();
  std::vector<VectorFrame> frames;
  for (const Raster& raster : rasters) {
    auto frame = vectors_of(raster, frames.size());
    if (!frame) return frame.error();
    frame->grid = rasters.front().grid;
    frames.push_back(std::move(*frame));
  }
  return frames;
}

bool holds_vectors(const std::vector<fs::path>& inputs) {
  const std::vector<fs::path> files = files_of(inputs);
  if (files.empty()) return false;
  const auto raster = read_raster_header(files.front());
  return raster && raster->component_count() == 3;
}

Result<Volume> read_raw_volume(const fs::path& file, const RawSamples& samples) {
  const auto raster = fitting_raw_header(file, samples);
  if (!raster) return raster.error();
  auto frames = open_raster_frames(*raster);
  if (!frames) return frames.error();
  return (*frames)->frame(0);
}

Result<VectorFrame> read_raw_vectors(const fs::path& file, const RawSamples& samples) {
  const auto raster = fitting_raw_header(file, samples);
  if (!raster) return raster.error();
  if (is_colour_picture(*raster)) return refuse_colours(*raster);
  auto vectors = vectors_of(*raster, 0);
  if (!vectors) return vectors.error();
  // From the axes of a scene: see raw_header().
  for (glm::vec3& v : vectors->values) v = {v.x, -v.z, v.y};
  return vectors;
}

Result<Field> read_field(const fs::path& file, Notes* notes) {
  const auto raster = read_raster_header(file);
  if (!raster) return raster.error();
  if (is_colour_picture(*raster)) return refuse_colours(*raster);
  if (raster->component_count() != 3) {
    return bad_input(file,
                     "holds {} values per voxel, but a displacement field has three: name a field "
                     "that palpate or ITK wrote",
                     raster->component_count());
  }
  auto vectors = vectors_of(*raster, 0);
  if (!vectors) return vectors.error();
  if (notes) notes->insert(notes->end(), raster->notes.begin(), raster->notes.end());
  return Field{vectors->grid, std::move(vectors->values)};
}

}  // namespace palpate::files
