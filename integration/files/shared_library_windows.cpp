#include <windows.h>

#include <system_error>

#include "integration/files/shared_library.h"

namespace palpate::files {

SharedLibrary::SharedLibrary(const std::filesystem::path& file)
    // With a folder, libraries that it needs are looked for in that folder first.
    : handle_(LoadLibraryExW(file.c_str(), nullptr,
                             file.is_absolute() ? LOAD_WITH_ALTERED_SEARCH_PATH : 0)) {
  if (!handle_) problem_ = std::system_category().message(int(GetLastError()));
}

SharedLibrary::Any SharedLibrary::symbol(const char* name) const {
  return handle_ ? reinterpret_cast<Any>(GetProcAddress(static_cast<HMODULE>(handle_), name))
                 : nullptr;
}

void SharedLibrary::close() {
  if (handle_) FreeLibrary(static_cast<HMODULE>(handle_));
  handle_ = nullptr;
}

}  // namespace palpate::files
