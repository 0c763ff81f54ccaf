#include "integration/files/scene/scene_parts.h"

#include <fmt/format.h>

#include <cmath>

#include "integration/files/scene/option_ranges.h"
#include "integration/files/scene/scene_file.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr NumberRange kSeeds{1.0, 24.0};
constexpr NumberRange kColours{0.0, 1.0};
constexpr NumberRange kSegmentOpacity{0.0, 0.99};

void read_rotation(JsonObject& o, Transform& out) {
  const json* turn = o.find("rotation");
  const json* wxyz = o.find("quaternion_wxyz");
  if (turn && wxyz) o.refuse("rotation", "a quaternion says the rotation too: keep one of the two");
  if (turn) {
    JsonObject r(*turn, o.place("rotation"), o.reading());
    glm::dvec3 axis(0.0, 1.0, 0.0);
    double degrees = 0.0;
    read_direction(r, "axis", axis);
    r.number("degrees", degrees);
    r.finish();
    out.rotation = glm::angleAxis(glm::radians(degrees), glm::normalize(axis));
  }
  if (!wxyz) return;
  double q[4] = {1, 0, 0, 0};
  bool good = wxyz->is_array() && wxyz->size() == 4;
  for (size_t k = 0; good && k < 4; ++k) {
    good = (*wxyz)[k].is_number();
    if (good) q[k] = (*wxyz)[k].get<double>();
  }
  const glm::dquat rotation(q[0], q[1], q[2], q[3]);
  const double off = glm::dot(rotation, rotation) - 1.0;
  if (!good || !(std::abs(off) < 1e-3))
    return o.refuse("quaternion_wxyz",
                    "four numbers with a sum of squares of 1 are expected: write [w, x, y, z]");
  // Bits of a quaternion that is good already are kept, so that scenes come back from their
  // files.
  out.rotation = std::abs(off) < 1e-14 ? rotation : glm::normalize(rotation);
}

void read_matrix(JsonObject& o, const json& object, Transform& out) {
  const json* rows = o.find("matrix");
  if (!rows) return;
  if (object.size() > 1)
    return o.refuse("matrix", "it says all of the transform: leave out the other keys");
  glm::dmat4 m(1.0);
  bool good = rows->is_array() && rows->size() == 4;
  for (size_t r = 0; good && r < 4; ++r) {
    good = (*rows)[r].is_array() && (*rows)[r].size() == 4;
    for (size_t c = 0; good && c < 4; ++c) {
      good = (*rows)[r][c].is_number();
      if (good) m[int(c)][int(r)] = (*rows)[r][c].get<double>();
    }
  }
  if (!good)
    return o.refuse("matrix", "four rows of four numbers are expected: write [[...], ...]");
  const auto found = split(m);
  if (!found) {
    std::string what = found.error().message;
    if (what.ends_with('.')) what.pop_back();
    return o.refuse("matrix", what);
  }
  out = *found;
}

/// [value, [r, g, b], opacity]
std::optional<LookPoint> look_point(const json& value) {
  const bool good = value.is_array() && value.size() == 3 && value[0].is_number() &&
                    value[1].is_array() && value[1].size() == 3 && value[2].is_number();
  if (!good) return std::nullopt;
  LookPoint point;
  point.value = value[0].get<double>();
  point.opacity = value[2].get<double>();
  for (size_t c = 0; c < 3; ++c) {
    if (!value[1][c].is_number()) return std::nullopt;
    point.colour[int(c)] = value[1][c].get<double>();
  }
  return point;
}

void read_points(JsonObject& o, std::vector<LookPoint>& out) {
  const json* points = o.list("points");
  if (!points) return;
  for (size_t k = 0; k < points->size() && o.good(); ++k) {
    const auto point = look_point((*points)[k]);
    if (!point)
      return o.reading().refuse(fmt::format("{}[{}]", o.place("points"), k),
                                "a value, a colour and an opacity are expected: write [value, "
                                "[red, green, blue], opacity]");
    out.push_back(*point);
  }
  if (!o.good()) return;
  Look look;
  look.name = o.place("points");
  look.points = out;
  const Status fine = check(look);
  if (fine) return;
  std::string what = fine.error().message;
  if (what.ends_with('.')) what.pop_back();
  o.refuse("points", what + ": correct it");
}

