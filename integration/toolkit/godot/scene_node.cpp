#include <algorithm>
#include <chrono>

#include "nodes.h"

namespace palpate::godot {
namespace {

using nlohmann::json;

/// The rows of palpate's table that a host may set.
const std::vector<json>& option_rows() {
  static const std::vector<json> rows = [] {
    size_t length = 0;
    pal_options(nullptr, 0, &length);
    std::string text(length + 1, '\0');
    pal_options(text.data(), text.size(), &length);
    std::vector<json> found;
    for (const json& row : json::parse(text.c_str())) {
      const json& doors = row["doors"];
      if (std::find(doors.begin(), doors.end(), "c") != doors.end()) found.push_back(row);
    }
    return found;
  }();
  return rows;
}

/// The default as the editor shows it; null: there is none, and the property can be switched on.
Variant fallback_of(const json& row) {
  const auto type = row["type"].get<std::string>();
  const auto fallback = row["default"].get<std::string>();
  if (type == "flag") return fallback == "true";
  if (type == "paths" || type == "texts")
    return Variant::made(GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
  if (type == "text" || type == "path" || type == "word") return fallback;
  const json number = json::parse(fallback, nullptr, false);
  if (!number.is_number()) return {};
  return type == "number" ? Variant(number.get<double>()) : Variant(number.get<int64_t>());
}

/// True if every Node3D has a property of this name.
bool is_of_every_node(const std::string& name) {
  const Variant list = singleton("ClassDB").call("class_get_property_list", "Node3D");
  for (int64_t k = 0; k < int64_t(list.call("size").number()); ++k)
    if (list.call("get", k).call("get", "name").text() == name) return true;
  return false;
}

PropertyRow property_of(const json& row) {
  constexpr uint32_t kRange = 1, kEnum = 2, kSuggestions = 3, kGlobalFile = 15, kCheckable = 16;
  PropertyRow property{row["key"], GDEXTENSION_VARIANT_TYPE_STRING};
  if (is_of_every_node(property.name)) property.name = "data_" + property.name;
  property.help = row["help"];
  const auto type = row["type"].get<std::string>();
  if (type == "flag") property.type = GDEXTENSION_VARIANT_TYPE_BOOL;
  if (type == "paths" || type == "texts")
    property.type = GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY;
  if (type == "path") property.hint = kGlobalFile;
  if (type == "word") {
    property.hint = row["default"] == "" ? kSuggestions : kEnum;
    for (const json& word : row["words"])
      property.hint_text += (word == row["words"].front() ? "" : ",") + word.get<std::string>();
  }
  if (type == "number" || type == "whole number") {
    property.type =
        type == "number" ? GDEXTENSION_VARIANT_TYPE_FLOAT : GDEXTENSION_VARIANT_TYPE_INT;
    if (fallback_of(row).is_null()) property.usage |= kCheckable;
    const auto unit = row["unit"].get<std::string>();
    if (row.contains("low") && row.contains("high")) {
      property.hint = kRange;
      property.hint_text = row["low"].dump() + "," + row["high"].dump() + "," +
                           (type == "number" ? "0.0001" : "1") +
                           (row["high"].get<double>() > 1000.0 ? ",hide_slider" : "") +
                           (unit.empty() ? "" : ",suffix:" + unit);
    }
  }
  return property;
}

enum OwnProperty : size_t { kInputs, kGpu, kAutostart, kPreview, kOptions };

/// A path as the system has it: "res://" and "user://" are the engine's.
std::string system_path(const std::string& path) {
  if (!path.starts_with("res://") && !path.starts_with("user://")) return path;
  return singleton("ProjectSettings").call("globalize_path", path).text();
}

std::vector<std::string> texts_of(const Variant& list) {
  std::vector<std::string> texts;
  const auto count = int64_t(list.call("size").number());
  for (int64_t k = 0; k < count; ++k) texts.push_back(list.call("get", k).text());
  return texts;
}

json json_of(const Variant& value, const json& row) {
  const auto type = row["type"].get<std::string>();
  if (type == "flag") return value.is_true();
  if (type == "number") return value.number();
  if (type == "whole number") return int64_t(value.number());
  if (type != "paths" && type != "texts") return system_path(value.text());
  json list = json::array();
  for (const std::string& text : texts_of(value)) list.push_back(system_path(text));
  return list;
}

int64_t monotonic_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

HandPoint rotated(const std::array<double, 4>& wxyz, const HandPoint& v) {
  const auto [w, x, y, z] = wxyz;
  const HandPoint twice_cross{2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]),
                              2.0 * (x * v[1] - y * v[0])};
  return {v[0] + w * twice_cross[0] + y * twice_cross[2] - z * twice_cross[1],
          v[1] + w * twice_cross[1] + z * twice_cross[0] - x * twice_cross[2],
          v[2] + w * twice_cross[2] + x * twice_cross[1] - y * twice_cross[0]};
}

std::string text_of(const PalScene* scene, PalSceneText which) {
  size_t length = 0;
  pal_scene_text(scene, which, nullptr, 0, &length);
  std::string text(length + 1, '\0');
  pal_scene_text(scene, which, text.data(), text.size(), &length);
  text.resize(length);
  return text;
}

/// All scenes that exist, by their object.
std::map<GDExtensionObjectPtr, SceneNode*> scenes;

}  // namespace

