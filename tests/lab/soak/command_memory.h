#pragma once

#include <cstddef>
#include <string>

namespace palpate::soak {

/// `palpate feel heart` as a process of its own, with a CSV that is not kept, during the object's
/// life: shows whether its memory grows.
class CommandMemory {
 public:
  /// Starts the program for so many seconds.
  CommandMemory(const std::string& program, double seconds);
  /// Ends it, if it still runs.
  ~CommandMemory();
  CommandMemory(const CommandMemory&) = delete;
  CommandMemory& operator=(const CommandMemory&) = delete;

  /// The process's resident size; 0 once it has ended.
  size_t resident_bytes() const;

 private:
  int pid_ = -1;
};

}  // namespace palpate::soak
