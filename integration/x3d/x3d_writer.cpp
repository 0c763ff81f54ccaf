#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <set>

#include "integration/files/scene/scene_file.h"
#include "integration/x3d/mode_nodes.h"
#include "integration/x3d/raw_types.h"
#include "integration/x3d/x3d_fields.h"
#include "integration/x3d/x3d_file.h"

namespace palpate::x3d {
namespace {

namespace fs = std::filesystem;

template <class T>
std::string_view word_of(const std::vector<std::pair<std::string_view, T>>& words, T value) {
  for (const auto& [word, meaning] : words)
    if (meaning == value) return word;
  return words.front().first;
}

template <class T>
std::string joined(const std::vector<T>& values) {
  std::string text;
  for (const T& value : values) text += (text.empty() ? "" : " ") + text_of(value);
  return text;
}

class X3dSceneWriter {
 public:
  explicit X3dSceneWriter(const fs::path& file) : folder_(fs::absolute(file).parent_path()) {}

  Result<X3dText> write(const SceneSpec& scene) {
    const SceneSpec usual;
    line("<?xml version='1.0' encoding='UTF-8'?>");
    line(
        "<!DOCTYPE X3D PUBLIC 'ISO//Web3D//DTD X3D 4.0//EN' "
        "'https://www.web3d.org/specifications/x3d-4.0.dtd'>");
    open("X3D profile='Full' version='4.0'");
    open("Scene");
    std::string device;
    if (scene.max_force_n != usual.max_force_n)
      device += attribute("forceLimit", text_of(scene.max_force_n));
    if (scene.world_from_device != usual.world_from_device) {
      std::vector<double> rows;
      const glm::dmat4 m = matrix(scene.world_from_device);
      for (int k = 0; k < 16; ++k) rows.push_back(m[k % 4][k / 4]);
      device += attribute("positionCalibration", joined(rows));
    }
    if (!device.empty()) {
      open("DeviceInfo");
      line("<AnyDevice" + device + "/>");
      close("DeviceInfo");
    }
    line("<VolumeHaptics" + attribute("stiffness", text_of(scene.stiffness_n_per_m)) +
         (scene.tool_radius_m > 0.0 ? attribute("palpateToolRadius", text_of(scene.tool_radius_m))
                                    : "") +
         (scene.tool_points > 1 ? attribute("palpateToolPoints", text_of(scene.tool_points)) : "") +
         (scene.damping_n_s_per_m > 0.0
              ? attribute("palpateDamping", text_of(scene.damping_n_s_per_m))
              : "") +
         "/>");
    if (!scene.session.empty())
      notes_.push_back("The options of the scene's section session have no node in X3D.");
    for (const VolumeSpec& v : scene.volumes)
      if (const Status written = volume(scene, v); !written) return written.error();
    for (const std::string& route : routes_) line(route);
    close("Scene");
    close("X3D");
    return X3dText{std::move(text_), std::move(notes_)};
  }

 private:
  // Lines -------------------------------------------------------------------------------------

  void line(const std::string& text) { text_ += std::string(2 * depth_, ' ') + text + "\n"; }
  void open(const std::string& element) {
    line("<" + element + ">");
    ++depth_;
  }
  void close(const std::string& name) {
    --depth_;
    line("</" + name + ">");
  }
  static std::string attribute(const char* name, std::string_view value) {
    return fmt::format(" {}='{}'", name, escaped(value));
  }

  /// A unique DEF, made from a name.
  std::string def(const std::string& name) {
    std::string base;
    for (const char c : name) {
      const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-' ||
                         (c >= '0' && c <= '9');
      base += plain ? c : '_';
    }
    if (base.empty() || base[0] == '-' || (base[0] >= '0' && base[0] <= '9')) base = "_" + base;
    std::string one = base;
    for (int n = 2; !defs_.insert(one).second; ++n) one = fmt::format("{}_{}", base, n);
    return one;
  }

  void name_metadata(const std::string& name, const std::string& def) {
    if (name == def) return;
    line("<MetadataString containerField='metadata'" + attribute("name", kNameMetadata) +
         attribute("value", text_of(std::vector<std::string>{name})) + "/>");
  }

  std::string urls(const std::vector<fs::path>& files) const {
    std::vector<std::string> names;
    for (const fs::path& file : files)
      names.push_back(
          fs::absolute(file).lexically_normal().lexically_proximate(folder_).generic_string());
    return attribute("url", text_of(names));
  }

  // Transforms --------------------------------------------------------------------------------

  static std::string fields_of(const Transform& t) {
    const Transform usual;
    std::string text;
    if (t.translation_m != usual.translation_m)
      text += attribute("translation", text_of(t.translation_m));
    if (t.rotation != usual.rotation) text += attribute("rotation", text_of(t.rotation));
    if (t.scale != usual.scale) text += attribute("scale", text_of(t.scale));
    return text;
  }