/// What the opening thread needs.
struct SceneNode::Request {
  std::vector<std::string> inputs;
  std::string gpu, scene_options, session_options;
  bool follows_device = false;
  double reach_m = 0.0;
  std::optional<HandPoint> hand_m;  ///< at the start, palpate's world
  SceneNode* node = nullptr;
};

SceneNode::SceneNode() {
  inputs_ = Variant::made(GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
  inputs_.call("append", "heart");
  link.now_ns = monotonic_now_ns;
}

SceneNode::~SceneNode() {
  close();
  scenes.erase(object);
}

SceneNode* SceneNode::above(const EngineNode& node) {
  for (Variant at = node.self().call("get_parent"); !at.is_null(); at = at.call("get_parent")) {
    const auto found = scenes.find(at.as<GDExtensionObjectPtr>());
    if (found != scenes.end()) return found->second;
    if (!at.as<GDExtensionObjectPtr>()) break;
  }
  return nullptr;
}

// ---- properties

uint32_t SceneNode::usage_of(const std::string& property) const {
  constexpr uint32_t kChecked = 32;
  for (const auto& [row, value] : options_)
    if (class_row().properties[kOptions + row].name == property) return kChecked;
  return 0;
}

Variant SceneNode::get(size_t property) const {
  if (property == kInputs) return inputs_;
  if (property == kGpu) return gpu_;
  if (property == kAutostart) return autostart_;
  if (property == kPreview) return preview_;
  const auto set = options_.find(property - kOptions);
  return set != options_.end() ? set->second : fallback_of(option_rows()[property - kOptions]);
}

void SceneNode::set(size_t property, const Variant& value) {
  if (property == kInputs) {
    inputs_ = value;
  } else if (property == kGpu) {
    gpu_ = value;
  } else if (property == kAutostart) {
    autostart_ = value;
  } else if (property == kPreview) {
    preview_ = value;
    if (in_editor() && self().call("is_inside_tree").is_true()) {
      close();
      open_soon();
    }
  } else if (const Variant fallback = fallback_of(option_rows()[property - kOptions]);
             value.is_null() || value.text() == fallback.text()) {
    options_.erase(property - kOptions);
  } else {
    options_[property - kOptions] = value;
  }
}

std::string SceneNode::options_text(std::string_view stage) const {
  json options = json::object();
  // In the editor nothing is felt, so nothing is kept or served.
  const auto is_kept = [](const json& key) {
    return key == "record" || key == "csv" || key == "serve" || key == "black_box";
  };
  if (in_editor() && stage == "session") options["black_box"] = "off";
  for (const auto& [index, value] : options_) {
    const json& row = option_rows()[index];
    // A hand of the host's has no device of palpate's.
    if (row["key"] == "device" && !(hand && hand->follows_device())) continue;
    if (in_editor() && is_kept(row["key"])) continue;
    if (row["stage"] == stage) options[row["key"].get<std::string>()] = json_of(value, row);
  }
  return options.dump();
}

// ---- opening and closing

/// With the next frame: until then scripts may set properties, and place the hand.
void SceneNode::open_soon() {
  opens_ = (in_editor() ? preview_ : autostart_).is_true();
  if (opens_) self().call("set_process_internal", true);
}

void SceneNode::open() {
  close();
  Request request;
  for (const std::string& input : texts_of(inputs_)) request.inputs.push_back(system_path(input));
  request.gpu = gpu_.text();
  request.scene_options = options_text("scene");
  request.session_options = options_text("session");
  request.follows_device = hand && hand->follows_device() && !in_editor();
  link.reach_m = request.reach_m = hand ? hand->reach_m() : 0.08;
  request.node = this;
  if (hand && !hand->follows_device() && !in_editor())
    request.hand_m = in_palpate(hand->self().call("get_global_position").as<EngineVector>());
  opening_ = std::async(std::launch::async, [request] { return opened(request); });
  self().call("set_process_internal", true);
}

OpenScene SceneNode::opened(const Request& request) {
  OpenScene result;
  const auto failed = [&](PalResult done) {
    if (done != PAL_OK) result.trouble = pal_last_error();
    return done != PAL_OK;
  };
  PalContextInfo context{};
  context.size = sizeof context;
  context.version = PAL_VERSION;
  if (request.gpu == "none")
    context.flags = PAL_CONTEXT_NO_GPU;
  else if (!request.gpu.empty())
    context.device = request.gpu.c_str();
  if (failed(pal_context_open(&context, &result.context))) return result;

  std::vector<const char*> paths;
  for (const std::string& input : request.inputs) paths.push_back(input.c_str());
  PalSceneInfo scene{};
  scene.size = sizeof scene;
  scene.paths = paths.data();
  scene.path_count = uint32_t(paths.size());
  scene.options = request.scene_options.c_str();
  if (failed(pal_scene_open(result.context, &scene, &result.scene))) return result;

  // Where the device stands; the haptic thread begins with the session.
  const json text = json::parse(text_of(result.scene, PAL_SCENE_TEXT_JSON), nullptr, false);
  SceneNode& node = *request.node;
  node.device_translation_m_ = {};
  node.device_scale_ = {1.0, 1.0, 1.0};
  node.device_wxyz_ = {1.0, 0.0, 0.0, 0.0};
  if (const auto at = text.find("world_from_device"); at != text.end()) {
    node.device_translation_m_ = at->value("translation_m", node.device_translation_m_);
    node.device_wxyz_ = at->value("quaternion_wxyz", node.device_wxyz_);
    if (const auto scale = at->find("scale"); scale != at->end())
      for (size_t a = 0; a < 3; ++a)
        node.device_scale_[a] =
            scale->is_array() ? (*scale)[a].get<double>() : scale->get<double>();
  }

  if (request.hand_m) {
    const HandPoint place_m = node.in_device(*request.hand_m);
    node.link.hold(&place_m);
  }

  PalDeviceInfo about{};
  about.size = sizeof about;
  about.name = "Godot";
  // The scene's own limit counts: a hand that is only a place bears any force.
  about.max_force_n = 300.0;
  about.workspace_radius_m = request.reach_m;
  PalDevice device{};
  device.size = sizeof device;
  device.info = &about;
  device.exchange = HandLink::exchange;
  device.user = &node.link;
  PalSessionInfo session{};
  session.size = sizeof session;
  if (!request.follows_device) session.device = &device;
  session.options = request.session_options.c_str();
  session.on_event = on_event;
  session.user = request.node;
  failed(pal_session_open(result.scene, &session, &result.session));
  return result;
}

void SceneNode::close() {
  opens_ = false;
  if (opening_.valid()) opening_.get();
  link.hold(nullptr);
  opened_ = OpenScene();
  has_state_ = false;
  const std::lock_guard lock(events_mutex_);
  events_.clear();
}

/// On the session's threads.
void SceneNode::on_event(void* user, PalEventKind kind, const char* sentence) {
  auto& node = *static_cast<SceneNode*>(user);
  const std::lock_guard lock(node.events_mutex_);
  node.events_.push_back({kind, sentence});
}

void SceneNode::take_opened() {
  opened_ = opening_.get();
  if (opened_.session) {
    const std::string notes = text_of(opened_.scene, PAL_SCENE_TEXT_NOTES);
    if (!notes.empty()) emit("note", notes);
    emit("opened");
    return;
  }
  warn(opened_.trouble);
  emit("failed", opened_.trouble);
}

void SceneNode::process() {
  if (opens_) open();
  if (opening_.valid() && opening_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    take_opened();
  if (!opened_.session) return;
  state_.size = sizeof state_;
  has_state_ = pal_session_state(opened_.session, &state_) == PAL_OK && state_.time_ns != 0;
  std::deque<SceneEvent> events;
  {
    const std::lock_guard lock(events_mutex_);
    events.swap(events_);
  }
  for (const auto& [kind, sentence] : events) {
    if (kind == PAL_EVENT_NOTE)
      emit("note", sentence);
    else
      emit("verdict",
           kind == PAL_EVENT_MOVES          ? "moves"
           : kind == PAL_EVENT_WHOLE_MOTION ? "whole"
                                            : "failed",
           sentence);
  }
}

void SceneNode::notified(int what) {
  if (what == kEntersTree) scenes[object] = this;
  if (what == kHasEnteredTree) open_soon();
  if (what == kInternalProcess) process();
  if (what == kLeavesTree) close();
}

// ---- spaces

EngineTransform SceneNode::transform() const {
  return self().call("get_global_transform").as<EngineTransform>();
}

HandPoint SceneNode::in_palpate(EngineVector place) const {
  const auto local = self().call("to_local", place).as<EngineVector>();
  return {local.x, local.y, local.z};
}

HandPoint SceneNode::in_device(const HandPoint& palpate_m) const {
  const auto [w, x, y, z] = device_wxyz_;
  HandPoint away{};
  for (size_t a = 0; a < 3; ++a) away[a] = palpate_m[a] - device_translation_m_[a];
  HandPoint device = rotated({w, -x, -y, -z}, away);
  for (size_t a = 0; a < 3; ++a) device[a] /= device_scale_[a];
  return device;
}

EngineVector SceneNode::turned(const double (&palpate)[3]) const {
  const EngineTransform t = transform();
  double godot[3] = {};
  for (size_t column = 0; column < 3; ++column) {
    const double length = std::hypot(t.rows[0][column], t.rows[1][column], t.rows[2][column]);
    for (size_t row = 0; row < 3; ++row)
      godot[row] += palpate[column] * t.rows[row][column] / length;
  }
  return {float(godot[0]), float(godot[1]), float(godot[2])};
}

EngineVector SceneNode::placed(const double (&palpate_m)[3]) const {
  const EngineVector local{float(palpate_m[0]), float(palpate_m[1]), float(palpate_m[2])};
  return self().call("to_global", local).as<EngineVector>();
}

// ---- the class

Variant SceneNode::do_open(Arguments) {
  open();
  return {};
}

Variant SceneNode::do_close(Arguments) {
  close();
  return {};
}

Variant SceneNode::is_open(Arguments) {
  return session() != nullptr;
}

Variant SceneNode::play(Arguments on) {
  return pal_session_play(session(), on[0].is_true()) == PAL_OK;
}

Variant SceneNode::scrub(Arguments share) {
  return pal_session_scrub(session(), share[0].number()) == PAL_OK;
}

Variant SceneNode::rearm(Arguments) {
  return pal_session_rearm(session()) == PAL_OK;
}

Variant SceneNode::replay(Arguments recording) {
  Variant result = Variant::made(GDEXTENSION_VARIANT_TYPE_DICTIONARY);
  PalReplay replay{};
  replay.size = sizeof replay;
  const std::string path = system_path(recording[0].text());
  if (pal_scene_replay(opened_.scene, path.c_str(), nullptr, &replay) != PAL_OK) {
    result.call("set", "error", pal_last_error());
    return result;
  }
  result.call("set", "ticks", int64_t(replay.ticks));
  result.call("set", "different", int64_t(replay.different));
  result.call("set", "is_cut_off", replay.is_cut_off != 0);
  return result;
}

const ClassRow& SceneNode::class_row() {
  static const ClassRow row = [] {
    constexpr auto kNothing = GDEXTENSION_VARIANT_TYPE_NIL;
    constexpr auto kBool = GDEXTENSION_VARIANT_TYPE_BOOL;
    constexpr auto kFloat = GDEXTENSION_VARIANT_TYPE_FLOAT;
    constexpr auto kString = GDEXTENSION_VARIANT_TYPE_STRING;
    ClassRow made{
        "PalpateScene",
        "Node3D",
        "A moving volume, or a scene of volumes, to feel and to see. Its space is palpate's world.",
        []() -> std::unique_ptr<EngineNode> { return std::make_unique<SceneNode>(); },
        {{"open", {}, kNothing, run<&SceneNode::do_open>},
         {"close", {}, kNothing, run<&SceneNode::do_close>},
         {"is_open", {}, kBool, run<&SceneNode::is_open>},
         {"play", {{"on", kBool}}, kBool, run<&SceneNode::play>},
         {"scrub", {{"share", kFloat}}, kBool, run<&SceneNode::scrub>},
         {"rearm", {}, kBool, run<&SceneNode::rearm>},
         {"replay",
          {{"recording", kString}},
          GDEXTENSION_VARIANT_TYPE_DICTIONARY,
          run<&SceneNode::replay>}},
        {{"opened", {}},
         {"failed", {{"sentence", kString}}},
         {"note", {{"sentence", kString}}},
         {"verdict", {{"word", kString}, {"sentence", kString}}}},
        {{.name = "inputs",
          .type = GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY,
          .help = "What is felt and seen: heart, shell, molecule, a scene file, a folder, a 4D "
                  "file, files of frames in order, or igtl://HOST:PORT"},
         {.name = "gpu",
          .type = kString,
          .help = "Vulkan device for pictures and motion, by number or part of its name; empty: "
                  "the first one; none: forces alone"},
         {.name = "autostart",
          .type = kBool,
          .help = "Opens when the node enters the tree; else open() does"},
         {.name = "preview",
          .type = kBool,
          .help = "Shows the volumes in the editor's first viewport, too. Nothing is felt there"}}};
    std::string stage;
    for (const json& option : option_rows()) {
      made.properties.push_back(property_of(option));
      if (option["stage"] != stage)
        made.properties.back().group = option["stage"] == "scene" ? "Scene" : "Session";
      stage = option["stage"];
    }
    return made;
  }();
  return row;
}

}  // namespace palpate::godot
