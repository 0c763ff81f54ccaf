#include "integration/files/sequence_motion_file.h"

#include <fmt/ranges.h>

#include "integration/files/raster/image_writer.h"
#include "integration/files/raster/nrrd_fields.h"
#include "integration/files/raster/raster_file.h"
#include "integration/files/raster/samples.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {

namespace fs = std::filesystem;

namespace {

std::string numbers_text(glm::dvec3 v) {
  return fmt::format("{} {} {}", v.x, v.y, v.z);
}

}  // namespace

bool holds_sequence_motion(const fs::path& file) {
  const auto text = read_nrrd_header_text(file);
  if (!text) return false;
  const auto header = split_nrrd_header(file, *text);
  return header && !header->key(kSequenceMotionKey).empty();
}

Result<SequenceMotionHeader> read_sequence_motion_header(const fs::path& file) {
  const auto text = read_nrrd_header_text(file);
  if (!text) return text.error();
  return parse_sequence_motion_header(file, *text);
}

Result<SequenceMotion> read_sequence_motion(const fs::path& file) {
  auto header = read_sequence_motion_header(file);
  if (!header) return header.error();
  // Refuses what is shorter than it claims, and what does not fit, before anything is allocated.
  auto stream = SampleStream::open(header->raster);
  if (!stream) return stream.error();
  const Grid& grid = header->raster.grid;
  SequenceMotion motion{header->reference, header->basis, {}, header->frames_grid};
  for (size_t n = 0; n < motion.basis.terms(); ++n) {
    Field term{grid, std::vector<glm::vec3>(grid.count())};
    float* const values = &term.u_mm.front().x;
    if (const Status got = stream->read(values, 3 * term.u_mm.size()); !got) return got.error();
    const Status finite = check_finite(file, n, grid, values, 3);
    if (!finite) return finite.error();
    reverse_j(grid, values, 3);
    motion.terms.push_back(std::move(term));
  }
  return motion;
}

Status write_sequence_motion(const SequenceMotion& motion, const fs::path& file) {
  if (!lowered(file.filename().string()).ends_with(".nrrd"))
    return bad_output(file, "can not hold the motion of a sequence: name it .nrrd");
  ImageToWrite picture;
  picture.grid = motion.terms.front().grid;
  picture.components = 3;
  picture.list_of = "term";
  for (const Field& term : motion.terms) picture.frames.push_back(term.u_mm.data());
  picture.keys = {
      {kSequenceMotionKey, "1"},
      {"SequenceMotion.ReferenceFrame", fmt::format("{}", motion.reference)},
      {"SequenceMotion.FrameTimes_s", fmt::format("{}", fmt::join(motion.basis.times_s, " "))},
      {"SequenceMotion.Cycle_s", fmt::format("{}", motion.basis.cycle_s)},
      {"SequenceMotion.Harmonics", fmt::format("{}", motion.basis.harmonics)},
      {"SequenceMotion.Clock", "frames"},
      {"SequenceMotion.RepeatsFirst", motion.basis.repeats_first ? "1" : "0"}};
  if (motion.frames_grid) {
    const Grid grid = as_in_file(*motion.frames_grid);
    const glm::dmat3& axes = grid.direction;
    picture.keys.insert(picture.keys.end(),
                        {{"SequenceMotion.FramesSize", numbers_text(glm::dvec3(grid.size))},
                         {"SequenceMotion.FramesSpacing_mm", numbers_text(grid.spacing_mm)},
                         {"SequenceMotion.FramesOrigin_mm", numbers_text(grid.origin_mm)},
                         {"SequenceMotion.FramesDirections",
                          fmt::format("{} {} {}", numbers_text(axes[0]), numbers_text(axes[1]),
                                      numbers_text(axes[2]))}});
  }
  return write_picture(picture, file);
}

}  // namespace palpate::files
