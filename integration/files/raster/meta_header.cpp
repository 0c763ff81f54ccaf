#include "integration/files/raster/meta_header.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "integration/files/frame_times.h"
#include "integration/files/raster/tracked_frames.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

struct MetaFields {
  std::map<std::string, std::string> values;  ///< names in lower case
  std::vector<std::string> data_files;        ///< the lines after "ElementDataFile = LIST"
  size_t header_bytes = 0;

  /// The first of several names that the header holds: the format has synonyms.
  std::string_view get(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (const auto found = values.find(name); found != values.end()) return found->second;
    }
    return {};
  }
  bool is_true(std::initializer_list<const char*> names) const {
    const std::string value = lowered(get(names));
    return value == "true" || value == "1";
  }
};

std::optional<SampleType> sample_type(std::string_view name) {
  static const std::map<std::string_view, SampleType> kTypes = {
      {"MET_CHAR", SampleType::kInt8},       {"MET_UCHAR", SampleType::kUint8},
      {"MET_SHORT", SampleType::kInt16},     {"MET_USHORT", SampleType::kUint16},
      {"MET_INT", SampleType::kInt32},       {"MET_UINT", SampleType::kUint32},
      {"MET_LONG_LONG", SampleType::kInt64}, {"MET_ULONG_LONG", SampleType::kUint64},
      {"MET_FLOAT", SampleType::kFloat},     {"MET_DOUBLE", SampleType::kDouble}};
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) return std::nullopt;
  return found->second;
}

Error wrong_meta_field(const std::filesystem::path& file, const char* field) {
  return bad_input(file, "has a '{}' line that makes no sense: correct its header", field);
}

Result<MetaFields> split_header(const std::filesystem::path& file, std::string_view text) {
  MetaFields header;
  const size_t all = text.size();
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    const size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      if (trimmed(line).empty()) continue;
      return bad_input(
          file, "has a header line that is no 'Name = value' ('{}'): check that it is a MetaImage",
          line.substr(0, 40));
    }
    const std::string name = lowered(trimmed(line.substr(0, equals)));
    const std::string_view value = trimmed(line.substr(equals + 1));
    header.values[name] = value;
    if (name != "elementdatafile") continue;
    header.header_bytes = all - text.size();
    while (value.substr(0, 4) == "LIST" && !text.empty()) {
      if (const std::string_view entry = trimmed(take_line(text)); !entry.empty())
        header.data_files.emplace_back(entry);
    }
    return header;
  }
  return bad_input(
      file,
      "has no ElementDataFile line: it is no MetaImage or its header was cut off; save it again");
}

/// How many of the file's dimensions are space; one behind them is frames.
struct MetaAxes {
  size_t all = 3;
  size_t space = 3;
  bool has_frames() const { return all > space; }
};

/// The numbers of a line, one per axis of the file or of space; `fallback` where there is no line.
Result<std::vector<double>> numbers(const std::filesystem::path& file, std::string_view text,
                                    const char* field, MetaAxes axes, double fallback) {
  std::vector<double> all(axes.all, fallback);
  if (text.empty()) return all;
  const auto values = to_numbers(text);
  if (!values || (values->size() != axes.all && values->size() != axes.space))
    return wrong_meta_field(file, field);
  std::copy(values->begin(), values->end(), all.begin());
  return all;
}

/// The directions of the axes of space, as rows of a square matrix of the file's dimensions or of
/// those of space alone. A third one that is not there is 0.
Result<glm::dmat3> meta_directions(const std::filesystem::path& file, std::string_view text,
                                   MetaAxes axes) {
  glm::dmat3 directions(1.0);
  if (axes.space == 2) directions[2] = glm::dvec3(0.0);
  if (text.empty()) return directions;
  const auto values = to_numbers(text);
  const size_t count = values ? values->size() : 0;
  const size_t n = count == axes.all * axes.all ? axes.all : axes.space;
  if (count != n * n) return wrong_meta_field(file, "TransformMatrix");
  for (size_t a = 0; a < std::min<size_t>(n, 3); ++a)
    for (size_t r = 0; r < std::min<size_t>(n, 3); ++r)
      directions[int(a)][int(r)] = (*values)[a * n + r];
  return directions;
}

/// What the dimensions are: the last one is frames if there are four, if Kinds says so, or if the
/// file says something of each frame.
Result<MetaAxes> meta_axes(const MetaFields& header, const FrameFields& frames,
                           const Raster& raster) {
  const auto dimensions = to_integer(header.get({"ndims"}));
  if (!dimensions || *dimensions < 2 || *dimensions > 4) {
    return bad_input(raster.file,
                     "has {} dimensions, but 2 to 4 are needed: save it as a 3D or 4D image",
                     header.get({"ndims"}));
  }
  MetaAxes axes{size_t(*dimensions), size_t(*dimensions)};
  const std::string kinds_text = lowered(header.get({"kinds"}));
  const auto kinds = words(kinds_text);
  const auto is_frames = [](std::string_view kind) { return kind == "list" || kind == "time"; };
  const auto first = std::find_if(kinds.begin(), kinds.end(), is_frames);
  if (first != kinds.end() && size_t(first - kinds.begin()) + 1 != axes.all)
    return wrong_meta_field(raster.file, "Kinds");
  if (axes.all == 4 || first != kinds.end() || (axes.all == 3 && kinds.empty() && !frames.empty()))
    --axes.space;
  if (axes.space < 2) return wrong_meta_field(raster.file, "Kinds");
  return axes;
}

