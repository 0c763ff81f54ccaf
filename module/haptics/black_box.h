#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/background.h"
#include "module/haptics/servo_loop.h"

namespace palpate {

struct BlackBoxOptions {
  std::filesystem::path folder = ".";     ///< made when there is something to put into it
  int ticks = 1000;                       ///< kept
  int ticks_after = 100;                  ///< of them, after the one that tripped
  int64_t least_gap_ns = 10'000'000'000;  ///< between two files
};

/// True for the causes after which a person asks what happened: a fault, not a start, a stop, a
/// fade, or a hand that went away.
bool is_trip(Cause cause, DeviceFault fault) noexcept;

/// Keeps the last ticks, and writes them as a table when something trips: one file per trip, not
/// more often than every ten seconds, from a thread of its own. Give it to a Servo as a listener;
/// it must live longer.
class BlackBox : public TickListener {
 public:
  /// by_itself: with a thread that calls write_due(). Without, the caller does.
  explicit BlackBox(BlackBoxOptions options, bool by_itself = true);
  ~BlackBox() override;

  /// Real-time safe.
  void hear(const TickInput& input, const TickOutput& output) noexcept override;

  /// Writes what is there to be written; now_ns is of any clock that rises. One thread.
  void write_due(int64_t now_ns);

  /// Writes the last ticks although nothing tripped; `why` is part of the file's name. After the
  /// Servo has stopped.
  void write_last(const std::string& why);

  /// Any thread but the servo's.
  std::vector<std::filesystem::path> files() const;
  /// Why the last file could not be written: one sentence, or nothing.
  std::optional<std::string> trouble() const;
  /// Trips without a file: too soon after another one.
  uint64_t skipped() const { return skipped_.load(std::memory_order_relaxed); }

 private:
  struct Entry {
    TickInput input;
    TickOutput output;
  };
  /// Belongs to the servo thread, or, while full, to the writer.
  struct Box {
    std::vector<Entry> entries;  ///< a ring
    size_t next = 0, count = 0;
    Cause cause = Cause::kNone;
    std::atomic<bool> full{false};
  };
  /// trip: the index of the tick that is number 0 in the table.
  void write(const Box& box, const std::string& why, int trip);

  BlackBoxOptions options_;
  std::array<Box, 2> boxes_;
  size_t current_ = 0;
  int ticks_to_go_ = 0;  ///< until the box is full; 0: nothing has tripped
  DeviceFault last_fault_ = DeviceFault::kNone;
  bool was_tripped_ = true;  ///< a device that is missing from the start is no event
  std::atomic<uint64_t> skipped_{0};

  int64_t last_file_ns_ = 0;
  mutable std::mutex mutex_;  ///< of what follows; never the servo thread's
  std::vector<std::filesystem::path> files_;
  std::optional<std::string> trouble_;
  std::unique_ptr<Background> background_;  ///< last: it ends first
};

}  // namespace palpate
