// The headers that palpate writes; the parsers of the same formats are in *_header.cpp.

#include <cstring>
#include <glm/gtc/quaternion.hpp>

#include "integration/files/raster/image_writer.h"
#include "integration/files/raster/nifti_header.h"
#include "integration/files/sentences.h"

namespace palpate::files {
namespace {

std::string joined(glm::dvec3 v, const char* separator) {
  // The shortest text that reads back as the same double.
  return fmt::format("{}{}{}{}{}", v.x, separator, v.y, separator, v.z);
}

bool has_frames(const ImageToWrite& picture) {
  return picture.frames.size() > 1;
}

/// Little-endian bytes at a place of a binary header.
template <class T>
void put(std::string& bytes, size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

/// The unit quaternion of a rotation with a non-negative real part, as (b, c, d): the largest of
/// the four is found first, so that no divisor is small.
glm::dvec3 quaternion_of(const glm::dmat3& r) {
  const glm::dquat q = glm::normalize(glm::quat_cast(r));
  return (q.w < 0.0 ? -1.0 : 1.0) * glm::dvec3(q.x, q.y, q.z);
}

}  // namespace

std::string meta_header_of(const ImageToWrite& picture) {
  const Grid grid = as_in_file(picture.grid);
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
      "False\nCompressedData = False\n"
      "TransformMatrix = {} {} {}\nOffset = {}\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = "
      "RAI\n"
      "ElementSpacing = {}\nDimSize = {} {} {}\n{}ElementType = {}\nElementDataFile = LOCAL\n",
      joined(grid.direction[0], " "), joined(grid.direction[1], " "),
      joined(grid.direction[2], " "), joined(grid.origin_mm, " "), joined(grid.spacing_mm, " "),
      grid.size.x, grid.size.y, grid.size.z,
      picture.components > 1 ? fmt::format("ElementNumberOfChannels = {}\n", picture.components)
                             : std::string{},
      picture.type == SampleType::kFloat ? "MET_FLOAT" : "MET_UCHAR");
}

std::string nrrd_header_of(const ImageToWrite& picture) {
  const Grid grid = as_in_file(picture.grid);
  const bool vectors = picture.components > 1;
  const bool frames = has_frames(picture);
  std::string directions;
  for (int c = 0; c < 3; ++c)
    directions += fmt::format(" ({})", joined(grid.direction[c] * grid.spacing_mm[c], ","));
  std::string text = fmt::format(
      "NRRD0005\ntype: {}\ndimension: {}\nspace: left-posterior-superior\nsizes:{} {} {} {}{}\n"
      "space directions:{}{}{}\nkinds:{} domain domain domain{}\nendian: little\nencoding: "
      "raw\nspace origin: ({})\n",
      picture.type == SampleType::kFloat ? "float" : "uchar", 3 + int(vectors) + int(frames),
      vectors ? fmt::format(" {}", picture.components) : std::string{}, grid.size.x, grid.size.y,
      grid.size.z, frames ? fmt::format(" {}", picture.frames.size()) : std::string{},
      vectors ? " none" : "", directions, frames ? " none" : "", vectors ? " vector" : "",
      frames ? " list" : "", joined(grid.origin_mm, ","));
  if (frames) {
    const int axis = 3 + int(vectors);
    std::string values;
    for (size_t k = 0; k < picture.frames.size(); ++k) {
      values += fmt::format(" {}", picture.times_s.empty() ? double(k) : picture.times_s[k]);
    }
    text += fmt::format("labels:{} \"\" \"\" \"\" \"{}\"\n", vectors ? " \"\"" : "",
                        picture.times_s.empty() ? picture.list_of : "time");
    text += fmt::format("axis {} index type:=numeric\naxis {} index values:={}\n", axis, axis,
                        values.substr(1));
    if (!picture.times_s.empty()) text += fmt::format("axis {} index unit:=s\n", axis);
  }
  for (const auto& [key, value] : picture.keys) text += fmt::format("{}:={}\n", key, value);
  return text + "\n";
}

std::string nifti_header_of(const ImageToWrite& picture) {
  const Grid grid = as_in_file(picture.grid);
  const bool vectors = picture.components > 1;
  std::string bytes(352, '\0');  // the header and the four bytes that say "no extension"
  put<int32_t>(bytes, 0, int32_t(kNiftiHeaderBytes));
  put<char>(bytes, 38, 'r');
  const size_t frames = picture.frames.size();
  const int16_t dims[8] = {int16_t(vectors      ? 5
                                   : frames > 1 ? 4
                                                : 3),
                           int16_t(grid.size.x),
                           int16_t(grid.size.y),
                           int16_t(grid.size.z),
                           int16_t(frames > 1 ? frames : 1),
                           int16_t(picture.components),
                           1,
                           1};
  for (size_t d = 0; d < 8; ++d) put(bytes, 40 + 2 * d, dims[d]);
  put<int16_t>(bytes, 68, vectors ? 1007 : 0);
  const bool real = picture.type == SampleType::kFloat;
  put<int16_t>(bytes, 70, real ? 16 : 2);
  put<int16_t>(bytes, 72, real ? 32 : 8);
  for (size_t d = 0; d < 7; ++d)
    put<float>(bytes, 80 + 4 * d, d < 3 ? float(grid.spacing_mm[int(d)]) : 1.0f);
  put<float>(bytes, 108, 352.0f);
  put<float>(bytes, 112, 1.0f);
  put<uint8_t>(bytes, 123, 2 + 8);  // mm, s
  put<int16_t>(bytes, 252, 1);      // both forms name scanner coordinates
  put<int16_t>(bytes, 254, 1);
  const glm::dmat3 ras_from_lps(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1));
  const glm::dmat3 axes = ras_from_lps * grid.direction;
  // The quaternion holds a rotation; qfac says whether k runs against its third column.
  const double qfac = glm::determinant(axes) < 0.0 ? -1.0 : 1.0;
  put<float>(bytes, 76, float(qfac));
  const glm::dvec3 origin = ras_from_lps * grid.origin_mm,
                   quaternion = quaternion_of(glm::dmat3(axes[0], axes[1], qfac * axes[2]));
  for (int r = 0; r < 3; ++r) {
    put<float>(bytes, 256 + 4 * size_t(r), float(quaternion[r]));
    put<float>(bytes, 268 + 4 * size_t(r), float(origin[r]));
    for (int c = 0; c < 3; ++c) {
      put<float>(bytes, 280 + 16 * size_t(r) + 4 * size_t(c),
                 float(axes[c][r] * grid.spacing_mm[c]));
    }
    put<float>(bytes, 292 + 16 * size_t(r), float(origin[r]));
  }
  if (picture.components == 3) bytes.replace(328, 6, "LPS mm");
  bytes.replace(344, 3, "n+1");
  return bytes;
}

}  // namespace palpate::files
