#include "integration/loading/replay_key.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "integration/files/scene/scene_file.h"
#include "integration/files/sentences.h"

namespace palpate::loading {
namespace {

using Json = nlohmann::json;

/// Thrown if the text is not a replay key.
struct Foreign : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double finite(const Json& j) {
  const double value = j.is_number() ? j.get<double>() : NAN;
  if (!std::isfinite(value)) throw Foreign("not a number");
  return value;
}

double not_below_zero(const Json& j) {
  const double value = finite(j);
  if (value < 0.0) throw Foreign("below zero");
  return value;
}

uint32_t buttons(const Json& j) {
  // A number outside the range would be truncated.
  if (!j.is_number_unsigned() || j.get<uint64_t>() > std::numeric_limits<uint32_t>::max())
    throw Foreign("no buttons");
  return j.get<uint32_t>();
}

Json json_of(const DeviceInfo& d) {
  return {{"max_force_n", d.max_force_n},
          {"continuous_force_n", d.continuous_force_n},
          {"max_stiffness_n_per_m", d.max_stiffness_n_per_m},
          {"centre_m", {d.workspace_centre_m.x, d.workspace_centre_m.y, d.workspace_centre_m.z}},
          {"radius_m", d.workspace_radius_m},
          {"delay_s", d.delay_s}};
}

/// The options that the command line can change.
Json json_of(const SafetyOptions& safety) {
  return {{"max_force_n", safety.max_force_n},
          {"max_speed_m_per_s", safety.max_speed_m_per_s},
          {"late_s", safety.late_s},
          {"stale_s", safety.stale_s},
          {"dead_man", safety.dead_man},
          {"dead_man_buttons", safety.dead_man_buttons},
          {"seen_buttons", safety.shown_buttons}};
}

DeviceInfo device_of(const Json& j) {
  DeviceInfo device;
  device.max_force_n = not_below_zero(j.at("max_force_n"));
  // An older recording's motors were taken to hold a third of their most.
  device.continuous_force_n = j.contains("continuous_force_n")
                                  ? not_below_zero(j.at("continuous_force_n"))
                                  : device.max_force_n / 3.0;
  device.max_stiffness_n_per_m = not_below_zero(j.at("max_stiffness_n_per_m"));
  const Json& centre = j.at("centre_m");
  device.workspace_centre_m = {finite(centre.at(0)), finite(centre.at(1)), finite(centre.at(2))};
  device.workspace_radius_m = not_below_zero(j.at("radius_m"));
  device.delay_s = not_below_zero(j.at("delay_s"));
  return device;
}

SafetyOptions safety_of(const Json& j) {
  SafetyOptions safety;
  safety.max_force_n = not_below_zero(j.at("max_force_n"));
  safety.late_s = not_below_zero(j.at("late_s"));
  safety.stale_s = not_below_zero(j.at("stale_s"));
  safety.dead_man = j.at("dead_man").get<bool>();
  // Older recordings do not contain it: it could not be chosen.
  if (j.contains("max_speed_m_per_s"))
    safety.max_speed_m_per_s = not_below_zero(j.at("max_speed_m_per_s"));
  // Older recordings, from before headsets, contain neither: any button was the dead-man, and no
  // viewer was needed. The defaults of SafetyOptions are the values of that time.
  if (j.contains("dead_man_buttons")) safety.dead_man_buttons = buttons(j.at("dead_man_buttons"));
  if (j.contains("seen_buttons")) safety.shown_buttons = buttons(j.at("seen_buttons"));
  return safety;
}

/// The tube buttons of a recording that does not name them: all but the two highest ones, which
/// told of a headset at that time; none with a dead-man.
uint32_t older_tube_buttons(const SafetyOptions& safety) {
  return safety.dead_man ? 0 : ~(3u << 30);
}

}  // namespace

std::string text_of(const ReplayKey& key) {
  const Json json = {{"scene", Json::parse(files::scene_text(key.scene))},
                     {"device", json_of(key.device)},
                     {"options", json_of(key.safety)},
                     {"tube_buttons", key.tube_buttons}};
  return json.dump();
}

Result<ReplayKey> parse_replay_key(const std::filesystem::path& file, std::string_view text,
                                   const std::vector<std::string>& more_kinds) {
  const Json json = Json::parse(text, nullptr, false);
  const auto foreign = [&] {
    return files::bad_input(file,
                            "does not say of which scene it is: it was not made by 'palpate feel'");
  };
  try {
    ReplayKey key;
    key.device = device_of(json.at("device"));
    key.safety = safety_of(json.at("options"));
    key.tube_buttons = json.contains("tube_buttons") ? buttons(json.at("tube_buttons"))
                                                     : older_tube_buttons(key.safety);
    auto scene = files::parse_scene(file, json.at("scene").dump(), more_kinds);
    if (!scene) return scene.error();
    key.scene = std::move(*scene);
    return key;
  } catch (const Json::exception&) {
    return foreign();
  } catch (const Foreign&) {
    return foreign();
  }
}

}  // namespace palpate::loading
