#include "integration/files/state_folder.h"

#include <cstdlib>

namespace palpate::files {

namespace fs = std::filesystem;

fs::path state_folder() {
#ifdef _WIN32
  const wchar_t* const local = _wgetenv(L"LOCALAPPDATA");
  return local && *local ? fs::path(local) / "palpate" : fs::path();
#else
  const char* state = std::getenv("XDG_STATE_HOME");
  // XDG rule: a path that is not absolute is ignored.
  if (state && fs::path(state).is_absolute()) return fs::path(state) / "palpate";
  const char* home = std::getenv("HOME");
  if (home && *home) return fs::path(home) / ".local/state/palpate";
  return {};
#endif
}

}  // namespace palpate::files