Status place(const MetaFields& header, Raster& raster) {
  const FrameFields frames = frame_fields(header.values);
  const auto axes = meta_axes(header, frames, raster);
  if (!axes) return axes.error();
  const auto sizes = to_numbers(header.get({"dimsize"}));
  if (!sizes || sizes->size() != axes->all) return wrong_meta_field(raster.file, "DimSize");
  const auto spacing = numbers(raster.file, header.get({"elementspacing", "elementsize"}),
                               "ElementSpacing", *axes, 1.0);
  if (!spacing) return spacing.error();
  const auto origin =
      numbers(raster.file, header.get({"offset", "position", "origin"}), "Offset", *axes, 0.0);
  if (!origin) return origin.error();
  const auto directions = meta_directions(
      raster.file, header.get({"transformmatrix", "rotation", "orientation"}), *axes);
  if (!directions) return directions.error();
  Placement placement{.size = glm::dvec3(1.0), .spacing_mm = glm::dvec3(0.0), .axes = *directions};
  for (size_t a = 0; a < std::min<size_t>(axes->all, 3); ++a)
    placement.origin_mm[int(a)] = (*origin)[a];
  for (size_t a = 0; a < axes->space; ++a) {
    placement.size[int(a)] = (*sizes)[a];
    placement.spacing_mm[int(a)] = (*spacing)[a];
  }
  complete_slice(placement);
  turn_ultrasound(header.get({"ultrasoundimageorientation"}), int(axes->space), placement, raster);
  auto grid = make_grid(raster.file, placement);
  if (!grid) return grid.error();
  raster.grid = *grid;
  raster.inner = raster.grid.count();
  if (!axes->has_frames()) return Nothing{};

  const double count = (*sizes)[axes->space];
  if (!(count >= 1.0 && count <= kMaxLanes)) return wrong_meta_field(raster.file, "DimSize");
  raster.lanes = size_t(count);
  const double step_s = (*spacing)[axes->space];
  // Writers put a step of 1 where they do not know it.
  if (step_s > 0.0 && step_s != 1.0 && raster.lanes > 1) {
    raster.times_s = counted_times(raster.lanes);
    for (double& t : raster.times_s) t = (*origin)[axes->space] + t * step_s;
    raster.times_known = true;
    if (const Status rising = check_rising(raster.file, raster.times_s); !rising) return rising;
  }
  return apply_frame_fields(frames, raster);
}

Status find_channels(const MetaFields& header, Raster& raster) {
  const auto text = header.get({"elementnumberofchannels"});
  const auto channels = text.empty() ? 1 : to_integer(text).value_or(0);
  if (channels < 1 || channels > 1000)
    return wrong_meta_field(raster.file, "ElementNumberOfChannels");
  if (channels == 1) return Nothing{};
  if (raster.lanes > 1) {
    return bad_input(raster.file,
                     "has both frames and {} values per voxel, but palpate reads one of them: "
                     "export one channel",
                     channels);
  }
  raster.lane_kind = LaneKind::kComponents;
  raster.lanes = size_t(channels);
  raster.inner = 1;
  return Nothing{};
}

Status find_samples(const MetaFields& header, Raster& raster) {
  const auto type = sample_type(header.get({"elementtype"}));
  if (!type) {
    return bad_input(
        raster.file,
        "has samples of type '{}', which palpate does not read: save it as short or float",
        header.get({"elementtype"}));
  }
  raster.type = *type;
  raster.big_endian = header.is_true({"binarydatabyteordermsb", "elementbyteordermsb"});
  const bool text = !header.get({"binarydata"}).empty() && !header.is_true({"binarydata"});
  raster.encoding = text                                 ? Encoding::kText
                    : header.is_true({"compresseddata"}) ? Encoding::kDeflate
                                                         : Encoding::kRaw;
  const auto slope = header.get({"elementtointensityfunctionslope"});
  const auto offset = header.get({"elementtointensityfunctionoffset"});
  raster.slope = slope.empty() ? 1.0 : to_number(slope).value_or(NAN);
  raster.intercept = offset.empty() ? 0.0 : to_number(offset).value_or(NAN);
  if (!std::isfinite(raster.slope) || !std::isfinite(raster.intercept)) {
    return wrong_meta_field(raster.file, "ElementToIntensityFunction");
  }
  return Nothing{};
}

Status find_data(const MetaFields& header, Raster& raster) {
  const std::string_view name = header.get({"elementdatafile"});
  if (lowered(name) == "local") {
    raster.data = {raster.file};
    raster.file_skip = header.header_bytes;
    return Nothing{};
  }
  if (name.find('%') != std::string_view::npos) {
    return bad_input(
        raster.file,
        "names its data files by a pattern: list them ('ElementDataFile = LIST') instead");
  }
  std::vector<std::string> names = header.data_files;
  if (name.substr(0, 4) != "LIST") names = {std::string(name)};
  for (const std::string& entry : names) {
    if (!entry.empty()) raster.data.push_back(raster.file.parent_path() / entry);
  }
  if (raster.data.empty()) return bad_input(raster.file, "names no data files: correct its header");
  const auto text = header.get({"headersize"});
  const auto skip = text.empty() ? 0 : to_integer(text).value_or(-2);
  if (skip < -1) return wrong_meta_field(raster.file, "HeaderSize");
  raster.samples_at_end = skip == -1;
  if (skip > 0) raster.file_skip = uint64_t(skip);
  return Nothing{};
}

}  // namespace

Result<Raster> parse_meta_header(const std::filesystem::path& file, std::string_view text) {
  const auto header = split_header(file, text);
  if (!header) return header.error();
  Raster raster;
  raster.file = file;
  if (const Status done = place(*header, raster); !done) return done.error();
  if (const Status done = find_channels(*header, raster); !done) return done.error();
  if (const Status done = find_samples(*header, raster); !done) return done.error();
  if (const Status done = find_data(*header, raster); !done) return done.error();
  return raster;
}

}  // namespace palpate::files
