#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "integration/loading/replay_key.h"
#include "integration/running/tick_log.h"
#include "module/haptics/servo/black_box.h"
#include "module/haptics/servo/recording.h"

namespace palpate::running {

/// What is kept of the ticks of a session.
struct FlightRecorderOptions {
  bool sums_up = false;  ///< numbers and rows for a summary, also without a table
  std::optional<std::filesystem::path> table;      ///< CSV file with every tick
  std::optional<std::filesystem::path> recording;  ///< file with all that the loop depends on
  std::optional<std::filesystem::path> black_box;  ///< folder for the ticks around a fault
};

/// Hears the ticks of a session and writes them: one ring, which the servo thread fills, and one
/// thread that passes them on to the table, the recording and the black box. Outlives the session.
class FlightRecorder {
 public:
  FlightRecorder() = default;  // keeps nothing
  /// `key` identifies the scene in the recording. kBadInput, kBadOutput.
  static Result<FlightRecorder> start(const FlightRecorderOptions& options,
                                      const loading::ReplayKey& key);

  /// For the servo loop; null if nothing is kept.
  TickListener* listener() { return recorder_.get(); }
  /// How many ticks are not written yet: a loop whose time is computed waits for these. Any thread.
  uint64_t waiting() const { return recorder_ ? recorder_->waiting() : 0; }
  /// After the session has stopped, once: closes table and recording. kBadOutput if one is not
  /// complete.
  Status finish();

  /// The numbers and rows of the run; null if they are not wanted. After finish().
  const TickLog* log() const { return log_.get(); }
  /// Null if it is not wanted. After finish().
  BlackBox* black_box() { return black_box_.get(); }
  /// A sentence if table or recording lack ticks. After finish().
  std::optional<std::string> lost() const;

 private:
  std::unique_ptr<TickLog> log_;
  std::unique_ptr<BlackBox> black_box_;
  std::unique_ptr<TickRecorder> recorder_;  ///< passes ticks on to the two above
  bool needs_every_tick_ = false;
};

}  // namespace palpate::running