  std::string sensor(double cycle_s, bool loop) {
    const std::string clock = def("Clock");
    line("<TimeSensor" + attribute("DEF", clock) + attribute("cycleInterval", text_of(cycle_s)) +
         attribute("loop", loop ? "true" : "false") + "/>");
    return clock;
  }

  void route(const std::string& from, const char* from_field, const std::string& to,
             const char* to_field) {
    routes_.push_back("<ROUTE" + attribute("fromNode", from) + attribute("fromField", from_field) +
                      attribute("toNode", to) + attribute("toField", to_field) + "/>");
  }

  template <class T>
  void animate(const std::string& transform, const char* field, const KeyTrack<T>& track,
               const std::string& values = {}) {
    if (track.keys.empty()) return;
    constexpr bool kTurns = std::is_same_v<T, glm::dquat>;
    const std::string clock = sensor(track.cycle_s, track.loop);
    const std::string way = def(transform + "_" + field);
    line(std::string(kTurns ? "<OrientationInterpolator" : "<PositionInterpolator") +
         attribute("DEF", way) + attribute("key", joined(track.keys)) +
         attribute("keyValue", values.empty() ? joined(track.values) : values) + "/>");
    route(clock, "fraction_changed", way, "set_fraction");
    route(way, "value_changed", transform, fmt::format("set_{}", field).c_str());
  }

  /// Opens the Transforms that contain a volume; returns their number.
  int place(const VolumeSpec& v) {
    const DriveSpec& drive = v.drive;
    std::vector<KeyedPose> poses;
    glm::dvec3 centre(0.0);
    if (drive.kind == DriveSpec::Kind::kKeys) poses = drive.poses;
    std::string turn_values;  // as angles about one axis: a rotation can not express a full turn
    if (drive.kind == DriveSpec::Kind::kTurn && drive.rate_hz != 0.0) {
      KeyedPose turn;
      const glm::dvec3 axis = glm::normalize(drive.axis);
      const double whole = drive.rate_hz < 0.0 ? -glm::two_pi<double>() : glm::two_pi<double>();
      for (int k = 0; k <= 4; ++k) {
        turn.rotation.keys.push_back(0.25 * k);
        turn.rotation.values.push_back(glm::angleAxis(0.25 * k * whole, axis));
        turn_values += (k ? ", " : "") + text_of(axis) + " " + text_of(0.25 * k * whole);
      }
      turn.rotation.cycle_s = 1.0 / std::abs(drive.rate_hz);
      poses = {turn};
      centre = drive.centre_m;
    }
    if (drive.kind == DriveSpec::Kind::kSwing && drive.rate_hz != 0.0) {
      constexpr int kPieces = 64;
      KeyedPose swing;
      for (int k = 0; k <= kPieces; ++k) {
        const double share = double(k) / kPieces;
        const double angle = glm::two_pi<double>() * share * (drive.rate_hz < 0.0 ? -1.0 : 1.0);
        swing.translation_m.keys.push_back(share);
        swing.translation_m.values.push_back(glm::normalize(drive.axis) *
                                             (drive.amplitude_m * std::sin(angle)));
      }
      swing.translation_m.cycle_s = 1.0 / std::abs(drive.rate_hz);
      poses = {swing};
      notes_.push_back(
          fmt::format("The swing of \"{}\" is written as {} straight pieces.", v.name, kPieces));
    }
    int opened = 0;
    for (const KeyedPose& pose : poses) {
      const std::string name = def(v.name + "_moves");
      open("Transform" + attribute("DEF", name) + fields_of(pose.pose) +
           (centre != glm::dvec3(0.0) ? attribute("center", text_of(centre)) : ""));
      animate(name, "translation", pose.translation_m);
      animate(name, "rotation", pose.rotation, turn_values);
      animate(name, "scale", pose.scale);
      ++opened;
    }
    const std::string still = fields_of(v.transform);
    if (!still.empty() || opened == 0) {
      open("Transform" + still);
      ++opened;
    }
    return opened;
  }

  // Volumes and modes -------------------------------------------------------------------------

