#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace palpate {

/// How long a test waits for an expected event: so long that a busy machine fails no test.
inline constexpr std::chrono::seconds kPatience{60};

/// Polls every millisecond. True once `holds` is true; false after kPatience.
inline bool wait_for(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace palpate
