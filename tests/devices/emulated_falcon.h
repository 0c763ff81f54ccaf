#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>

#include "tests/devices/emulated_hand.h"
#include "tests/devices/emulated_usb.h"

namespace palpate::devices::test {

/// A Falcon as its protocol describes it, written independently of the code under test: the serial
/// converter with its status bytes, 62-byte payloads, latency timer and event character; the boot
/// loader; the firmware with packets, homing and encoders.
class EmulatedFalcon : public EmulatedDevice, public EmulatedHand {
 public:
  struct Options {
    std::string product_name = "FALCON HAPTIC";
    int port = 1;
    /// Whether the firmware runs already.
    bool firmware = true;
    bool homed = true;
    /// The image that its loader accepts.
    Bytes image;
    int64_t answer_delay_ns = 0;  ///< wire and firmware, from command to answer
  };
  explicit EmulatedFalcon(Options options);
  EmulatedFalcon() : EmulatedFalcon(Options()) {}
  ~EmulatedFalcon() override { stop(); }

  /// A command as the device decoded it.
  struct Received {
    std::array<int, 3> motors{};
    int lights = 0;
    bool homing = false;
    bool pushes() const { return motors != std::array<int, 3>{}; }
  };
  /// All commands so far; the newest last.
  std::vector<Received> received() const;
  Received last() const;
  size_t received_count() const override;
  bool pushed(size_t command) const override;
  /// Bytes that were no command.
  size_t malformed() const;

  using EmulatedDevice::place;
  /// Moves the grip to a place.
  void place(glm::dvec3 position) override;
  void set_counts(std::array<int, 3> counts);
  std::array<int, 3> counts() const;
  void press(int buttons);
  void lose_homing();
  /// The firmware is lost with the power; it stays plugged in.
  void power_cycle();

  /// Faults. Each stays until it is changed.
  struct Faults {
    /// Takes commands, sends no answers.
    bool silent = false;
    bool stall_in = false, stall_out = false;  ///< until the halt is cleared
    bool stalls_for_good = false;              ///< clearing does not help
    bool refuses_commands = false;             ///< the OUT endpoint never takes them
    bool no_event_character = false;           ///< the request is refused
    bool stall_control = false;                ///< every vendor request
    bool ends_with_error = false;              ///< reads end with a bus error
    bool mute_status = false;                  ///< not even the status bytes come
    int stuck_encoder = -1;
    /// So many greetings of the loader fail.
    int failing_uploads = 0;
    size_t packet_limit = 62;  ///< payload of one packet: smaller splits answers
    /// Changes each answer.
    std::function<Bytes(Bytes)> mangle;
  };
  void set(Faults faults);
  void change(const std::function<void(Faults&)>& change);
  /// Each of the next answers is delayed by its own time.
  void delay_next(std::deque<int64_t> delays_ns);

  int uploads() const;
  bool runs_firmware() const;
  bool event_character_on() const;
  int latency_ms() const;

 protected:
  int control(uint8_t type, uint8_t request, uint16_t value, const Bytes& out, Bytes& in) override;
  int take(const Bytes& bytes) override;
  int64_t serve(int64_t now_ns) override;
  void cleared_halt(uint8_t endpoint) override;
  void plugged() override;

 private:
  void load(const Bytes& bytes);
  void obey();
  void home(bool homing);
  Bytes answer() const;
  void say(const Bytes& bytes, int64_t delay_ns);
  int reported(int encoder) const;

  const Options options_;
  Faults faults_;
  std::vector<Received> received_;
  size_t malformed_ = 0;

  // the converter
  int baud_ = 0, latency_ms_ = 16, event_character_ = -1;
  bool dtr_ = true, flush_ = false;
  int64_t last_packet_ns_ = 0;
  /// On the wire, with the time of arrival.
  std::deque<std::pair<int64_t, Bytes>> coming_;
  /// In the chip, for the host.
  Bytes buffer_;
  std::deque<int64_t> delays_ns_;  ///< of the next answers
  /// From the host, not yet a whole packet.
  Bytes commands_;

  // the firmware and the arms
  bool running_ = false;
  bool greeted_ = false, loading_ = false;
  Bytes loaded_;
  int uploads_ = 0;
  std::array<int, 3> counts_{}, offset_{};
  std::array<bool, 3> homed_{}, was_out_{};
  int buttons_ = 0;
  std::array<int, 3> stuck_at_{};
};

}  // namespace palpate::devices::test
