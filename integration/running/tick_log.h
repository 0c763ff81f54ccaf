#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/running/feel_numbers.h"
#include "module/haptics/servo/servo_loop.h"

namespace palpate::running {

/// Collects the numbers of a run for summary and pictures, and writes every tick as CSV if asked.
/// Its memory does not grow. Register it with a Recorder as a listener.
class TickLog final : public TickListener {
 public:
  /// `csv` may be empty. Errors: kBadOutput if it can not be written.
  static Result<std::unique_ptr<TickLog>> start(const std::filesystem::path& csv);
  void hear(const TickInput& input, const TickOutput& output) noexcept override;

  /// Closes the CSV; call it after the Recorder has finished. Errors: kBadOutput if the file is not
  /// complete.
  Status finish();
  FeelNumbers numbers() const { return counter_.numbers(); }
  const std::vector<TickRow>& rows() const { return history_.rows(); }

 private:
  struct CloseTable {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void write(const TickRow& row, const TickOutput& output);

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, CloseTable> file_;
  bool failed_ = false;
  int64_t first_ns_ = 0;
  bool any_ = false;
  FeelCounter counter_;
  TickHistory history_;
};

}  // namespace palpate::running
