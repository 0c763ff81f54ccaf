#include "integration/files/raster/nrrd_header.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "integration/files/frame_times.h"
#include "integration/files/raster/nrrd_fields.h"
#include "integration/files/raster/tracked_frames.h"
#include "integration/files/sentences.h"
#include "integration/files/text.h"

namespace palpate::files {
namespace {

std::optional<SampleType> sample_type(const std::string& name) {
  static const std::map<std::string, SampleType, std::less<>> kTypes = {
      {"signed char", SampleType::kInt8},
      {"int8", SampleType::kInt8},
      {"int8_t", SampleType::kInt8},
      {"uchar", SampleType::kUint8},
      {"unsigned char", SampleType::kUint8},
      {"uint8", SampleType::kUint8},
      {"uint8_t", SampleType::kUint8},
      {"short", SampleType::kInt16},
      {"short int", SampleType::kInt16},
      {"signed short", SampleType::kInt16},
      {"signed short int", SampleType::kInt16},
      {"int16", SampleType::kInt16},
      {"int16_t", SampleType::kInt16},
      {"ushort", SampleType::kUint16},
      {"unsigned short", SampleType::kUint16},
      {"unsigned short int", SampleType::kUint16},
      {"uint16", SampleType::kUint16},
      {"uint16_t", SampleType::kUint16},
      {"int", SampleType::kInt32},
      {"signed int", SampleType::kInt32},
      {"int32", SampleType::kInt32},
      {"int32_t", SampleType::kInt32},
      {"uint", SampleType::kUint32},
      {"unsigned int", SampleType::kUint32},
      {"uint32", SampleType::kUint32},
      {"uint32_t", SampleType::kUint32},
      {"longlong", SampleType::kInt64},
      {"long long", SampleType::kInt64},
      {"long long int", SampleType::kInt64},
      {"int64", SampleType::kInt64},
      {"int64_t", SampleType::kInt64},
      {"ulonglong", SampleType::kUint64},
      {"unsigned long long", SampleType::kUint64},
      {"unsigned long long int", SampleType::kUint64},
      {"uint64", SampleType::kUint64},
      {"uint64_t", SampleType::kUint64},
      {"float", SampleType::kFloat},
      {"double", SampleType::kDouble}};
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) return std::nullopt;
  return found->second;
}

/// Signs that turn the header's axes to L, P, S. Spaces without anatomy are taken as LPS, as ITK
/// does.
glm::dvec3 lps_signs(std::string_view space) {
  const std::string name = lowered(space);
  if (name.starts_with("right-anterior-superior") || name == "ras" || name == "rast")
    return {-1, -1, 1};
  if (name.starts_with("left-anterior-superior") || name == "las" || name == "last")
    return {1, -1, 1};
  return {1, 1, 1};
}

/// Millimetres per unit of `space units` (its first), or of the units of an axis; unknown units are
/// taken as mm.
double mm_per(std::string_view units) {
  const auto names = words(units, " \t\r\"");
  if (names.empty()) return 1.0;
  const std::string name = lowered(names.front());
  if (name == "m" || name == "meter" || name == "meters") return 1e3;
  if (name == "cm") return 10.0;
  if (name == "um" || name == "\u00b5m" || name.starts_with("micron") ||
      name.starts_with("micrometer"))
    return 1e-3;
  return 1.0;
}

Result<Grid> grid_of(const NrrdFields& header, const std::vector<NrrdAxis>& axes, Raster& raster) {
  const std::filesystem::path& file = raster.file;
  const glm::dvec3 signs = lps_signs(header.field("space"));
  const double scale_mm = mm_per(header.field("spaceunits"));
  const auto is_space = [](const NrrdAxis& axis) { return axis.role == NrrdRole::kSpace; };
  const auto count = std::count_if(axes.begin(), axes.end(), is_space);
  if (count < 2 || count > 3)
    return bad_input(file,
                     "has {} axes of space, but three are needed, or two for a slice: save it as a "
                     "3D image",
                     count);
  Placement placement;
  if (count == 2) {
    placement.size.z = 1.0;
    placement.spacing_mm.z = 0.0;
    placement.axes[2] = glm::dvec3(0.0);
  }
  int n = 0;
  for (const NrrdAxis& axis : axes) {
    if (!is_space(axis)) continue;
    placement.size[n] = axis.size;
    if (axis.direction.size() >= 3 || (count == 2 && axis.direction.size() == 2)) {
      const glm::dvec3 step(axis.direction[0], axis.direction[1],
                            axis.direction.size() > 2 ? axis.direction[2] : 0.0);
      const double length = glm::length(step);
      placement.spacing_mm[n] = length * scale_mm;
      placement.axes[n] = signs * step / length;
    } else if (!axis.direction.empty()) {
      return bad_input(
          file, "has space directions with fewer than three components: save it as a 3D image");
    } else {
      const double axis_mm = mm_per(axis.unit);
      if (axis.spacing != 0.0) placement.spacing_mm[n] = std::abs(axis.spacing) * axis_mm;
      if (axis.spacing < 0.0) placement.axes[n] = -placement.axes[n];
      placement.origin_mm[n] = axis.first * axis_mm;
    }
    ++n;
  }
  if (const auto text = header.field("spaceorigin"); !text.empty()) {
    const auto origin = parse_nrrd_vector(text);
    if (!origin || origin->size() < size_t(count)) {
      return bad_input(file, "has a 'space origin' field that makes no sense: correct its header");
    }
    placement.origin_mm =
        scale_mm * signs *
        glm::dvec3((*origin)[0], (*origin)[1], origin->size() > 2 ? (*origin)[2] : 0.0);
  }
  complete_slice(placement);
  turn_ultrasound(header.key("UltrasoundImageOrientation"), int(count), placement, raster);
  return make_grid(file, placement);
}

/// Axes of one sample beside space are dropped; one longer axis may stay.
Status place_lanes(const std::vector<NrrdAxis>& axes, Raster& raster) {
  double inner = 1.0;
  const NrrdAxis* lane_axis = nullptr;
  for (const NrrdAxis& axis : axes) {
    if (axis.role == NrrdRole::kSpace) {
      inner *= axis.size;
      continue;
    }
    if (axis.size == 1.0) continue;
    if (axis.size > kMaxLanes) {
      return bad_input(raster.file, "claims {} frames: the header is damaged, save the file again",
                       axis.size);
    }
    if (lane_axis != nullptr) {
      return bad_input(raster.file,
                       "has two axes beside space, but palpate reads frames or vector components, "
                       "not both: export "
                       "one of them");
    }
    lane_axis = &axis;
    raster.lanes = size_t(axis.size);
    raster.inner = size_t(inner);
    raster.lane_kind = axis.role == NrrdRole::kFrames ? LaneKind::kFrames : LaneKind::kComponents;
  }
  if (lane_axis == nullptr) raster.inner = raster.grid.count();
  return Nothing{};
}

/// Vectors are measured along the axes of the measurement frame, whose columns lie in the file's
/// space. Without one they are taken as ITK takes them, along L, P, S.
Status turn_vectors(const NrrdFields& header, Raster& raster) {
  if (raster.component_count() != 3) return Nothing{};
  const glm::dvec3 signs = lps_signs(header.field("space"));
  const auto text = header.field("measurementframe");
  const auto columns = parse_nrrd_vectors(text);
  const bool is_frame =
      columns && columns->size() == 3 &&
      std::all_of(columns->begin(), columns->end(), [](const auto& c) { return c.size() == 3; });
  if (is_frame) {
    for (int c = 0; c < 3; ++c) {
      const std::vector<double>& column = (*columns)[size_t(c)];
      raster.lps_from_vector[c] = signs * glm::dvec3(column[0], column[1], column[2]);
    }
    if (std::abs(glm::determinant(raster.lps_from_vector)) > 0.0) return Nothing{};
  }
  if (!text.empty() && lowered(text) != "none")
    return bad_input(raster.file,
                     "has a 'measurement frame' field that makes no sense: correct its header");
  if (signs != glm::dvec3(1.0)) {
    raster.notes.push_back(fmt::format(
        "'{}' lies in another space than LPS and has no measurement frame: its vectors are taken "
        "along L, P, S, as ITK takes them.",
        raster.file.string()));
  }
  return Nothing{};
}

/// The index values of a Slicer sequence, whatever number it gives the list axis (5D writers call
/// axis 4 "axis 3").
std::optional<std::vector<double>> index_values(const NrrdFields& header, std::string& unit) {
  for (const auto& [key, value] : header.keys) {
    if (!key.starts_with("axis ") || !key.ends_with(" index values")) continue;
    const std::string_view own_unit = header.key(key.substr(0, key.size() - 6) + "unit");
    if (!own_unit.empty()) unit = own_unit;
    return to_numbers(value);
  }
  if (const auto labels = header.key("MultiVolume.FrameLabels"); !labels.empty()) {
    unit = header.key("MultiVolume.FrameIdentifyingDICOMTagUnits");
    std::vector<double> values;
    for (const std::string_view cell : cells(labels, ',')) {
      const auto number = to_number(cell);
      if (!number) return std::nullopt;
      values.push_back(*number);
    }
    return values;
  }
  return std::nullopt;
}

Status find_times(const NrrdFields& header, const std::vector<NrrdAxis>& axes, Raster& raster) {
  const auto axis = std::find_if(axes.begin(), axes.end(), [](const NrrdAxis& a) {
    return a.role == NrrdRole::kFrames && a.size > 1.0;
  });
  if (axis == axes.end()) return Nothing{};
  std::string unit = axis->unit;
  auto times = index_values(header, unit);
  if (times && times->size() != raster.frame_count()) {
    return bad_input(raster.file, "has {} frames but {} index values: correct its header",
                     raster.frame_count(), times->size());
  }
  const double step = axis->direction.size() == 4 ? axis->direction[3] : axis->spacing;
  if (!times && step > 0.0) {
    times = counted_times(raster.frame_count());
    for (double& t : *times) t = axis->first + t * step;
  }
  // Without a unit 0, 1, 2, ... is a count and anything else is seconds; with a unit like "%" it is
  // no time at all.
  if (!times || (unit.empty() && *times == counted_times(times->size()))) return Nothing{};
  const auto seconds = unit.empty() ? std::optional<double>(1.0) : seconds_per(unit);
  if (!seconds) return Nothing{};
  for (double& t : *times) t *= *seconds;
  if (const Status rising = check_rising(raster.file, *times); !rising) return rising;
  raster.times_s = std::move(*times);
  raster.times_known = true;
  return Nothing{};
}

/// "slice%03d.raw 1 40 1" -> slice001.raw ... slice040.raw. Only %d with a width is understood, and
/// the pattern is not given to printf, since it may come from anybody.
std::optional<std::vector<std::string>> expand_pattern(std::string_view text) {
  constexpr int64_t kMaxFiles = 100000;
  constexpr int64_t kMaxWidth = 20;
  const auto parts = words(text);
  if (parts.size() < 4 || parts.size() > 5) return std::nullopt;
  const auto first = to_integer(parts[1]), last = to_integer(parts[2]), step = to_integer(parts[3]);
  const std::string_view pattern = parts[0];
  const size_t percent = pattern.find('%');
  const size_t letter = pattern.find('d', percent);
  if (!first || !last || !step || *step == 0 || letter == std::string_view::npos)
    return std::nullopt;
  if (std::abs(double(*first)) > 1e9 || std::abs(double(*last)) > 1e9 ||
      std::abs(double(*step)) > 1e9)
    return std::nullopt;
  const std::string_view digits = pattern.substr(percent + 1, letter - percent - 1);
  const int64_t width = digits.empty() ? 0 : to_integer(digits).value_or(-1);
  if (width < 0 || width > kMaxWidth || (*last - *first) / *step < 0 ||
      (*last - *first) / *step > kMaxFiles) {
    return std::nullopt;
  }
  std::vector<std::string> names;
  const char fill = digits.starts_with('0') ? '0' : ' ';
  for (int64_t n = *first; *step > 0 ? n <= *last : n >= *last; n += *step) {
    std::string number = std::to_string(n);
    if (number.size() < size_t(width)) number.insert(0, size_t(width) - number.size(), fill);
    names.push_back(std::string(pattern.substr(0, percent)) + number +
                    std::string(pattern.substr(letter + 1)));
  }
  return names;
}

Status find_data(const NrrdFields& header, Raster& raster) {
  const auto text = header.field("datafile");
  if (text.empty()) {
    raster.data = {raster.file};
    return Nothing{};
  }
  std::vector<std::string> names = header.data_files;
  if (text.substr(0, 4) != "LIST") {
    const auto expanded =
        text.find('%') == std::string_view::npos ? std::nullopt : expand_pattern(text);
    names = expanded ? *expanded : std::vector<std::string>{std::string(text)};
  }
  if (names.empty()) return bad_input(raster.file, "names no data files: correct its header");
  for (const std::string& name : names) raster.data.push_back(raster.file.parent_path() / name);
  return Nothing{};
}

Status find_encoding(const NrrdFields& header, Raster& raster) {
  const std::string encoding = lowered(header.field("encoding"));
  if (encoding == "raw") {
    raster.encoding = Encoding::kRaw;
  } else if (encoding == "gzip" || encoding == "gz") {
    raster.encoding = Encoding::kDeflate;
  } else if (encoding == "hex") {
    raster.encoding = Encoding::kHex;
  } else if (encoding == "text" || encoding == "txt" || encoding == "ascii") {
    raster.encoding = Encoding::kText;
  } else {
    return bad_input(raster.file,
                     "has the encoding '{}', which palpate does not read: save it as raw or gzip",
                     encoding);
  }
  const std::string endian = lowered(header.field("endian"));
  raster.big_endian = endian == "big";
  if (bytes_of(raster.type) > 1 && raster.encoding != Encoding::kText && endian != "little" &&
      endian != "big") {
    return bad_input(
        raster.file,
        "does not say its byte order: add 'endian: little' or 'endian: big' to its header");
  }
  const auto lines = header.field("lineskip"), bytes = header.field("byteskip");
  const auto line_skip = lines.empty() ? 0 : to_integer(lines).value_or(-1);
  const auto byte_skip = bytes.empty() ? 0 : to_integer(bytes).value_or(-2);
  if (line_skip < 0 || byte_skip < -1 || (byte_skip == -1 && raster.encoding != Encoding::kRaw)) {
    return bad_input(raster.file,
                     "has a line skip or byte skip that makes no sense: correct its header");
  }
  raster.line_skip = uint64_t(line_skip);
  raster.samples_at_end = byte_skip == -1;
  // The format counts skipped bytes after decompression, and for every data file.
  if (byte_skip > 0)
    (header.data_files.size() > 1 ? raster.file_skip : raster.stream_skip) = uint64_t(byte_skip);
  return Nothing{};
}

}  // namespace

