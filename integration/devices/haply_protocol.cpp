#include "integration/devices/haply_protocol.h"

#include <cctype>
#include <nlohmann/json.hpp>

#include "module/haptics/force_vector.h"

namespace palpate::devices::haply {
namespace {

using Json = nlohmann::json;

// palpate: x right, y up, z towards the user. The service: x right, y away from the user, z up.
glm::dvec3 from_service(glm::dvec3 v) {
  return {v.x, v.z, -v.y};
}
glm::dvec3 to_service(glm::dvec3 v) {
  return {v.x, -v.z, v.y};
}

/// A member, or null.
const Json* member(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

std::string text_of(const Json& object, const char* name) {
  const Json* value = member(object, name);
  return value && value->is_string() ? value->get<std::string>() : "";
}

std::optional<bool> flag_of(const Json& object, const char* name) {
  const Json* value = member(object, name);
  if (!value || !value->is_boolean()) return std::nullopt;
  return value->get<bool>();
}

std::optional<glm::dvec3> vector_of(const Json& object, const char* name) {
  const Json* value = member(object, name);
  if (!value) return std::nullopt;
  glm::dvec3 v;
  const char* const axes[] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a) {
    const Json* number = member(*value, axes[a]);
    if (!number || !number->is_number()) return std::nullopt;
    v[a] = number->get<double>();
  }
  if (!is_finite(v)) return std::nullopt;
  return v;
}

/// A device's number: hexadecimal text, or a number in older services.
std::string id_of(const Json& device) {
  const Json* id = member(device, "device_id");
  if (!id) return "";
  return id->is_string() ? id->get<std::string>() : id->is_number_integer() ? id->dump() : "";
}

DeviceState device_of(const Json& json) {
  DeviceState device;
  device.id = id_of(json);
  if (const Json* config = member(json, "config")) device.type = text_of(*config, "type");
  if (const Json* state = member(json, "state")) {
    device.position_m = vector_of(*state, "cursor_position");
    if (device.position_m) device.position_m = from_service(*device.position_m);
  }
  if (const Json* status = member(json, "status")) {
    device.calibrated = flag_of(*status, "calibrated");
    device.in_use = flag_of(*status, "in_use");
    device.ready = flag_of(*status, "ready");
    device.powered = flag_of(*status, "power_supply");
  }
  return device;
}

/// One button, or several with letters.
uint32_t buttons_of(const Json& grip) {
  const Json* state = member(grip, "state");
  if (!state) return 0;
  uint32_t buttons = flag_of(*state, "button").value_or(false) ? 1 : 0;
  if (const Json* several = member(*state, "buttons")) {
    const char* const names[] = {"a", "b", "c"};
    for (uint32_t b = 0; b < 3; ++b)
      if (flag_of(*several, names[b]).value_or(false)) buttons |= 1u << b;
  }
  return buttons;
}

Json parsed(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

}  // namespace

Version version_of(std::string_view body) {
  const Json json = parsed(body);
  const Json* data = member(json, "data");
  const Json& object = data ? *data : json;
  for (const char* name : {"project_version", "git_tag", "version"}) {
    const std::string text = text_of(object, name);
    Version version;
    // Four digits are more than any part of a version has.
    if (std::sscanf(text.c_str(), "%4d.%4d", &version.major, &version.minor) == 2 ||
        std::sscanf(text.c_str(), "v%4d.%4d", &version.major, &version.minor) == 2) {
      version.known = true;
      return version;
    }
  }
  return {};
}

Wording wording_of(const Version& version) {
  const bool old =
      version.known && (version.major < 3 || (version.major == 3 && version.minor < 2));
  return old ? Wording::kValues : Wording::kVector;
}

bool has_presets(const Version& version) {
  return !version.known || version.major > 3 || (version.major == 3 && version.minor >= 5);
}

std::string first_message(const std::string& device_id, const Version& version) {
  Json message;
  message["session"]["configure"]["profile"]["name"] = "palpate";
  if (has_presets(version)) {
    Json device;
    device["device_id"] = device_id;
    device["configure"]["preset"]["preset"] = "arm_front_centered";
    device["configure"]["basis"]["permutation"] = "XYZ";
    message["inverse3"] = Json::array({device});
  }
  return message.dump();
}

std::string force_message(const std::string& device_id, glm::dvec3 force_n, Wording wording) {
  const glm::dvec3 force = to_service(force_n);
  const char* word = wording == Wording::kVector ? "vector" : "values";
  Json device;
  device["device_id"] = device_id;
  device["commands"]["set_cursor_force"][word] = {{"x", force.x}, {"y", force.y}, {"z", force.z}};
  Json message;
  message["inverse3"] = Json::array({device});
  return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<HaplyState> state_of(std::string_view text) {
  const Json json = parsed(text);
  const Json* devices = member(json, "inverse3");
  if (!devices || !devices->is_array()) return std::nullopt;
  HaplyState state;
  for (const Json& device : *devices) state.devices.push_back(device_of(device));
  for (const char* grips : {"verse_grip", "wireless_verse_grip"}) {
    const Json* list = member(json, grips);
    if (!list || !list->is_array()) continue;
    for (const Json& grip : *list) state.buttons |= buttons_of(grip);
  }
  return state;
}

DeviceEvent event_of(std::string_view text) {
  const Json json = parsed(text);
  DeviceEvent event;
  const std::string name = text_of(json, "name");
  std::string safety;
  if (const Json* data = member(json, "data")) {
    event.id = id_of(*data);
    safety = text_of(*data, "safety_type");
  }
  if (name == "device-connected") event.event = Event::kConnected;
  if (name == "device-disconnected") event.event = Event::kDisconnected;
  if (name == "device-busy") event.event = Event::kBusy;
  if (name == "device-calibration-failed") event.event = Event::kNotCalibrated;
  if (name == "device-safety-triggered" && safety == "ebrake_triggered")
    event.event = Event::kBrakeOn;
  if (name == "device-safety-triggered" && safety == "ebrake_released")
    event.event = Event::kBrakeOff;
  if (name == "device-safety-triggered" && safety == "stall_detected")
    event.event = Event::kStalled;
  return event;
}

}  // namespace palpate::devices::haply