  Status volume(const SceneSpec& scene, const VolumeSpec& v) {
    if (!v.source.empty() && v.source != "charges")
      return Error{
          ErrorKind::kBadInput,
          fmt::format("The synthetic data \"{}\" have no node in X3D: write them to a file with "
                      "'palpate phantom', and name that",
                      v.source)};
    if (v.source.empty() && !v.box_m && !v.centred)
      return Error{ErrorKind::kBadInput,
                   fmt::format("The place of the volume \"{}\" can not be said in X3D: centre its "
                               "data, or give it a box",
                               v.name)};
    note_losses(v);
    const int opened = place(v);
    if (is_sequence(v) && v.cycle_s > 0.0) clock_ = sensor(v.cycle_s, v.cyclic);
    std::string data = def(v.name);
    const std::string type = v.source == "charges" ? "VectorElectroPotential"
                             : v.box_m             ? "VolumeData"
                                                   : "VectorVolume";
    bool written = false;
    const auto data_here = [&] {
      if (written) {
        line("<" + type + attribute("USE", data) + " containerField='vectorVolume'/>");
        return;
      }
      written = true;
      if (v.source == "charges")
        charges(v, data);
      else if (v.box_m)
        volume_data(v, data);
      else
        vector_volume(v, data);
    };
    const bool has_modes =
        std::any_of(scene.modes.begin(), scene.modes.end(),
                    [&](const ModeSpec& m) { return m.volume == v.name && node_of(m); });
    if (v.box_m.has_value() && v.source.empty()) data_here();
    if (!has_modes && !written) data_here();
    for (const ModeSpec& m : scene.modes) {
      if (m.volume != v.name) continue;
      const ModeNode* node = node_of(m);
      if (!node) {
        notes_.push_back(
            fmt::format("The mode \"{}\" has no node in X3D and is left out.", m.name));
        continue;
      }
      mode(m, *node, v.source == "charges", data_here);
    }
    if (v.appearance.tubes.value_or(false)) {
      open("Shape");
      open("StreamTubes");
      data_here();
      close("StreamTubes");
      close("Shape");
    }
    for (int k = 0; k < opened; ++k) close("Transform");
    return Nothing{};
  }

  static const ModeNode* node_of(const ModeSpec& mode) {
    for (const ModeNode& one : kModeNodes)
      if (one.kind == mode.kind) return &one;
    return nullptr;
  }

  /// Notes the properties of a volume that X3D can not express.
  void note_losses(const VolumeSpec& v) {
    const VolumeSpec usual;
    std::vector<const char*> lost;
    const auto note = [&](bool differs, const char* what) {
      if (differs) lost.push_back(what);
    };
    note(!v.motions.empty(), "motions");
    note(v.drive.kind == DriveSpec::Kind::kSecondHand, "the second hand");
    note(v.path != usual_path(v.drive.kind), "path");
    note(v.back_tracking != usual.back_tracking, "back_tracking");
    note(v.frames_per_second != usual.frames_per_second, "frames_per_second");
    note(!v.cyclic && !(v.cycle_s > 0.0), "cyclic");
    note(v.raw && v.cycle_s > 0.0, "cycle_s");
    note(v.rate != usual.rate, "rate");
    note(v.values.has_value(), "values");
    note(v.blend_values != usual.blend_values, "blend_values");
    if (v.segments.from != SegmentsFrom::kFiles)
      lost.push_back("segments");
    else
      note(v.segments.frame != 0 || !v.segments.parts.empty(), "segments.frame and segments.parts");
    AppearanceSpec appearance = v.appearance;
    appearance.shown = true;
    if (appearance.tubes.value_or(false)) appearance.tubes.reset();
    note(appearance != AppearanceSpec{}, "view");
    note(!v.appearance.shown && !(v.box_m && v.source.empty()), "view.shown");
    if (!lost.empty())
      notes_.push_back(
          fmt::format("X3D has no words for these keys of the volume \"{}\", which are "
                      "left out: {}.",
                      v.name, fmt::join(lost, ", ")));
  }

  void charges(const VolumeSpec& v, const std::string& name) {
    std::vector<glm::dvec3> points;
    std::vector<double> potentials, softness;
    for (const PointCharge& c : v.charges) {
      points.push_back(c.position_m);
      potentials.push_back(c.strength_v_m);
      softness.push_back(c.softness_m);
    }
    std::string text =
        "VectorElectroPotential" + attribute("DEF", name) + " containerField='vectorVolume'";
    if (v.box_m) text += attribute("size", text_of(*v.box_m));
    text += attribute("point", joined(points)) + attribute("potential", joined(potentials)) +
            attribute("palpateSoftness", joined(softness));
    open(text);
    name_metadata(v.name, name);
    close("VectorElectroPotential");
  }

  void volume_data(const VolumeSpec& v, const std::string& name) {
    const bool segmented = !v.segments.files.empty();
    const char* type = segmented ? "SegmentedVolumeData" : "VolumeData";
    open(type + attribute("DEF", name) + attribute("dimensions", text_of(*v.box_m)) +
         (v.appearance.shown ? "" : attribute("visible", "false")));
    name_metadata(v.name, name);
    texture(v);
    if (segmented)
      line(fmt::format("<{} containerField='segmentIdentifiers'{}/>",
                       v.segments.files.size() > 1 ? kSequenceNode : "ImageTexture3D",
                       urls(v.segments.files)));
    close(type);
  }

