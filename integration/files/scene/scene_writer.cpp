#include <algorithm>
#include <nlohmann/json.hpp>

#include "integration/files/atomic_file.h"
#include "integration/files/scene/json_object.h"
#include "integration/files/scene/scene_file.h"

namespace palpate::files {
namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;

template <class T>
std::string_view word_of(const std::vector<std::pair<std::string_view, T>>& words, T value) {
  for (const auto& [word, meaning] : words)
    if (meaning == value) return word;
  return words.front().first;
}

/// Only what differs from its default is written: a scene stays short, and says what is special.
template <class T>
void put(OrderedJson& object, const char* key, const T& value, const T& usual) {
  if (value != usual) object[key] = value;
}
void put(OrderedJson& object, const char* key, const glm::dvec3& value, const glm::dvec3& usual) {
  if (value != usual) object[key] = list_of(value);
}

class JsonSceneWriter {
 public:
  explicit JsonSceneWriter(const fs::path& file) : folder_(fs::absolute(file).parent_path()) {}

  OrderedJson scene(const SceneSpec& s) const {
    const SceneSpec usual;
    OrderedJson o = OrderedJson::object();
    put(o, "stiffness_n_per_m", s.stiffness_n_per_m, usual.stiffness_n_per_m);
    put(o, "damping_n_s_per_m", s.damping_n_s_per_m, usual.damping_n_s_per_m);
    put(o, "max_force_n", s.max_force_n, usual.max_force_n);
    put(o, "tool_radius_m", s.tool_radius_m, usual.tool_radius_m);
    put(o, "tool_points", s.tool_points, usual.tool_points);
    transform(o, "world_from_device", s.world_from_device);
    if (!s.session.empty()) o["session"] = OrderedJson::parse(s.session);
    for (const VolumeSpec& v : s.volumes) o["volumes"].push_back(volume(v));
    for (const ModeSpec& m : s.modes) o["modes"].push_back(mode(m));
    return o;
  }

 private:
  void transform(OrderedJson& parent, const char* key, const Transform& t) const {
    const Transform usual;
    OrderedJson o = OrderedJson::object();
    put(o, "translation_m", t.translation_m, usual.translation_m);
    if (t.rotation != usual.rotation)
      o["quaternion_wxyz"] = {t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z};
    put(o, "scale", t.scale, usual.scale);
    if (!o.empty()) parent[key] = o;
  }

  OrderedJson paths(const std::vector<fs::path>& files) const {
    OrderedJson names = OrderedJson::array();
    for (const fs::path& file : files)
      names.push_back(fs::absolute(file).lexically_normal().lexically_proximate(folder_).string());
    return names;
  }

  template <class T>
  void track(OrderedJson& object, const char* key, const KeyTrack<T>& of) const {
    if (of.keys.empty()) return;
    OrderedJson o = {{"cycle_s", of.cycle_s}};
    put(o, "loop", of.loop, true);
    for (size_t k = 0; k < of.keys.size(); ++k)
      o["keys"].push_back(OrderedJson::array({of.keys[k], list_of(of.values[k])}));
    object[key] = o;
  }

  OrderedJson keyed(const KeyedPose& pose) const {
    OrderedJson o = OrderedJson::object();
    transform(o, "pose", pose.pose);
    track(o, "translation_m", pose.translation_m);
    track(o, "quaternion_wxyz", pose.rotation);
    track(o, "scale", pose.scale);
    return o;
  }

  OrderedJson volume(const VolumeSpec& v) const {
    const VolumeSpec usual;
    OrderedJson o = {{"name", v.name}};
    put(o, "source", v.source, usual.source);
    for (const PointCharge& c : v.charges)
      o["charges"].push_back({{"position_m", list_of(c.position_m)},
                              {"strength_v_m", c.strength_v_m},
                              {"softness_m", c.softness_m}});
    if (!v.files.empty()) o["files"] = paths(v.files);
    if (v.raw) o["raw"] = raw(*v.raw);
    if (v.nan_as) o["nan_as"] = *v.nan_as;
    for (const MotionSpec& m : v.motions) {
      OrderedJson motion = {{"name", m.name}, {"fields", paths(m.fields)}};
      if (!m.confidences.empty()) motion["confidences"] = paths(m.confidences);
      o["motions"].push_back(motion);
    }
    transform(o, "transform", v.transform);
    if (v.box_m)
      o["box_m"] = list_of(*v.box_m);
    else
      put(o, "centred", v.centred, usual.centred);
    OrderedJson drive = OrderedJson::object();
    if (v.drive.kind != usual.drive.kind)
      drive["kind"] = word_of(SceneWords::kDrives, v.drive.kind);
    put(drive, "axis", v.drive.axis, usual.drive.axis);
    put(drive, "centre_m", v.drive.centre_m, usual.drive.centre_m);
    put(drive, "rate_hz", v.drive.rate_hz, usual.drive.rate_hz);
    put(drive, "amplitude_m", v.drive.amplitude_m, usual.drive.amplitude_m);
    for (const KeyedPose& pose : v.drive.poses) drive["poses"].push_back(keyed(pose));
    if (!drive.empty()) o["drive"] = drive;
    if (v.path != usual_path(v.drive.kind)) o["path"] = word_of(SceneWords::kPaths, v.path);
    if (v.back_tracking != usual.back_tracking)
      o["back_tracking"] = word_of(SceneWords::kBackTrackings, v.back_tracking);
    put(o, "frames_per_second", v.frames_per_second, usual.frames_per_second);
    put(o, "cycle_s", v.cycle_s, usual.cycle_s);
    put(o, "rate", v.rate, usual.rate);
    put(o, "cyclic", v.cyclic, usual.cyclic);
    if (v.values) o["values"] = word_of(SceneWords::kValues, *v.values);
    put(o, "blend_values", v.blend_values, usual.blend_values);
    const OrderedJson view = appearance(v.appearance);
    if (!view.empty()) o["view"] = view;
    if (v.segments.any()) o["segments"] = segments(v.segments);
    return o;
  }

