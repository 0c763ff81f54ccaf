#include "compute/volume/memory.h"

#include <array>
#include <cstdio>
#include <fstream>

#ifdef _WIN32
#include <windows.h>
#endif

namespace palpate {
namespace {

std::string number_text(const char* format, double number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

}  // namespace

MachineMemory machine_memory() {
  MachineMemory memory;
#ifdef _WIN32
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  if (GlobalMemoryStatusEx(&status)) memory = {status.ullTotalPhys, status.ullAvailPhys};
#else
  std::ifstream info("/proc/meminfo");
  std::string key, unit;
  uint64_t kilobytes = 0;
  while (info >> key >> kilobytes) {
    std::getline(info, unit);
    if (key == "MemTotal:") memory.total_bytes = kilobytes * 1024;
    if (key == "MemAvailable:") memory.free_bytes = kilobytes * 1024;
  }
#endif
  return memory;
}

uint64_t memory_for_cpu_work() {
  return machine_memory().free_bytes / 3 * 2;
}

bool is_much_memory(double bytes) {
  const auto free = double(machine_memory().free_bytes);
  return free > 0.0 && bytes > 0.25 * free;
}

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
  const auto available = double(machine_memory().free_bytes);
  if (available <= 0.0 || bytes <= available) return Nothing{};
  const auto [needed, there] = bytes_to_compare(bytes, available);
  return Error{ErrorKind::kOutOfMemory,
               what + " needs " + needed + " of memory but only " + there +
                   " are free: crop or coarsen the data, or use a larger machine"};
}

}  // namespace palpate