Result<TransferFunction> of_pairs(JsonObject& o, const json& pairs, const NumberRange& range,
                                  bool stepped) {
  std::vector<double> in, outs;
  for (size_t k = 0; k < pairs.size(); ++k) {
    const json& pair = pairs[k];
    if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number() || !pair[1].is_number() ||
        !is_in(pair[1].get<double>(), range)) {
      o.reading().refuse(
          fmt::format("{}[{}]", o.place("pairs"), k),
          fmt::format("an input and an output, {}, are expected: write [in, out]", text_of(range)));
      return TransferFunction();
    }
    in.push_back(pair[0].get<double>());
    outs.push_back(pair[1].get<double>());
  }
  return stepped ? TransferFunction::stepped(std::move(in), std::move(outs))
                 : TransferFunction::linear(std::move(in), std::move(outs));
}

}  // namespace

/// World from volume: translation, rotation and scale, or one matrix.
void read_transform(JsonObject& parent, const char* key, Transform& out) {
  const json* value = parent.find(key);
  if (!value) return;
  JsonObject o(*value, parent.place(key), parent.reading());
  o.vector("translation_m", out.translation_m);
  read_rotation(o, out);
  if (value->is_object() && value->contains("scale") && (*value)["scale"].is_number()) {
    double scale = 1.0;
    if (o.number("scale", scale, kScales)) out.scale = glm::dvec3(scale);
  } else {
    o.vector("scale", out.scale, kScales);
  }
  read_matrix(o, *value, out);
  o.finish();
}

namespace {

void set_value(const double* numbers, glm::dvec3& out) {
  out = {numbers[0], numbers[1], numbers[2]};
}
void set_value(const double* numbers, glm::dquat& out) {
  out = glm::dquat(numbers[0], numbers[1], numbers[2], numbers[3]);
}

/// { "cycle_s", "loop", "keys": [[share, [...]], ...] } with N numbers in each value.
template <int N, class T>
void read_track(JsonObject& parent, const char* key, KeyTrack<T>& out) {
  const json* value = parent.find(key);
  if (!value) return;
  JsonObject o(*value, parent.place(key), parent.reading());
  o.number("cycle_s", out.cycle_s, kPositive);
  o.boolean("loop", out.loop);
  const json* keys = o.list("keys");
  if (!keys && o.good()) o.refuse("keys", "it is missing: give a list of [share, value]");
  for (size_t k = 0; keys && k < keys->size() && o.good(); ++k) {
    const json& one = (*keys)[k];
    bool good = one.is_array() && one.size() == 2 && one[0].is_number() && one[1].is_array() &&
                one[1].size() == size_t(N);
    double numbers[N] = {};
    for (size_t c = 0; good && c < size_t(N); ++c) {
      good = one[1][c].is_number();
      if (good) numbers[c] = one[1][c].get<double>();
    }
    if (!good)
      return o.reading().refuse(
          fmt::format("{}[{}]", o.place("keys"), k),
          fmt::format("a share of the cycle and {} numbers are expected: write [share, [...]]", N));
    out.keys.push_back(one[0].get<double>());
    out.values.emplace_back();
    set_value(numbers, out.values.back());
  }
  o.finish();
}

}  // namespace

void read_keyed_poses(JsonObject& parent, const char* key, std::vector<KeyedPose>& out) {
  const json* poses = parent.list(key);
  for (size_t k = 0; poses && k < poses->size() && parent.good(); ++k) {
    JsonObject o((*poses)[k], fmt::format("{}[{}]", parent.place(key), k), parent.reading());
    KeyedPose pose;
    read_transform(o, "pose", pose.pose);
    read_track<3>(o, "translation_m", pose.translation_m);
    read_track<4>(o, "quaternion_wxyz", pose.rotation);
    read_track<3>(o, "scale", pose.scale);
    o.finish();
    out.push_back(std::move(pose));
  }
}

void read_direction(JsonObject& o, const char* key, glm::dvec3& out) {
  glm::dvec3 found;
  if (!o.vector(key, found)) return;
  const double length = glm::length(found);
  if (!(length > 1e-100) || std::isinf(length))
    return o.refuse(key, "a direction is expected: give three numbers that are not all 0");
  out = found;
}

