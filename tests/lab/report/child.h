#pragma once

#include <filesystem>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

/// Programs that are called, and the folder in which they work.
namespace palpate::report {

/// A folder for temporary files that goes when it goes out of scope. Its path is empty where none
/// could be made.
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

/// How long to wait for work that someone else does.
struct Patience {
  std::stop_token stop;  ///< asked to stop, it ends at once
  double seconds = std::numeric_limits<double>::infinity();
  double grace_s = 2.0;  ///< what is asked to end may put its things away for so long
};

/// Starts a program (found by PATH where its name has no slash), without a shell and without input,
/// and waits for it. What it prints goes to the two files, which may be one. Returns 0 if it ended
/// well, -1 if it did not, or an error number: ENOENT, it is not installed; ECANCELED and
/// ETIMEDOUT, patience ran out, and it and all programs that it started have been ended. Any
/// thread; signals that the caller blocks are not blocked in the program.
int call_program(const std::vector<std::string>& arguments, const std::filesystem::path& output,
                 const std::filesystem::path& complaints, const Patience& patience = {});

/// Everything in a file; empty where it can not be read.
std::string text_of(const std::filesystem::path& file);

}  // namespace palpate::report
