#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "compute/volume/result.h"
#include "integration/sessions/feel_numbers.h"
#include "module/haptics/background.h"
#include "module/haptics/mailbox.h"
#include "module/haptics/servo_loop.h"

namespace palpate::sessions {

/// Sums up a run for its summary and pictures, and writes every tick as CSV if asked. Its memory
/// does not grow with the run. The servo thread hands them over
/// without waiting; a thread of its own takes them. What did not fit is counted. Must outlive the
/// Servo.
class TickLog final : public TickListener {
 public:
  /// `csv` may be empty. kBadOutput if it can not be written.
  static Result<std::unique_ptr<TickLog>> start(const std::filesystem::path& csv);
  /// Real-time safe.
  void hear(const TickInput& input, const TickOutput& output) noexcept override;

  /// After the Servo has stopped: takes what is left and closes the CSV. kBadOutput if it is not
  /// whole. Afterwards numbers() and rows() are complete.
  Status finish();
  FeelNumbers numbers() const { return counter_.numbers(); }
  const std::vector<TickRow>& rows() const { return history_.rows(); }
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
  FeelCounter counter_;
  TickHistory history_;
  std::unique_ptr<Background> background_;
};

}  // namespace palpate::sessions
