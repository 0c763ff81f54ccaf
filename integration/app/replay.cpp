#include "integration/app/replay.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "integration/files/scene_file.h"
#include "integration/files/sentences.h"
#include "module/haptics/haptic_scene.h"

namespace palpate::app {
namespace {

using Json = nlohmann::json;

Json json_of(const DeviceInfo& d) {
  return {{"max_force_n", d.max_force_n},
          {"max_stiffness_n_per_m", d.max_stiffness_n_per_m},
          {"centre_m", {d.workspace_centre_m.x, d.workspace_centre_m.y, d.workspace_centre_m.z}},
          {"radius_m", d.workspace_radius_m},
          {"delay_s", d.delay_s}};
}

/// What the command line may change of the options.
Json json_of(const HapticsOptions& o) {
  return {{"max_force_n", o.safety.max_force_n},
          {"late_s", o.safety.late_s},
          {"stale_s", o.safety.stale_s},
          {"dead_man", o.safety.dead_man},
          {"dead_man_buttons", o.safety.dead_man_buttons},
          {"seen_buttons", o.safety.seen_buttons}};
}

DeviceInfo device_of(const Json& j) {
  DeviceInfo device;
  device.max_force_n = j.at("max_force_n");
  device.max_stiffness_n_per_m = j.at("max_stiffness_n_per_m");
  const auto& centre = j.at("centre_m");
  device.workspace_centre_m = {centre.at(0), centre.at(1), centre.at(2)};
  device.workspace_radius_m = j.at("radius_m");
  device.delay_s = j.at("delay_s");
  return device;
}

HapticsOptions options_of(const Json& j) {
  HapticsOptions options;
  options.safety.max_force_n = j.at("max_force_n");
  options.safety.late_s = j.at("late_s");
  options.safety.stale_s = j.at("stale_s");
  options.safety.dead_man = j.at("dead_man");
  options.safety.dead_man_buttons = j.at("dead_man_buttons");
  options.safety.seen_buttons = j.at("seen_buttons");
  return options;
}

}  // namespace

std::string replay_key(const FeltScene& scene, const DeviceInfo& device,
                       const HapticsOptions& options) {
  const Json key = {{"scene", Json::parse(files::scene_text(scene.spec))},
                    {"device", json_of(device)},
                    {"options", json_of(options)}};
  return key.dump();
}

Result<Replay> replay_felt(const FeltScene& felt, const std::filesystem::path& file) {
  auto recording = Recording::read(file);
  if (!recording) return recording.error();
  const Json key = Json::parse(recording->scene(), nullptr, false);
  DeviceInfo device;
  HapticsOptions options;
  SceneSpec spec;
  try {
    device = device_of(key.at("device"));
    options = options_of(key.at("options"));
    auto parsed = files::parse_scene(file, key.at("scene").dump());
    if (!parsed) return parsed.error();
    spec = std::move(*parsed);
  } catch (const Json::exception&) {
    return files::bad_input(file,
                            "does not say of which scene it is: it was not made by 'palpate feel'");
  }
  bool same = spec.volumes.size() == felt.spec.volumes.size();
  for (size_t v = 0; same && v < spec.volumes.size(); ++v)
    same = spec.volumes[v].name == felt.spec.volumes[v].name;
  if (!same)
    return files::bad_input(file, "was made with another scene: name the scene that was felt");
  // The recorded words, with their places and stiffness, on the data that were read now.
  auto assembled = assemble(spec, felt.data);
  if (!assembled) return assembled.error();
  Haptics haptics(options, device);
  haptics.adopt(Haptics::prepare(*assembled));
  return replay(*recording, haptics);
}

std::string replay_text(const Replay& replay) {
  if (replay.different == 0) return "every output is the recorded one, bit by bit";
  return fmt::format(
      "{} outputs differ, the first in tick {} in its {}: other data, or another build?",
      replay.different, replay.first_different, replay.first_field);
}

}  // namespace palpate::app
