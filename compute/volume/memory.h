#pragma once

#include <cstdint>
#include <string>

#include "compute/volume/result.h"

namespace palpate {

/// 37 -> "37 bytes", 5000000 -> "5.0 MB".
std::string bytes_for_people(double bytes);

/// Two sizes that a sentence compares: exact where they would read the same otherwise.
struct BytesTexts {
  std::string first, second;
};
BytesTexts bytes_to_compare(double first, double second);

/// Memory of this machine; 0 where the system does not say.
struct MachineMemory {
  uint64_t total_bytes = 0, free_bytes = 0;
};
/// As it is now. Any thread.
MachineMemory machine_memory();

/// What work on a driver for CPUs may take, which uses the machine's own memory: two thirds of what
/// is free now, since frames and fields need the rest; 0 where the system does not say. Any thread.
uint64_t memory_for_cpu_work();

/// More than a quarter of what is free now: better read again than kept. Any thread.
bool is_much_memory(double bytes);

/// kOutOfMemory for an allocation that this machine can not hold now. `what` is the subject of the
/// sentence. Any thread.
Status check_fits_memory(const std::string& what, double bytes);

}  // namespace palpate
