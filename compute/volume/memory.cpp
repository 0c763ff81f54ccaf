#include "compute/volume/memory.h"

#include <array>
#include <cstdio>
#include <fstream>

#ifdef _WIN32
#include <windows.h>
#endif

namespace palpate {
namespace {

/// 0 if the system does not report it.
double available_memory_bytes() {
#ifdef _WIN32
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  return GlobalMemoryStatusEx(&status) ? double(status.ullAvailPhys) : 0.0;
#else
  std::ifstream info("/proc/meminfo");
  std::string key;
  double kilobytes = 0.0;
  std::string unit;
  while (info >> key >> kilobytes) {
    std::getline(info, unit);
    if (key == "MemAvailable:") return kilobytes * 1024.0;
  }
  return 0.0;
#endif
}

std::string number_text(const char* format, double number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

}  // namespace

std::string bytes_for_people(double bytes) {
  if (bytes < 1e4) return number_text("%.0f bytes", bytes);
  if (bytes < 1e6) return number_text("%.1f kB", bytes / 1e3);
  if (bytes < 1e9) return number_text("%.1f MB", bytes / 1e6);
  return number_text("%.1f GB", bytes / 1e9);
}

BytesTexts bytes_to_compare(double first, double second) {
  BytesTexts texts{bytes_for_people(first), bytes_for_people(second)};
  if (first != second && texts.first == texts.second)
    texts = {number_text("%.0f bytes", first), number_text("%.0f bytes", second)};
  return texts;
}

Status check_fits_memory(const std::string& what, double bytes) {
  const double available = available_memory_bytes();
  if (available <= 0.0 || bytes <= available) return Nothing{};
  const auto [needed, there] = bytes_to_compare(bytes, available);
  return Error{ErrorKind::kOutOfMemory,
               what + " needs " + needed + " of memory but only " + there +
                   " are free: crop or coarsen the data, or use a larger machine"};
}

}  // namespace palpate
