#pragma once

#include <cstdlib>
#include <string>

namespace palpate::files {

/// Runs a shell command and discards its output; true if its exit status is 0.
inline bool succeeds(const std::string& command) {
  return std::system((command + " > /dev/null 2>&1").c_str()) == 0;
}

/// A Python that has nibabel, or empty. Debian's own is tried too: another may be first in the
/// PATH.
inline std::string python_with_nibabel() {
  for (const char* python : {"python3", "/usr/bin/python3"})
    if (succeeds(std::string(python) + " -c 'import nibabel'")) return python;
  return {};
}

}  // namespace palpate::files