  static bool is_sequence(const VolumeSpec& v) {
    return !v.raw && (v.files.size() > 1 || v.cycle_s > 0.0);
  }

  void loader(const VolumeSpec& v) {
    if (!v.raw) return;
    const RawSamples& raw = *v.raw;
    const RawType* type = std::find_if(std::begin(kRawTypes), std::end(kRawTypes),
                                       [&](const RawType& one) { return one.type == raw.type; });
    line("<RawImageLoader containerField='imageLoader'" + attribute("width", text_of(raw.size.x)) +
         attribute("height", text_of(raw.size.y)) + attribute("depth", text_of(raw.size.z)) +
         attribute("pixelType", raw.components == 3 ? "VEC3" : "LUMINANCE") +
         attribute("pixelComponentType", type->kind) +
         attribute("bitsPerPixel", text_of(raw.components * type->bits)) +
         attribute("pixelSize", text_of(raw.spacing_m)) + "/>");
  }

  void vector_volume(const VolumeSpec& v, const std::string& name) {
    const char* type = "VectorVolume";
    if (!is_sequence(v)) {
      open(type + attribute("DEF", name) + " containerField='vectorVolume'" + urls(v.files));
      name_metadata(v.name, name);
      loader(v);
    } else {
      open(type + attribute("DEF", name) + " containerField='vectorVolume'");
      name_metadata(v.name, name);
      texture(v);
    }
    close(type);
  }

  void texture(const VolumeSpec& v) {
    if (!is_sequence(v)) {
      const std::string texture = "ImageTexture3D containerField='voxels'" + urls(v.files);
      if (!v.raw) return line("<" + texture + "/>");
      open(texture);
      loader(v);
      return close("ImageTexture3D");
    }
    const std::string frames = def(v.name + "_frames");
    line(fmt::format("<{} containerField='voxels'{}{}/>", kSequenceNode, attribute("DEF", frames),
                     urls(v.files)));
    if (!(v.cycle_s > 0.0)) return;
    route(clock_, "fraction_changed", frames, "set_fraction");
  }

  template <class Data>
  void mode(const ModeSpec& m, const ModeNode& node, bool of_charges, const Data& data_here) {
    const ModeSpec usual;
    const std::string name = def(m.name);
    std::string text = std::string(node.node) + attribute("DEF", name);
    const auto truth = [&](const char* field, bool value, bool otherwise) {
      if (value != otherwise) text += attribute(field, value ? "true" : "false");
    };
    truth("active", m.on, true);
    truth("twoSided", m.two_sided, false);
    truth("leaving", m.leaving, false);
    if (m.gain != usual.gain) text += attribute("gain", text_of(m.gain));
    if (m.point_m != usual.point_m) text += attribute("point", text_of(m.point_m));
    if (m.range_m != usual.range_m) text += attribute("range", text_of(m.range_m));
    if (m.scalar != usual.scalar)
      text += attribute("palpateScalar", word_of(files::SceneWords::kScalars, m.scalar));
    if (m.vector != (of_charges ? VectorProperty::kGradient : usual.vector))
      text += attribute("palpateVector", word_of(files::SceneWords::kVectors, m.vector));
    if (!m.segment.empty()) text += attribute("palpateSegment", m.segment);
    if (!m.motion.empty())
      notes_.push_back(fmt::format(
          "X3D has no word for the motion of the mode \"{}\", which is left out.", m.name));
    open(text);
    name_metadata(m.name, name);
    data_here();
    transfer(m.strength, "strength");
    if (files::mode_key_applies(m.kind, "friction")) transfer(m.friction, "friction");
    close(std::string(node.node));
  }

  void transfer(const TransferFunction& f, const char* role) {
    if (f.in().empty()) return;
    std::vector<double> pairs;
    for (size_t k = 0; k < f.in().size(); ++k) {
      pairs.push_back(f.in()[k]);
      pairs.push_back(f.out()[k]);
    }
    line("<PiecewiseFunction" + attribute("containerField", role) +
         (f.is_stepped() ? attribute("continuous", "false") : "") +
         attribute("segments", joined(pairs)) + "/>");
  }

  fs::path folder_;
  std::string text_;
  size_t depth_ = 0;
  std::set<std::string> defs_;
  std::vector<std::string> routes_, notes_;
  std::string clock_;  ///< of the sequence that is being written
};

}  // namespace

Result<X3dText> x3d_text(const SceneSpec& scene, const fs::path& file) {
  return X3dSceneWriter(file).write(scene);
}

}  // namespace palpate::x3d
