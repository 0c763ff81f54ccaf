#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "integration/files/raster/raster_file.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

/// A file format of your own: VTK's legacy images (.vtk, STRUCTURED_POINTS with one scalar). The
/// header is parsed here; palpate reads the samples, converts their byte order and checks all
/// sizes.

/// Parses the header at the beginning of `text`: six to ten lines, followed by the samples. The
/// format has no patient axes and no unit; LPS and mm are used, as in ITK. Opens no file; `file` is
/// used in messages and in the Raster. kBadInput with a sentence if it can not be read.
inline palpate::Result<palpate::files::Raster> parse_vtk_header(const std::filesystem::path& file,
                                                                std::string_view text) {
  using palpate::SampleType;
  using namespace palpate::files;
  static const std::map<std::string, SampleType> types = {
      {"char", SampleType::kInt8},   {"unsigned_char", SampleType::kUint8},
      {"short", SampleType::kInt16}, {"unsigned_short", SampleType::kUint16},
      {"int", SampleType::kInt32},   {"unsigned_int", SampleType::kUint32},
      {"float", SampleType::kFloat}, {"double", SampleType::kDouble},
  };
  const size_t all = text.size();
  take_line(text);  // the identifier, "# vtk DataFile Version ..."
  take_line(text);  // the title
  const std::string encoding = lowered(trimmed(take_line(text)));
  if (encoding != "ascii" && encoding != "binary")
    return bad_input(file, "is neither ASCII nor BINARY: save it again");

  Raster raster;
  Placement placement;
  std::string type;
  // The samples follow the line LOOKUP_TABLE, whose name is "default" from most writers.
  for (std::string key; key != "lookup_table";) {
    if (text.empty())
      return bad_input(file, "has no scalars as palpate reads them: save them as one scalar");
    const std::string line = lowered(trimmed(take_line(text)));
    const std::vector<std::string_view> parts = words(line);
    if (parts.empty()) continue;
    key = parts[0];
    if (key == "dataset" && line != "dataset structured_points")
      return bad_input(file, "holds no image (STRUCTURED_POINTS): resample it to one");
    if (key == "scalars" && parts.size() >= 3) {
      if (parts.size() > 3 && parts[3] != "1")
        return bad_input(file, "holds more than one value per voxel: export one of them");
      type = parts[2];
    }
    if (key != "dimensions" && key != "spacing" && key != "aspect_ratio" && key != "origin")
      continue;
    const auto numbers = to_numbers(std::string_view(line).substr(key.size()));
    if (!numbers || numbers->size() != 3)
      return bad_input(file, "needs three numbers after '{}': correct its header", key);
    glm::dvec3& into = key == "dimensions" ? placement.size
                       : key == "origin"   ? placement.origin_mm
                                           : placement.spacing_mm;
    into = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }
  const auto known = types.find(type);
  if (known == types.end())
    return bad_input(file, "has samples of type '{}': save them as short or float", type);
  // Refuses impossible sizes and spacings.
  auto grid = make_grid(file, placement);
  if (!grid) return grid.error();

  raster.file = file;
  raster.data = {file};
  raster.file_skip = all - text.size();
  raster.encoding = encoding == "ascii" ? Encoding::kText : Encoding::kRaw;
  raster.type = known->second;
  raster.big_endian = true;
  raster.grid = *grid;
  raster.inner = grid->count();
  return raster;
}

/// Call once, before any file is read.
inline void add_vtk_images() {
  using palpate::SampleType;
  using namespace palpate::files;
  add_raster_format(
      {"VTK",
       {".vtk"},
       [](std::string_view bytes) { return bytes.starts_with("# vtk DataFile Version"); },
       [](const std::filesystem::path& file) -> palpate::Result<Raster> {
         const auto start = start_of_file(file, 4096);
         if (!start) return start.error();
         return parse_vtk_header(file, *start);
       }});
}
