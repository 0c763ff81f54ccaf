#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace palpate {

/// std::fopen for a path, whose characters are wchar_t on Windows. Null where it fails.
inline std::FILE* open_file(const std::filesystem::path& path, const char* mode) {
#ifdef _WIN32
  const std::string text = mode;
  return _wfopen(path.c_str(), std::wstring(text.begin(), text.end()).c_str());
#else
  return std::fopen(path.c_str(), mode);
#endif
}

}  // namespace palpate
