#include "integration/files/meta_header.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "integration/files/frame_times.h"
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

/// `count` numbers of a line, or `fallback` where the line is not there.
Result<std::vector<double>> numbers(const std::filesystem::path& file, std::string_view text,
                                    const char* field, std::vector<double> fallback) {
  if (text.empty()) return fallback;
  auto values = to_numbers(text);
  if (!values || values->size() != fallback.size()) return wrong_meta_field(file, field);
  return *values;
}

std::vector<double> identity(size_t n) {
  std::vector<double> matrix(n * n, 0.0);
  for (size_t i = 0; i < n; ++i) matrix[i * n + i] = 1.0;
  return matrix;
}

Status place(const MetaFields& header, Raster& raster) {
  const auto dimensions = to_integer(header.get({"ndims"}));
  if (!dimensions || *dimensions < 3 || *dimensions > 4) {
    return bad_input(raster.file,
                     "has {} dimensions, but 3 or 4 are needed: save it as a 3D or 4D image",
                     header.get({"ndims"}));
  }
  const size_t n = size_t(*dimensions);
  const auto sizes = to_numbers(header.get({"dimsize"}));
  if (!sizes || sizes->size() != n) return wrong_meta_field(raster.file, "DimSize");
  const auto spacing = numbers(raster.file, header.get({"elementspacing", "elementsize"}),
                               "ElementSpacing", std::vector<double>(n, 1.0));
  if (!spacing) return spacing.error();
  const auto origin = numbers(raster.file, header.get({"offset", "position", "origin"}), "Offset",
                              std::vector<double>(n, 0.0));
  if (!origin) return origin.error();
  const auto axes = numbers(raster.file, header.get({"transformmatrix", "rotation", "orientation"}),
                            "TransformMatrix", identity(n));
  if (!axes) return axes.error();
  Placement placement;
  for (size_t a = 0; a < 3; ++a) {
    const int axis = int(a);
    placement.size[axis] = (*sizes)[a];
    placement.spacing_mm[axis] = (*spacing)[a];
    placement.origin_mm[axis] = (*origin)[a];
    for (size_t r = 0; r < 3; ++r) placement.axes[axis][int(r)] = (*axes)[a * n + r];
  }
  auto grid = make_grid(raster.file, placement);
  if (!grid) return grid.error();
  raster.grid = *grid;
  raster.inner = raster.grid.count();
  if (n == 3) return Nothing{};

  if (!((*sizes)[3] >= 1.0 && (*sizes)[3] <= kMaxLanes))
    return wrong_meta_field(raster.file, "DimSize");
  raster.lanes = size_t((*sizes)[3]);
  const double step_s = (*spacing)[3];
  // Writers put a step of 1 where they do not know it.
  if (!(step_s > 0.0) || step_s == 1.0 || raster.lanes == 1) return Nothing{};
  raster.times_s = counted_times(raster.lanes);
  for (double& t : raster.times_s) t = (*origin)[3] + t * step_s;
  raster.times_known = true;
  return check_rising(raster.file, raster.times_s);
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
