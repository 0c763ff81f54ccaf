#include "tests/app/fuzz/replay_key_bytes.h"

#include <cmath>

#include "integration/loading/replay_key.h"
#include "tests/support/require.h"

namespace palpate::app::fuzz {

using loading::parse_replay_key;

void parse_replay_key_bytes(std::string_view bytes) {
  const auto key = parse_replay_key("fuzz.ticks", bytes);
  if (!key) {
    require(key.error().message.find("fuzz.ticks") != std::string::npos, "an error names the file");
    return;
  }
  const DeviceInfo& device = key->device;
  for (const double value :
       {device.max_force_n, device.max_stiffness_n_per_m, device.workspace_radius_m, device.delay_s,
        key->safety.max_force_n, key->safety.max_speed_m_per_s, key->safety.late_s,
        key->safety.stale_s})
    require(std::isfinite(value) && value >= 0.0, "limits and times are not below zero");
  for (int axis = 0; axis < 3; ++axis)
    require(std::isfinite(device.workspace_centre_m[axis]), "places are finite");
  require(!key->scene.volumes.empty(), "there is something to feel");
  // A key that was read can be written and read again.
  const std::string text = text_of(*key);
  const auto again = parse_replay_key("fuzz.ticks", text);
  require(bool(again) && text_of(*again) == text, "it is the same when written");
}

}  // namespace palpate::app::fuzz
