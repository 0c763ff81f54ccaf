#include "integration/files/scene/scene_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "integration/files/scene/json_object.h"
#include "integration/files/scene/option_ranges.h"
#include "integration/files/scene/scene_parts.h"
#include "integration/files/sentences.h"
#include "module/scene/drive.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr uintmax_t kMostSceneBytes = 16 << 20;  // a scene is some kilobytes; more is another file

constexpr NumberRange kSceneFrameRates{0.0, kFrameRates.high};  // 0: as the files say
constexpr NumberRange kPlayingRates{-1000.0, 1000.0};           // times as fast as recorded
constexpr NumberRange kDriveRates_hz{-100.0, 100.0};
constexpr NumberRange kCycles_s{0.0, 1e6};  // 0: as the files or the frames per second say

const std::vector<std::string_view> kKinds = {"surface",   "follow",         "front",
                                              "vortex",    "gradient-force", "vector-force",
                                              "attractor", "tissue",         "viscosity"};
const std::vector<std::string_view> kSources = {"heart",       "heart-exact", "shell",
                                                "shell-exact", "molecule",    "charges"};

class JsonSceneReader {
 public:
  JsonSceneReader(const std::vector<std::string>& more_kinds, JsonReading& reading)
      : more_kinds_(more_kinds), reading_(reading) {}

  SceneSpec read(const json& root) {
    JsonObject o(root, "", reading_);
    o.number("stiffness_n_per_m", scene_.stiffness_n_per_m, kStiffnesses_n_per_m);
    o.number("damping_n_s_per_m", scene_.damping_n_s_per_m, kDampings_n_s_per_m);
    o.number("max_force_n", scene_.max_force_n, kForces_n);
    o.number("tool_radius_m", scene_.tool_radius_m, kToolRadii_m);
    if (double points = 1.0; o.number("tool_points", points, kToolPoints)) {
      if (points != std::floor(points)) o.refuse("tool_points", "a whole number is expected");
      scene_.tool_points = int(points);
    }
    read_transform(o, "world_from_device", scene_.world_from_device);
    if (const json* session = o.find("session")) {
      if (!session->is_object())
        o.refuse("session", "the options of the session are expected: {\"watchdog_s\": 0.01}");
      scene_.session = session->dump();
    }
    const json* volumes = o.list("volumes");
    if (!volumes && o.good())
      o.refuse("volumes", "there is nothing to feel: give a list of volumes");
    for (size_t k = 0; volumes && k < volumes->size() && o.good(); ++k)
      volume((*volumes)[k], fmt::format("volumes[{}]", k));
    // Segments are felt without modes, and a scene may be looked at only.
    if (const json* modes = o.list("modes"))
      for (size_t k = 0; k < modes->size() && o.good(); ++k)
        mode((*modes)[k], fmt::format("modes[{}]", k));
    o.finish();
    return std::move(scene_);
  }

 private:
  void volume(const json& value, const std::string& place) {
    JsonObject o(value, place, reading_);
    VolumeSpec v;
    if (!o.text("name", v.name) && o.good())
      o.refuse("name", "it is missing: give the volume a name, modes call it by it");
    for (const VolumeSpec& other : scene_.volumes)
      if (other.name == v.name)
        o.refuse("name",
                 fmt::format("another volume is called \"{}\" too: choose another name", v.name));
    source(o, v);
    read_transform(o, "transform", v.transform);
    o.boolean("centred", v.centred);
    glm::dvec3 box;
    if (o.vector("box_m", box, kEdges_m)) v.box_m = box;
    if (v.box_m && o.find("centred"))
      o.refuse("centred", "the box says where the data are: leave this out");
    if (v.box_m && !v.source.empty() && v.source != "charges")
      o.refuse("box_m", "synthetic data have their own size: leave this out");
    drive(o, v.drive);
    if (const Status fine = check(v.drive, v.transform); !fine && o.good()) {
      std::string what = fine.error().message;
      what.pop_back();
      o.refuse("drive", what);
    }
    v.path = usual_path(v.drive.kind);
    o.choice("path", v.path, SceneWords::kPaths);
    o.choice("back_tracking", v.back_tracking, SceneWords::kBackTrackings);
    o.number("frames_per_second", v.frames_per_second, kSceneFrameRates);
    o.number("cycle_s", v.cycle_s, kCycles_s);
    if (v.cycle_s > 0.0 && v.frames_per_second > 0.0)
      o.refuse("cycle_s", "frames_per_second says it already: leave out one of the two");
    o.number("rate", v.rate, kPlayingRates);
    o.boolean("cyclic", v.cyclic);
    CarriedValues values{};
    if (o.choice("values", values, SceneWords::kValues)) {
      v.values = values;
      if (!v.source.empty()) o.refuse("values", "synthetic data have their own: leave this out");
    }
    o.boolean("blend_values", v.blend_values);
    read_appearance(o, "view", v.appearance);
    read_segments(o, "segments", v.segments);
    if (!v.source.empty() && v.segments.any())
      o.refuse("segments", "synthetic data have none: leave this out");
    o.finish();
    scene_.volumes.push_back(std::move(v));
  }

