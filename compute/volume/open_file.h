#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace palpate {

/// std::fopen for any path: on Windows those are no texts of char. Null where it fails.
inline std::FILE* open_file(const std::filesystem::path& path, const char* mode) {
#ifdef _WIN32
  const std::string text = mode;
  return _wfopen(path.c_str(), std::wstring(text.begin(), text.end()).c_str());
#else
  return std::fopen(path.c_str(), mode);
#endif
}

}  // namespace palpate