Result<Raster> nrrd_raster(const std::filesystem::path& file, const NrrdFields& header,
                           const std::vector<NrrdAxis>& axes, size_t header_bytes) {
  Raster raster;
  raster.file = file;
  const std::string type = lowered(header.field("type"));
  const auto known = sample_type(type);
  if (!known)
    return bad_input(
        file, "has samples of type '{}', which palpate does not read: save it as short or float",
        type);
  raster.type = *known;
  auto grid = grid_of(header, axes, raster);
  if (!grid) return grid.error();
  raster.grid = *grid;
  if (const Status done = place_lanes(axes, raster); !done) return done.error();
  if (const Status done = turn_vectors(header, raster); !done) return done.error();
  if (const Status done = find_times(header, axes, raster); !done) return done.error();
  const FrameFields tracked = frame_fields(header.keys);
  if (const Status done = apply_frame_fields(tracked, raster); !done) return done.error();
  if (const Status done = find_encoding(header, raster); !done) return done.error();
  if (const Status done = find_data(header, raster); !done) return done.error();
  if (header.field("datafile").empty()) raster.file_skip += header_bytes;
  raster.keys = header.keys;
  return raster;
}

Result<Raster> parse_nrrd_header(const std::filesystem::path& file, std::string_view text) {
  const auto header = split_nrrd_header(file, text);
  if (!header) return header.error();
  if (!header->key(kSequenceMotionKey).empty())
    return bad_input(file,
                     "is the motion of a whole sequence, not an image: name it with `fields`, or "
                     "for 'palpate check' or 'palpate info'");
  const auto axes = nrrd_axes(file, *header);
  if (!axes) return axes.error();
  return nrrd_raster(file, *header, *axes, text.size());
}

}  // namespace palpate::files