  void source(JsonObject& o, VolumeSpec& v) {
    std::string word;
    if (o.text("source", word)) {
      if (std::find(kSources.begin(), kSources.end(), word) == kSources.end())
        o.refuse_word("source", word, kSources);
      v.source = word;
    }
    v.files = read_paths(o, "files");
    if (const json* charges = o.list("charges")) {
      if (v.source != "charges")
        o.refuse("charges", "only the source \"charges\" has some: leave this out");
      for (size_t k = 0; k < charges->size() && o.good(); ++k)
        v.charges.push_back(charge((*charges)[k], fmt::format("{}[{}]", o.place("charges"), k)));
    } else if (v.source == "charges" && o.good()) {
      o.refuse("charges",
               "it is missing: give a list of charges, each with position_m, "
               "strength_v_m and softness_m");
    }
    if (o.good() && v.source.empty() == v.files.empty())
      o.refuse("files", v.files.empty()
                            ? "the volume has no data: give \"files\" or a \"source\""
                            : "the volume has a source already: give only one of the two");
    read_raw(o, "raw", v.raw);
    if (v.raw && v.files.size() != 1)
      o.refuse("raw", "it says what is in one file without a header: name just one file");
    if (double nan_as = 0.0; o.number("nan_as", nan_as)) v.nan_as = nan_as;
    if (v.nan_as && v.files.empty())
      o.refuse("nan_as", "only files hold what is no number: leave this out");
    const json* motions = o.list("motions");
    if (!motions || !o.good()) return;
    if (v.raw)
      return o.refuse("motions",
                      "a file without a header is one volume, which stands still: leave "
                      "this out");
    if (!v.source.empty())
      return o.refuse("motions", "synthetic data bring their own: leave this out");
    for (size_t k = 0; k < motions->size() && o.good(); ++k)
      motion((*motions)[k], fmt::format("{}[{}]", o.place("motions"), k), v);
  }

  PointCharge charge(const json& value, const std::string& place) {
    JsonObject o(value, place, reading_);
    PointCharge c;
    o.vector("position_m", c.position_m);
    if (!o.number("strength_v_m", c.strength_v_m) && o.good())
      o.refuse("strength_v_m", "it is missing: give the potential times the distance, in V m");
    o.number("softness_m", c.softness_m, kSoftnesses_m);
    o.finish();
    return c;
  }

  void motion(const json& value, const std::string& place, VolumeSpec& v) {
    JsonObject o(value, place, reading_);
    MotionSpec m;
    o.text("name", m.name);
    m.fields = read_paths(o, "fields");
    if (m.fields.empty() && o.good())
      o.refuse("fields", "it is missing: name the fields, one per step, or their folder");
    m.confidences = read_paths(o, "confidences");
    if (o.good() && !m.confidences.empty() && m.confidences.size() != m.fields.size())
      o.refuse("confidences", fmt::format("there are {} for {} fields: give one for each, or none",
                                          m.confidences.size(), m.fields.size()));
    for (const MotionSpec& other : v.motions)
      if (other.name == m.name)
        o.refuse("name", fmt::format("another motion of this volume is called \"{}\" too: choose "
                                     "another name",
                                     m.name));
    o.finish();
    v.motions.push_back(std::move(m));
  }

  void drive(JsonObject& parent, DriveSpec& d) {
    const json* value = parent.find("drive");
    if (!value) return;
    JsonObject o(*value, parent.place("drive"), reading_);
    o.choice("kind", d.kind, SceneWords::kDrives);
    read_direction(o, "axis", d.axis);
    o.vector("centre_m", d.centre_m);
    o.number("rate_hz", d.rate_hz, kDriveRates_hz);
    o.number("amplitude_m", d.amplitude_m, kRanges_m);
    read_keyed_poses(o, "poses", d.poses);
    const bool keys = d.kind == DriveSpec::Kind::kKeys;
    if (keys != !d.poses.empty() && o.good())
      o.refuse(keys ? "poses" : "kind",
               keys ? "it is missing: give a list of transforms with keys"
                    : "poses belong to the kind \"keys\": name it, or leave the poses out");
    o.finish();
  }

