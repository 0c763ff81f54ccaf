#pragma once

#include <filesystem>
#include <string>

namespace palpate::files {

/// A library that is loaded while the program runs (dlopen, LoadLibrary). It stays loaded unless
/// close() is called: what it gave may live as long as the program. Any thread.
class SharedLibrary {
 public:
  /// The file of that path, or where it is a name alone, what the system finds of it. Closed where
  /// it can not be loaded.
  explicit SharedLibrary(const std::filesystem::path& file);
  bool is_open() const { return handle_ != nullptr; }
  /// Why it could not be loaded, in the system's words.
  const std::string& problem() const { return problem_; }
  /// Null where it has none of that name.
  template <class Function>
  Function* find(const char* name) const {
    return reinterpret_cast<Function*>(symbol(name));
  }
  void close();

 private:
  using Any = void (*)();
  Any symbol(const char* name) const;
  void* handle_ = nullptr;
  std::string problem_;
};

}  // namespace palpate::files
