#pragma once

#include <cstdio>
#include <cstdlib>

namespace palpate {

/// Ends the process with a message if a guarantee of a reader or parser does not hold. A fuzzer
/// reports this as a crash.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace palpate
