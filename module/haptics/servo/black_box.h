#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "module/haptics/servo/servo_loop.h"

namespace palpate {

struct BlackBoxOptions {
  std::filesystem::path folder = ".";     ///< made when there is something to put into it
  int ticks = 1000;                       ///< kept
  int ticks_after = 100;                  ///< of them, after the one that tripped
  int64_t least_gap_ns = 10'000'000'000;  ///< between two files
};

/// True for causes that a person wants explained: faults. False for a start, a stop, a fade, or a
/// hand that let go.
bool is_trip(Cause cause, DeviceFault fault) noexcept;

/// Keeps the last ticks, and writes them as a table when something trips: one file per trip, not
/// more often than every ten seconds of the ticks' own clock. Give it to a Recorder as a listener.
/// One thread at a time.
class BlackBox final : public TickListener {
 public:
  explicit BlackBox(BlackBoxOptions options);

  /// Writes the file once the ticks after a trip are there.
  void hear(const TickInput& input, const TickOutput& output) noexcept override;

  /// Writes the last ticks although nothing tripped; `why` is part of the file's name.
  void write_last(const std::string& why);

  const std::vector<std::filesystem::path>& files() const { return files_; }
  /// Why the last file could not be written: one sentence, or nothing.
  const std::optional<std::string>& trouble() const { return trouble_; }
  /// Trips without a file: too soon after another one.
  uint64_t skipped() const { return skipped_; }

 private:
  /// trip: the index of the tick that is number 0 in the table.
  void write(const std::string& why, int trip);

  BlackBoxOptions options_;
  std::vector<HeardTick> ticks_;  ///< a ring
  size_t next_ = 0, count_ = 0;
  Cause cause_ = Cause::kNone;
  int ticks_to_go_ = 0;  ///< until the file is due; 0: nothing has tripped
  DeviceFault last_fault_ = DeviceFault::kNone;
  bool was_tripped_ = true;  ///< a device that is missing from the start is no event
  std::optional<int64_t> last_file_ns_;
  uint64_t skipped_ = 0;
  std::vector<std::filesystem::path> files_;
  std::optional<std::string> trouble_;
};

}  // namespace palpate
