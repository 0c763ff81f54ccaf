#pragma once

#include <filesystem>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

/// Calling programs, and a folder for their files.
namespace palpate::report {

/// A folder for temporary files that is removed when it goes out of scope. Its path is empty if
/// none could be made.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// How long to wait for another program.
struct Patience {
  /// After a stop request the wait ends at once.
  std::stop_token stop;
  double seconds = std::numeric_limits<double>::infinity();
  /// The time that a program gets to clean up after it was told to end.
  double grace_s = 2.0;
};

/// Starts a program (found on the PATH if its name has no slash), without a shell and without
/// input, and waits for it. Its output goes to the two files, which may be one. Returns 0 if its
/// exit status is 0, -1 if it is not, or an error number: ENOENT, it is not installed; ECANCELED
/// and ETIMEDOUT, the wait ended, and it and all programs that it started have been ended. Any
/// thread; signals that the caller blocks are not blocked in the program.
int call_program(const std::vector<std::string>& arguments, const std::filesystem::path& output,
                 const std::filesystem::path& complaints, const Patience& patience = {});

/// The content of a file; empty if it can not be read.
std::string text_of(const std::filesystem::path& file);

}  // namespace palpate::report
