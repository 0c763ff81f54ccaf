#include "tests/lab/tests/report/xml_check.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <unistd.h>

namespace palpate::test {

std::string xml_trouble(const std::string& text) {
  std::string pattern = (std::filesystem::temp_directory_path() / "palpate-xml-XXXXXX").string();
  const int file = ::mkstemp(pattern.data());
  if (file < 0) return "no temporary file";
  ::close(file);
  std::ofstream(pattern, std::ios::binary) << text;
  // Data of several pictures in one attribute exceed the parser's default limit.
  std::FILE* out = ::popen(("xmllint --huge --noout " + pattern + " 2>&1").c_str(), "r");
  std::string complaint;
  char line[512];
  while (out && std::fgets(line, sizeof line, out)) complaint += line;
  const int status = out ? ::pclose(out) : -1;
  std::filesystem::remove(pattern);
  if (status == 0) return "";
  return complaint.empty() ? "xmllint failed: is libxml2-utils installed?" : complaint;
}

size_t count_of(const std::string& piece, const std::string& text) {
  size_t count = 0;
  for (size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1))
    ++count;
  return count;
}

}  // namespace palpate::test
