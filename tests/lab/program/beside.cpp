#include "tests/lab/program/beside.h"

#include <unistd.h>

#include <cstdlib>
#include <sstream>
#include <string>

namespace palpate::app {

namespace fs = std::filesystem;

std::optional<fs::path> program_beside(const char* name) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (error) return std::nullopt;
  const fs::path program = self.parent_path() / name;
  return ::access(program.c_str(), X_OK) == 0 ? std::optional(program) : std::nullopt;
}

bool on_path(const char* name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access((fs::path(folder) / name).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace palpate::app
