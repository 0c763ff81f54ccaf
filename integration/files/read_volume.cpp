#include "integration/files/read_volume.h"

#include "integration/files/raster_file.h"
#include "integration/files/read_sequence.h"
#include "integration/files/samples.h"
#include "integration/files/sentences.h"

namespace palpate::files {

Result<Volume> read_volume(const std::filesystem::path& input) {
  auto reader = SequenceReader::open({input});
  if (!reader) return reader.error();
  if (reader->frame_count() != 1) {
    return bad_input(input,
                     "holds {} frames where one volume is needed: export the frame you mean to a "
                     "file of its own",
                     reader->frame_count());
  }
  return reader->frame(0);
}

Result<Mask> read_mask(const std::filesystem::path& input) {
  const auto volume = read_volume(input);
  if (!volume) return volume.error();
  Mask mask{volume->grid, std::vector<uint8_t>(volume->values.size())};
  for (size_t i = 0; i < mask.values.size(); ++i) mask.values[i] = volume->values[i] != 0.0f;
  return mask;
}

Result<Field> read_field(const std::filesystem::path& file) {
  const auto raster = read_raster_header(file);
  if (!raster) return raster.error();
  if (raster->component_count() != 3) {
    return bad_input(file,
                     "holds {} values per voxel, but a displacement field has three: name a field "
                     "that palpate or ITK wrote",
                     raster->component_count());
  }
  auto stream = SampleStream::open(*raster);
  if (!stream) return stream.error();
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "vectors are read as runs of floats");
  Field field{raster->grid, std::vector<glm::vec3>(raster->grid.count())};
  float* const values = &field.u_mm.front().x;
  const Status got = raster->inner == 1 ? stream->read(values, 3 * field.u_mm.size())
                                        : stream->read_lanes({values, values + 1, values + 2}, 3);
  if (!got) return got.error();
  const Status finite = check_finite(file, 0, field.grid, values, 3);
  if (!finite) return finite.error();
  if (raster->vectors_are_ras) {
    for (glm::vec3& u : field.u_mm) u = {-u.x, -u.y, u.z};
  }
  return field;
}

}  // namespace palpate::files
