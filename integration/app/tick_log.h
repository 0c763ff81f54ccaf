#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "compute/volume/result.h"
#include "module/haptics/background.h"
#include "module/haptics/mailbox.h"
#include "module/haptics/servo_loop.h"

namespace palpate::app {

/// What is kept of a tick for summary and pictures. Space: force of the device, places of the
/// world.
struct TickRow {
  double time_s = 0.0;  ///< since the first tick
  double dt_s = 0.0;
  glm::dvec3 force_n{0.0};   ///< to the device
  glm::dvec3 wanted_n{0.0};  ///< the spring's
  glm::dvec3 probe_m{0.0}, proxy_m{0.0};
  double pointer = 0.0;  ///< frame + phase of the first moving volume
  double residual_m = 0.0;
  double scene_energy_j = 0.0;
  Cause cause = Cause::kNone;
  DeviceFault fault = DeviceFault::kNone;
  uint8_t newton_steps = 0;
  bool in_contact = false;
  bool held = false;
};

/// Keeps every tick of a run, and writes them as CSV if asked. The servo thread hands them over
/// without waiting; a thread of its own takes them. What did not fit is counted. Must outlive the
/// Servo.
class TickLog final : public TickListener {
 public:
  /// `csv` may be empty. kBadOutput if it can not be written.
  static Result<std::unique_ptr<TickLog>> start(const std::filesystem::path& csv);
  /// Real-time safe.
  void hear(const TickInput& input, const TickOutput& output) noexcept override;

  /// After the Servo has stopped: takes what is left and closes the CSV. kBadOutput if it is not
  /// whole. Afterwards rows() are complete.
  Status finish();
  const std::vector<TickRow>& rows() const { return rows_; }
  uint64_t lost() const { return ring_.dropped(); }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void drain();
  void write(const TickRow& row);

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
  bool failed_ = false;
  Ring<TickRow, 8192> ring_;
  int64_t first_ns_ = 0;
  bool any_ = false;
  std::vector<TickRow> rows_;
  std::unique_ptr<Background> background_;
};

}  // namespace palpate::app
