#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "integration/devices/device_link.h"
#include "integration/devices/mailbox_device.h"

namespace palpate::devices {

struct HaplyOptions {
  std::string host = "localhost";      ///< where Haply's Inverse Service runs
  uint16_t port = 10001;               ///< of its simulation channel
  uint16_t events_port = 10020;        ///< of its events; 0: they are not listened to
  std::string device_id;               ///< "049D": only this one; empty: the first
  int64_t answer_wait_ns = 3'300'000;  ///< per exchange: three without an answer are 10 ms
  int64_t open_wait_ns = 1'000'000'000;
};

/// Haply's Inverse3, Inverse3x and Minverse, through the service that their maker installs: JSON
/// over a WebSocket on this machine, one state for each message. Services from 3.1 on are spoken to
/// (the word for a force changed meanwhile); GET /version says which it is.
///
/// The service is asked to put the origin into the middle of the workspace; one that can not
/// (before 3.5) gives no such place, and the grip's place when it is first opened is taken for it.
///
/// What it says of the device becomes a fault: in use by another session when it is opened (kBusy),
/// not calibrated (kNotHomed), not ready or without power (kStarting), disconnected (kUnplugged),
/// its brake (kForceOff) or a stall (kStuck).
std::unique_ptr<DeviceLink> make_haply_link(const HaplyOptions& options);

/// Whether something listens at the service's address. Takes no longer than a tenth of a second.
bool haply_service_answers(const HaplyOptions& options);

}  // namespace palpate::devices
