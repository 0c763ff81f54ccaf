#pragma once

#include <sys/types.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::app {

/// The result of a run of the program.
struct Outcome {
  int exit_code = -1;  ///< -1 if a signal ended it
  std::string out;
  std::string err;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// The built program, started as a user starts it, but without a shell.
class Program {
 public:
  explicit Program(const std::vector<std::string>& arguments);

  /// Waits until `text` is on stdout; false if the program ends before.
  bool wait_for(const std::string& text);
  /// The text on stdout until now.
  std::string said() const;
  bool ended();
  void signal(int number);
  /// True once the program handles this signal itself.
  bool handles(int number) const;
  Outcome wait();

 private:
  /// Contains the output files.
  files::TemporaryFolder folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// Polls a condition every 20 ms; false after two minutes, which a busy machine may need.
bool wait_until(const std::function<bool()>& done);

inline Outcome run(const std::vector<std::string>& arguments) {
  return Program(arguments).wait();
}

/// As run(), for a run with a simulated hand, whose time passes as fast as it is computed where it
/// waits for nothing else: for tests of something else than real time.
Outcome run_computed(const std::vector<std::string>& arguments);

/// The commands that --help lists, and their subcommands: {"motion"}, ..., {"chart", "stability"}.
std::vector<std::vector<std::string>> commands();

/// Whether the program itself finds a device for computing.
bool has_device();

}  // namespace palpate::app

/// Skips the test, with a message, if there is no device for computing.
#define NEEDS_DEVICE() \
  if (!palpate::app::has_device()) GTEST_SKIP() << "There is no usable Vulkan device here."
