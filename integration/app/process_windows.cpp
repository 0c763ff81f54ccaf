#include <windows.h>
// After windows.h, which it needs.
#include <shellapi.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "integration/app/process.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;

/// The files that a name with * or ? stands for, in the order of their names, since shells leave
/// this to programs. The name itself where there are none.
void append_expanded(const std::wstring& word, std::vector<std::string>& words) {
  std::vector<std::string> found;
  if (word.find_first_of(L"*?") != std::wstring::npos) {
    WIN32_FIND_DATAW file;
    const HANDLE search = FindFirstFileW(word.c_str(), &file);
    for (bool more = search != INVALID_HANDLE_VALUE; more; more = FindNextFileW(search, &file))
      if (const fs::path name = file.cFileName; name != L"." && name != L"..")
        found.push_back((fs::path(word).parent_path() / name).string());
    if (search != INVALID_HANDLE_VALUE) FindClose(search);
  }
  if (found.empty()) found.push_back(fs::path(word).string());
  std::sort(found.begin(), found.end());
  words.insert(words.end(), found.begin(), found.end());
}

}  // namespace

void prepare_process(int& argc, char**& argv) {
  SetConsoleOutputCP(CP_UTF8);
  int count = 0;
  wchar_t** const wide = CommandLineToArgvW(GetCommandLineW(), &count);
  if (!wide) return;
  static std::vector<std::string> words;
  static std::vector<char*> pointers;
  for (int k = 0; k < count; ++k) append_expanded(wide[k], words);
  LocalFree(wide);
  for (std::string& word : words) pointers.push_back(word.data());
  argc = int(pointers.size());
  pointers.push_back(nullptr);
  argv = pointers.data();
}

void set_if_missing(const char* name, const char* value) {
  if (!std::getenv(name)) _putenv_s(name, value);
}

}  // namespace palpate::app
