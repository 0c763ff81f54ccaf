#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The JSON of Haply's Inverse Service. Its axes are x right, y away from the user, z up, m and N;
/// here they are palpate's. Nothing here may be trusted: any text gives a value.
namespace palpate::devices::haply {

/// The key for a force, which changed between the versions 3.1 and 3.5.
enum class Wording { kVector, kValues };

/// The version from the answer to GET /version, in any of its forms. Without a version the newest
/// wording is used.
struct Version {
  int major = 0, minor = 0;
  bool known = false;
};
Version version_of(std::string_view body);
Wording wording_of(const Version& version);

/// Whether a service has presets, one of which puts the origin into the middle of the workspace.
bool has_presets(const Version& version);

/// The first message of a session: our name, and the service's default axes.
std::string first_message(const std::string& device_id, const Version& version);
/// One exchange: a force on the hand in palpate's axes, finite, N.
std::string force_message(const std::string& device_id, glm::dvec3 force_n, Wording wording);

/// One device in a message of the service. Values that the message lacks are empty.
struct DeviceState {
  std::string id;
  std::string type;                      ///< "inverse3", "minverse", ...
  std::optional<glm::dvec3> position_m;  ///< of the cursor, palpate's axes; finite
  std::optional<bool> calibrated, in_use, ready, powered;
};

struct HaplyState {
  std::vector<DeviceState> devices;
  uint32_t buttons = 0;  ///< of all grips together
};
/// Nothing if the text is no message of the service.
std::optional<HaplyState> state_of(std::string_view text);

/// What an event is about.
enum class Event {
  kOther,
  kConnected,
  kDisconnected,
  kBusy,
  kNotCalibrated,
  kBrakeOn,
  kBrakeOff,
  kStalled,
};
struct DeviceEvent {
  Event event = Event::kOther;
  std::string id;  ///< of the device; empty: it does not say
};
DeviceEvent event_of(std::string_view text);

}  // namespace palpate::devices::haply