  static OrderedJson raw(const RawSamples& r) {
    const RawSamples usual;
    OrderedJson o = {{"size", {r.size.x, r.size.y, r.size.z}},
                     {"type", word_of(SceneWords::kSampleTypes, r.type)}};
    put(o, "components", r.components, usual.components);
    put(o, "spacing_m", r.spacing_m, usual.spacing_m);
    return o;
  }

  OrderedJson segments(const SegmentsSpec& s) const {
    const SegmentSpec usual;
    OrderedJson o = OrderedJson::object();
    if (s.from == SegmentsFrom::kFiles)
      o["files"] = paths(s.files);
    else
      o["from"] = word_of(SceneWords::kDerivedSegments, s.from);
    if (s.iso_value) o["iso_value"] = *s.iso_value;
    if (s.smooth_mm) o["smooth_mm"] = *s.smooth_mm;
    put(o, "frame", s.frame, size_t(0));
    put(o, "one_body", s.one_body, true);
    for (const SegmentSpec& of : s.parts) {
      OrderedJson part = {{"name", of.name}};
      put(part, "labels", of.labels, usual.labels);
      if (of.colour) part["colour"] = list_of(*of.colour);
      put(part, "felt", of.felt, usual.felt);
      put(part, "shown", of.shown, usual.shown);
      put(part, "strength_n", of.strength_n, usual.strength_n);
      put(part, "friction", of.friction, usual.friction);
      put(part, "stiffness_n_per_m", of.stiffness_n_per_m, usual.stiffness_n_per_m);
      o["parts"].push_back(part);
    }
    return o;
  }

  OrderedJson appearance(const AppearanceSpec& s) const {
    const AppearanceSpec usual;
    OrderedJson o = OrderedJson::object();
    put(o, "shown", s.shown, usual.shown);
    put(o, "look", s.preset, usual.preset);
    for (const LookPoint& p : s.points)
      o["points"].push_back(OrderedJson::array({p.value, list_of(p.colour), p.opacity}));
    put(o, "points_of_range", s.points_of_range, usual.points_of_range);
    if (s.width > 0.0) o["window"] = {{"level", s.window_level}, {"width", s.width}};
    if (s.tubes) o["tubes"] = *s.tubes;
    put(o, "tubes_per_axis", s.tubes_per_axis, usual.tubes_per_axis);
    put(o, "segments", s.segments, usual.segments);
    put(o, "segment_opacity", s.segment_opacity, usual.segment_opacity);
    return o;
  }

  void transfer(OrderedJson& parent, const char* key, const TransferFunction& f) const {
    if (f.in().empty()) return;
    if (f.in().size() == 1 && f.in()[0] == 0.0 && !f.is_stepped()) {
      parent[key] = f.out()[0];
      return;
    }
    OrderedJson pairs = OrderedJson::array();
    for (size_t k = 0; k < f.in().size(); ++k) pairs.push_back({f.in()[k], f.out()[k]});
    parent[key]["pairs"] = pairs;
    if (f.is_stepped()) parent[key]["stepped"] = true;
  }

  OrderedJson mode(const ModeSpec& m) const {
    const ModeSpec usual;
    OrderedJson o = {{"name", m.name}, {"kind", m.kind}, {"volume", m.volume}};
    put(o, "motion", m.motion, usual.motion);
    put(o, "segment", m.segment, usual.segment);
    if (m.scalar != usual.scalar) o["scalar"] = word_of(SceneWords::kScalars, m.scalar);
    if (m.vector != usual.vector) o["vector"] = word_of(SceneWords::kVectors, m.vector);
    transfer(o, "strength", m.strength);
    const auto applies = [&](const char* key) { return mode_key_applies(m.kind, key); };
    if (applies("friction")) transfer(o, "friction", m.friction);
    if (applies("gain")) put(o, "gain", m.gain, usual.gain);
    if (applies("two_sided")) put(o, "two_sided", m.two_sided, usual.two_sided);
    if (applies("leaving")) put(o, "leaving", m.leaving, usual.leaving);
    if (applies("point_m")) put(o, "point_m", m.point_m, usual.point_m);
    if (applies("range_m")) put(o, "range_m", m.range_m, usual.range_m);
    put(o, "on", m.on, usual.on);
    return o;
  }

  fs::path folder_;
};

}  // namespace

std::string scene_text(const SceneSpec& scene, const fs::path& file) {
  const OrderedJson json = JsonSceneWriter(file).scene(scene);
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

Status write_scene(const SceneSpec& scene, const fs::path& file) {
  return write_text(file, scene_text(scene, file));
}

}  // namespace palpate::files
