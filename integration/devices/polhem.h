#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "integration/devices/device_link.h"

namespace palpate::devices {

struct PolhemOptions {
  std::string port;  ///< "/dev/ttyACM0": only that one; empty: the first that answers
  int64_t answer_wait_ns = 3'300'000;  ///< per exchange: three without an answer are 10 ms
  int64_t open_wait_ns = 300'000'000;  ///< for the first answer of a port
};

/// A Polhem of Haptikfabriken, or another WoodenHaptics device with its firmware: open hardware, a
/// Teensy that is a serial port (USB 16c0:0483). One line there, one line back. The firmware makes
/// forces of millinewtons and places of its encoders.
///
/// A port that does not answer in its words is closed again, and one of a maker who has a service
/// of its own (Haply) is left alone. A device that asks to be calibrated is kNotHomed.
std::unique_ptr<DeviceLink> make_polhem_link(const PolhemOptions& options);

/// Ports that may have one behind them, as the system names them, in its order.
std::vector<std::string> polhem_ports();

}  // namespace palpate::devices
