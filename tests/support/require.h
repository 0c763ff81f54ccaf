#pragma once

#include <cstdio>
#include <cstdlib>

namespace palpate {

/// Ends the process with a sentence where a promise of a reader or parser is broken: a fuzzer sees
/// that.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

}  // namespace palpate