  void mode(const json& value, const std::string& place) {
    JsonObject o(value, place, reading_);
    ModeSpec m;
    o.text("kind", m.kind);
    const bool own = std::find(more_kinds_.begin(), more_kinds_.end(), m.kind) != more_kinds_.end();
    if (!own && std::find(kKinds.begin(), kKinds.end(), m.kind) == kKinds.end()) {
      std::vector<std::string_view> known = kKinds;
      known.insert(known.end(), more_kinds_.begin(), more_kinds_.end());
      o.refuse_word("kind", m.kind, known);
    }
    m.name = m.kind;
    o.text("name", m.name);
    for (const ModeSpec& other : scene_.modes)
      if (other.name == m.name)
        o.refuse(
            "name",
            fmt::format("another mode is called \"{}\" too: give each a name of its own", m.name));
    belongs_to(o, m);
    segment(o, m);
    o.choice("scalar", m.scalar, SceneWords::kScalars);
    o.choice("vector", m.vector, SceneWords::kVectors);
    read_transfer(o, "strength", m.strength, kStrengths_n);
    read_transfer(o, "friction", m.friction, kFrictions);
    const bool force = m.kind == "gradient-force" || m.kind == "vector-force";
    if (o.good() && !own && !force && !(m.strength.highest() > 0.0))
      o.refuse("strength", "nothing would be felt: give a strength in N that is above 0 somewhere");
    o.number("gain", m.gain);
    o.boolean("two_sided", m.two_sided);
    o.boolean("leaving", m.leaving);
    o.vector("point_m", m.point_m);
    o.number("range_m", m.range_m, kRanges_m);
    o.boolean("on", m.on);
    o.finish();
    if (value.is_object())
      for (const auto& [key, ignored] : value.items())
        if (!mode_key_applies(m.kind, key))
          o.refuse(key, fmt::format("a mode of kind {} has no use for it: leave it out", m.kind));
    scene_.modes.push_back(std::move(m));
  }

  void belongs_to(JsonObject& o, ModeSpec& m) {
    const bool named = o.text("volume", m.volume);
    if (!named && scene_.volumes.size() == 1) m.volume = scene_.volumes[0].name;
    const auto volume = std::find_if(scene_.volumes.begin(), scene_.volumes.end(),
                                     [&](const VolumeSpec& v) { return v.name == m.volume; });
    std::vector<std::string_view> known;
    for (const VolumeSpec& v : scene_.volumes) known.push_back(v.name);
    if (o.good() && !named && m.volume.empty())
      o.refuse("volume", fmt::format("it is missing: name one of {}", fmt::join(known, ", ")));
    else if (o.good() && volume == scene_.volumes.end())
      o.refuse_word("volume", m.volume, known);
    if (!o.text("motion", m.motion) || !o.good()) return;
    known.clear();
    for (const MotionSpec& motion : volume->motions) known.push_back(motion.name);
    if (volume->source.starts_with("heart") || volume->source.starts_with("shell"))
      known.push_back("data");
    if (known.empty())
      o.refuse("motion", fmt::format("the volume \"{}\" has none: leave it out", m.volume));
    else if (std::find(known.begin(), known.end(), m.motion) == known.end())
      o.refuse_word("motion", m.motion, known);
  }

  /// Names of segments are known here only where the scene lists them.
  void segment(JsonObject& o, ModeSpec& m) {
    if (!o.text("segment", m.segment) || !o.good()) return;
    std::vector<std::string_view> known;
    for (const VolumeSpec& volume : scene_.volumes) {
      if (volume.name != m.volume) continue;
      if (!volume.segments.any())
        return o.refuse("segment",
                        fmt::format("the volume \"{}\" has no segments: leave it out", m.volume));
      for (const SegmentSpec& part : volume.segments.parts) known.push_back(part.name);
    }
    if (!known.empty() && std::find(known.begin(), known.end(), m.segment) == known.end())
      o.refuse_word("segment", m.segment, known);
  }

  const std::vector<std::string>& more_kinds_;
  JsonReading& reading_;
  SceneSpec scene_;
};

/// The first of the scene's files that is not there.
Status check_files(const SceneSpec& scene, JsonReading& reading) {
  std::error_code error;
  const fs::path folder = reading.folder.empty() ? fs::current_path(error) : reading.folder;
  const auto look = [&](const std::vector<fs::path>& paths, const std::string& place) {
    for (size_t k = 0; k < paths.size(); ++k)
      if (!fs::exists(paths[k], error))
        reading.refuse(fmt::format("{}[{}]", place, k),
                       fmt::format("there is no '{}': paths are relative to '{}'",
                                   paths[k].string(), folder.string()));
  };
  for (size_t v = 0; v < scene.volumes.size(); ++v) {
    look(scene.volumes[v].files, fmt::format("volumes[{}].files", v));
    look(scene.volumes[v].segments.files, fmt::format("volumes[{}].segments.files", v));
    for (size_t m = 0; m < scene.volumes[v].motions.size(); ++m) {
      const std::string place = fmt::format("volumes[{}].motions[{}]", v, m);
      look(scene.volumes[v].motions[m].fields, place + ".fields");
      look(scene.volumes[v].motions[m].confidences, place + ".confidences");
    }
  }
  if (reading.error) return *reading.error;
  return Nothing{};
}

}  // namespace

