#include <dlfcn.h>

#include "integration/files/shared_library.h"

namespace palpate::files {

SharedLibrary::SharedLibrary(const std::filesystem::path& file)
    : handle_(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (handle_) return;
  const char* const words = dlerror();
  problem_ = words ? words : "";
}

SharedLibrary::Any SharedLibrary::symbol(const char* name) const {
  return handle_ ? reinterpret_cast<Any>(dlsym(handle_, name)) : nullptr;
}

void SharedLibrary::close() {
  if (handle_) dlclose(handle_);
  handle_ = nullptr;
}

}  // namespace palpate::files
