#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/devices/emulated_hand.h"

namespace palpate::devices::test {

/// A Polhem's firmware at the other end of a pseudo-terminal, as its makers' interface describes
/// it, written independently of the code under test: it answers each line with one line.
class EmulatedPolhem final : public EmulatedHand {
 public:
  EmulatedPolhem();
  ~EmulatedPolhem() override;

  /// The port: a link whose name stays the same when it is plugged in again.
  std::string port() const { return link_; }
  void plug();
  void unplug();

  void place(glm::dvec3 position_m) override;
  size_t received_count() const override;
  bool pushed(size_t command) const override;
  /// The newest force, in palpate's axes.
  glm::dvec3 force_n() const;
  /// Lines that were no command.
  size_t malformed() const;

  /// Faults. Each stays until it is changed.
  struct Faults {
    bool silent = false;
    /// Before each answer.
    int64_t delay_ns = 0;
    /// 1: it needs calibration.
    int info = 0;
    size_t line_bytes = 64;
    /// Bytes per write, with a pause between; 0: all at once.
    size_t torn = 0;
    /// Changes a line.
    std::function<std::string(std::string)> mangle;
  };
  void change_faults(const std::function<void(Faults&)>& change);
  void heal() {
    change_faults([](Faults& faults) { faults = {}; });
  }

 private:
  void serve();
  void obey(const std::string& line);
  std::string answer() const;
  void write_bytes(const std::string& bytes, size_t torn) const;

  mutable std::mutex mutex_;
  Faults faults_;
  glm::dvec3 place_m_{0.0};
  std::vector<glm::dvec3> received_;
  size_t malformed_ = 0;

  std::string folder_, link_;
  int master_ = -1, kept_ = -1;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace palpate::devices::test
