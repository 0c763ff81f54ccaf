#pragma once

#include <atomic>
#include <functional>
#include <glm/glm.hpp>
#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/devices/emulated_hand.h"

namespace palpate::devices::test {

/// Haply's Inverse Service as its documents describe it, written independently of the code under
/// test: a WebSocket server (RFC 6455) and GET /version on one port of this machine, events on
/// another. One state for each message; a force is valid for that message only.
class EmulatedHaply : public EmulatedHand {
 public:
  struct Options {
    std::string version = "3.5.0";  ///< below 3.2 a force is called "values"; below 3.5: no presets
    std::string id = "049D", type = "inverse3";
    /// Whether the device is connected to the service.
    bool connected = true;
    bool in_use = false, calibrated = true, ready = true, powered = true;
    /// 0: any free port.
    uint16_t port = 0, events_port = 0;
    /// Whether GET /version is answered.
    bool knows_version = true;
  };
  explicit EmulatedHaply(Options options);
  EmulatedHaply() : EmulatedHaply(Options()) {}
  ~EmulatedHaply() override;

  uint16_t port() const { return port_; }
  uint16_t events_port() const { return events_port_; }

  void place(glm::dvec3 position_m) override;
  size_t received_count() const override;
  bool pushed(size_t command) const override;
  /// The newest force on the hand, in palpate's axes.
  glm::dvec3 force_n() const;
  /// Messages that broke a rule: not masked, not text, not JSON, or a word of another version.
  std::vector<std::string> broken_rules() const;
  std::string profile() const;  ///< of the session
  /// The number of sessions so far.
  size_t sessions() const;
  void press(bool down);

  /// Stops the service, and starts it again on the same ports.
  void stop_service();
  void start_service();
  void change(const std::function<void(Options&)>& change);
  /// Sends an event to all listeners.
  void tell(const nlohmann::json& event);
  /// Closes the connections of listeners to events, and no other.
  void drop_listeners();
  /// Connections for events so far.
  size_t listeners() const;

  /// Faults. Each stays until it is changed.
  struct Faults {
    /// Takes messages, sends no states.
    bool silent = false;
    /// Accepts connections, and answers them.
    bool accepts = true;
    /// Before each state.
    int64_t delay_ns = 0;
    size_t fragment = 0;  ///< bytes per frame; 0: one frame
    /// Bytes per write, with a pause between; 0: all at once.
    size_t torn = 0;
    bool pings = false;  ///< one before each state
    int copies = 1;      ///< of each state
    /// Changes the text of a state.
    std::function<std::string(std::string)> mangle;
    /// Bytes to send instead of a frame.
    std::string raw;
  };
  void set(Faults faults);
  void change_faults(const std::function<void(Faults&)>& change);

 private:
  struct Connection {
    int file = -1;
    bool events = false;
    bool upgraded = false;
    bool configured = false;  ///< has a preset
    std::string in;
  };
  using Lock = std::unique_lock<std::recursive_mutex>;
  void serve();
  bool hear(Connection& connection);
  bool upgrade(Connection& connection);
  bool take_frame(Connection& connection, bool& any);
  void obey(Connection& connection, const std::string& text);
  nlohmann::json state(const Connection& connection, bool all) const;
  void say(Connection& connection, const std::string& text);
  void write(Connection& connection, const std::string& bytes);
  void break_rule(const std::string& what);

  mutable std::recursive_mutex mutex_;
  Options options_;
  Faults faults_;
  glm::dvec3 place_m_{0.0};
  bool pressed_ = false;
  std::vector<glm::dvec3> received_;
  std::vector<std::string> broken_;
  std::string profile_;
  size_t sessions_ = 0, listeners_ = 0;
  std::list<Connection> connections_;

  uint16_t port_ = 0, events_port_ = 0;
  int listen_ = -1, listen_events_ = -1;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace palpate::devices::test