std::vector<fs::path> read_paths(JsonObject& o, const char* key) {
  std::vector<std::string> names;
  std::vector<fs::path> found;
  if (!o.texts(key, names)) return found;
  for (const std::string& name : names) {
    if (name.find('\0') != std::string::npos) {
      o.refuse(key, "a file name holds a zero byte: take it out");
      return found;
    }
    found.push_back((o.reading().folder / name).lexically_normal());
  }
  return found;
}

/// A number, { "pairs": ... } or { "window": ... }; no output outside of the range.
void read_transfer(JsonObject& parent, const char* key, TransferFunction& out,
                   const NumberRange& range) {
  const json* value = parent.find(key);
  if (!value) return;
  if (value->is_number()) {
    double constant = 0.0;
    if (parent.number(key, constant, range)) out = TransferFunction::constant(constant);
    return;
  }
  JsonObject o(*value, parent.place(key), parent.reading());
  Result<TransferFunction> made = TransferFunction();
  bool stepped = false;
  o.boolean("stepped", stepped);
  const json* window = o.find("window");
  const json* pairs = o.list("pairs");
  if (!window == !pairs && o.good())
    parent.refuse(key, "a number, \"pairs\" or a \"window\" is expected: give one of them");
  if (window) {
    JsonObject w(*window, o.place("window"), o.reading());
    double level = 0.0, width = 0.0, full = 1.0;
    if (!w.number("level", level) && w.good())
      w.refuse("level", "it is missing: give a value of the data");
    w.number("width", width, kNotNegative);
    w.number("full", full, range);
    w.finish();
    if (stepped) o.refuse("stepped", "a window has no steps: leave this out, or give pairs");
    if (o.good()) made = TransferFunction::window(level, width, full);
  }
  if (pairs) made = of_pairs(o, *pairs, range, stepped);
  o.finish();
  if (!made) {
    std::string what = made.error().message;
    if (what.ends_with('.')) what.pop_back();
    return parent.refuse(key, what);
  }
  out = *made;
}

namespace {

/// One part of a segmentation.
SegmentSpec segment_of(const json& value, const std::string& place, JsonReading& reading) {
  JsonObject o(value, place, reading);
  SegmentSpec part;
  if (!o.text("name", part.name) && o.good())
    o.refuse("name",
             "it is missing: give the segment the name it has in the file, or one of its "
             "own with \"labels\"");
  if (const json* labels = o.list("labels"))
    for (size_t k = 0; k < labels->size(); ++k) {
      const json& label = (*labels)[k];
      if (label.is_string())
        part.labels.push_back(label.get<std::string>());
      else if (label.is_number_integer())
        part.labels.push_back(std::to_string(label.get<int64_t>()));
      else
        reading.refuse(fmt::format("{}[{}]", o.place("labels"), k),
                       "a label is expected: give a whole number, or a segment's name");
    }
  glm::dvec3 colour;
  if (o.vector("colour", colour, kColours)) part.colour = colour;
  o.boolean("felt", part.felt);
  o.boolean("shown", part.shown);
  o.number("strength_n", part.strength_n, kForces_n);
  o.number("friction", part.friction, kFrictions);
  o.number("stiffness_n_per_m", part.stiffness_n_per_m, kStiffnesses_n_per_m);
  o.finish();
  return part;
}

}  // namespace

void read_raw(JsonObject& parent, const char* key, std::optional<RawSamples>& out) {
  const json* value = parent.find(key);
  if (!value) return;
  JsonObject o(*value, parent.place(key), parent.reading());
  RawSamples raw;
  glm::dvec3 size;
  if (!o.vector("size", size, kRawSizes) && o.good())
    o.refuse("size", "it is missing: say how many samples there are along i, j and k");
  if (o.good() && size != glm::floor(size)) o.refuse("size", "whole numbers are expected");
  if (o.good()) raw.size = glm::ivec3(size);
  if (!o.choice("type", raw.type, SceneWords::kSampleTypes) && o.good())
    o.refuse("type", "it is missing: say what a number is, as \"uint8\" or \"float32\"");
  double components = raw.components;
  if (o.number("components", components)) {
    if (components != 1.0 && components != 3.0)
      o.refuse("components", "1 is expected, or 3 for vectors");
    raw.components = components == 3.0 ? 3 : 1;
  }
  o.vector("spacing_m", raw.spacing_m, kPositive);
  o.finish();
  if (o.good()) out = raw;
}