const std::vector<std::pair<std::string_view, ScalarProperty>> SceneWords::kScalars = {
    {"value", ScalarProperty::kValue},
    {"gradient-magnitude", ScalarProperty::kGradientMagnitude},
    {"magnitude", ScalarProperty::kMagnitude},
    {"divergence", ScalarProperty::kDivergence},
    {"curl-magnitude", ScalarProperty::kCurlMagnitude}};
const std::vector<std::pair<std::string_view, VectorProperty>> SceneWords::kVectors = {
    {"vector", VectorProperty::kVector},
    {"gradient", VectorProperty::kGradient},
    {"curl", VectorProperty::kCurl}};
const std::vector<std::pair<std::string_view, DriveSpec::Kind>> SceneWords::kDrives = {
    {"still", DriveSpec::Kind::kStill},
    {"turn", DriveSpec::Kind::kTurn},
    {"swing", DriveSpec::Kind::kSwing},
    {"second-hand", DriveSpec::Kind::kSecondHand},
    {"keys", DriveSpec::Kind::kKeys}};
const std::vector<std::pair<std::string_view, PosePath>> SceneWords::kPaths = {
    {"smooth", PosePath::kSmooth}, {"paper", PosePath::kPaper}, {"exact", PosePath::kExact}};
const std::vector<std::pair<std::string_view, BackTracking>> SceneWords::kBackTrackings = {
    {"newton", BackTracking::kNewton}, {"picard", BackTracking::kPicard}};
const std::vector<std::pair<std::string_view, CarriedValues>> SceneWords::kValues = {
    {"reference", CarriedValues::kReference},
    {"mean", CarriedValues::kMean},
    {"own", CarriedValues::kOwn}};
const std::vector<std::pair<std::string_view, SampleType>> SceneWords::kSampleTypes = {
    {"int8", SampleType::kInt8},     {"uint8", SampleType::kUint8},
    {"int16", SampleType::kInt16},   {"uint16", SampleType::kUint16},
    {"int32", SampleType::kInt32},   {"uint32", SampleType::kUint32},
    {"int64", SampleType::kInt64},   {"uint64", SampleType::kUint64},
    {"float32", SampleType::kFloat}, {"float64", SampleType::kDouble}};
const std::vector<std::pair<std::string_view, SegmentsFrom>> SceneWords::kDerivedSegments = {
    {"region", SegmentsFrom::kRegion}, {"ridges", SegmentsFrom::kRidges}};

bool mode_key_applies(std::string_view kind, std::string_view key) {
  if (std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) return true;
  if (key == "friction" || key == "leaving") return kind == "surface";
  if (key == "two_sided") return kind == "surface" || kind == "front";
  if (key == "gain") return kind == "gradient-force" || kind == "vector-force" || kind == "tissue";
  if (key == "point_m" || key == "range_m") return kind == "attractor";
  return true;
}

Result<SceneSpec> parse_scene(const fs::path& file, std::string_view text,
                              const std::vector<std::string>& more_kinds,
                              std::set<std::string>* accepted, const fs::path& folder) {
  JsonReading reading{file, {}, accepted};
  if (!folder.empty()) reading.folder = folder;
  const auto root = parse_json(text, reading);
  if (!root) return *reading.error;
  SceneSpec scene = JsonSceneReader(more_kinds, reading).read(*root);
  if (reading.error) return *reading.error;
  return scene;
}

Result<SceneSpec> read_scene(const fs::path& file, const std::vector<std::string>& more_kinds,
                             const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return bad_input(file, "is not a file that can be read: name a scene file (JSON).");
  if (fs::file_size(file, error) > kMostSceneBytes)
    return bad_input(file, "is too large to be a scene: name a scene file (JSON).");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) return bad_input(file, "can not be read: check its permissions.");
  auto scene = parse_scene(file, text.str(), more_kinds, nullptr, folder);
  if (!scene) return scene;
  JsonReading reading{file, {}, nullptr};
  if (!folder.empty()) reading.folder = folder;
  if (const Status there = check_files(*scene, reading); !there) return there.error();
  return scene;
}

}  // namespace palpate::files
