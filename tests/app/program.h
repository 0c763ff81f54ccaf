#pragma once

#include <sys/types.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace palpate::app {

/// What a run of the program left behind.
struct Outcome {
  int exit_code = -1;  ///< -1 if a signal ended it
  std::string out;
  std::string err;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// The built program, started as a user starts it, without a shell between.
class Program {
 public:
  explicit Program(const std::vector<std::string>& arguments);

  /// Waits until `text` stands on stdout; false if the program ends before.
  bool wait_for(const std::string& text);
  /// What stands on stdout by now.
  std::string said() const;
  bool ended();
  void signal(int number);
  /// True once the program handles this signal itself.
  bool handles(int number) const;
  Outcome wait();

 private:
  files::TemporaryFolder folder_;  ///< holds what it prints
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// Asks every 20 ms whether what another program does is done; false after two minutes, which a
/// busy machine may need.
bool wait_until(const std::function<bool()>& done);

inline Outcome run(const std::vector<std::string>& arguments) {
  return Program(arguments).wait();
}

/// The commands that --help lists, and those below them: {"motion"}, ..., {"chart", "stability"}.
std::vector<std::vector<std::string>> commands();

/// Whether there is a device to compute with, as the program itself sees it.
bool has_device();

}  // namespace palpate::app

/// Skips, and says so, where there is nothing to compute with.
#define NEEDS_DEVICE() \
  if (!palpate::app::has_device()) GTEST_SKIP() << "There is no usable Vulkan device here."
