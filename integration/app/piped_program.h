#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace palpate::app {

/// What came of starting a program.
enum class ProgramStart { kRuns, kNotThere, kFailed };

/// A program of the system that runs beside this one and reads what it is sent. Its standard output
/// goes nowhere, its complaints are kept. One thread.
class PipedProgram {
 public:
  PipedProgram();
  PipedProgram(PipedProgram&&) noexcept;
  /// Ends it if it still runs.
  ~PipedProgram();

  /// By its name, as the system finds it, with the words behind it. kFailed: `problem` says why.
  ProgramStart start(const std::vector<std::string>& words, std::string& problem);
  /// Waits while it can take no more. False: it reads no longer.
  bool write(const void* bytes, size_t n);
  /// Ends its input and waits for its end. True if it says that all went well.
  bool finish();
  /// After finish(): the beginning of what it wrote to its standard error.
  std::string complaints() const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace palpate::app