void read_segments(JsonObject& parent, const char* key, SegmentsSpec& out) {
  const json* value = parent.find(key);
  if (!value) return;
  JsonObject o(*value, parent.place(key), parent.reading());
  if (o.choice("from", out.from, SceneWords::kDerivedSegments)) {
    if (o.find("files")) o.refuse("files", "they are derived from the values: leave this out");
    if (o.find("frame")) o.refuse("frame", "they are derived from one frame: leave this out");
    double number = 0.0;
    if (o.number("iso_value", number, kAnyNumber)) out.iso_value = number;
    if (o.number("smooth_mm", number, kSmoothings_mm)) out.smooth_mm = number;
  } else {
    out.files = read_paths(o, "files");
    if (out.files.empty() && o.good())
      o.refuse("files",
               "it is missing: name a segmentation, or one for each frame, or derive a wall "
               "\"from\" the "
               "values");
    o.boolean("one_body", out.one_body);
  }
  double frame = 0.0;
  if (o.number("frame", frame, kFrameNumbers)) {
    if (frame != std::floor(frame)) o.refuse("frame", "a whole number is expected");
    out.frame = size_t(frame);
  }
  const json* parts = o.list("parts");
  for (size_t k = 0; parts && k < parts->size() && o.good(); ++k) {
    const std::string place = fmt::format("{}[{}]", o.place("parts"), k);
    out.parts.push_back(segment_of((*parts)[k], place, o.reading()));
    for (size_t other = 0; other < k; ++other)
      if (out.parts[other].name == out.parts[k].name)
        o.reading().refuse(place + ".name",
                           fmt::format("another part is called \"{}\" too: choose another name",
                                       out.parts[k].name));
  }
  if (out.from != SegmentsFrom::kFiles) {
    if (out.parts.size() > 1) o.refuse("parts", "values have one wall: name one part");
    if (!out.parts.empty() && !out.parts.front().labels.empty())
      o.refuse("parts", "values have no labels: leave them out");
    if (out.parts.empty()) {
      out.parts.emplace_back();
      out.parts.back().name = "wall";
    }
  }
  o.finish();
}

void read_appearance(JsonObject& parent, const char* key, AppearanceSpec& out) {
  const json* value = parent.find(key);
  if (!value) return;
  JsonObject o(*value, parent.place(key), parent.reading());
  o.boolean("shown", out.shown);
  if (o.text("look", out.preset) && !preset_look(out.preset)) {
    const std::vector<std::string> names = preset_names();
    o.refuse_word("look", out.preset, {names.begin(), names.end()});
  }
  read_points(o, out.points);
  if (o.good() && !out.points.empty() && !out.preset.empty())
    o.refuse("points", "a look is named already: give only one of the two");
  if (o.boolean("points_of_range", out.points_of_range) && out.points_of_range &&
      out.points.empty())
    o.refuse("points_of_range", "there are no points: give them, or leave this out");
  if (const json* window = o.find("window")) {
    JsonObject w(*window, o.place("window"), o.reading());
    if (!w.number("level", out.window_level) && w.good())
      w.refuse("level", "it is missing: give a value of the data");
    if (!w.number("width", out.width, kPositive) && w.good())
      w.refuse("width", "it is missing: say how many values the colours go over");
    w.finish();
  }
  bool tubes = false;
  if (o.boolean("tubes", tubes)) out.tubes = tubes;
  double seeds = out.tubes_per_axis;
  if (o.number("tubes_per_axis", seeds, kSeeds)) {
    if (seeds != std::floor(seeds)) o.refuse("tubes_per_axis", "a whole number is expected");
    out.tubes_per_axis = int(seeds);
  }
  o.boolean("segments", out.segments);
  o.number("segment_opacity", out.segment_opacity, kSegmentOpacity);
  o.finish();
}

}  // namespace palpate::files
