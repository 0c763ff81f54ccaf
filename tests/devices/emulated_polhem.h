#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/devices/emulated_hand.h"

namespace palpate::devices::test {

/// A Polhem's firmware at the far end of a pseudo-terminal, as its makers' interface describes it,
/// written apart from the code under test: it speaks when it is spoken to, a line for a line.
class EmulatedPolhem final : public EmulatedHand {
 public:
  EmulatedPolhem();
  ~EmulatedPolhem() override;

  /// The port: a link that stays the same when it is plugged in again.
  std::string port() const { return link_; }
  void plug();
  void unplug();

  void place(glm::dvec3 position_m) override;
  size_t received_count() const override;
  bool pushed(size_t command) const override;
  glm::dvec3 force_n() const;  ///< the newest, palpate's axes
  size_t malformed() const;    ///< lines that were no command

  /// What goes wrong. Each stays until it is changed.
  struct Faults {
    bool silent = false;
    int64_t delay_ns = 0;  ///< before each answer
    int info = 0;          ///< 1: it asks to be calibrated
    size_t line_bytes = 64;
    size_t torn = 0;  ///< bytes per write, a moment between them; 0: all at once
    std::function<std::string(std::string)> mangle;  ///< what becomes of a line
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
