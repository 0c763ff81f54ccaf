#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace palpate::devices::test {

/// Nothing here is asserted in milliseconds: it is waited for in patience.
inline constexpr std::chrono::seconds kPatience{60};

/// True once it holds; false if it never does.
inline bool wait_for(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace palpate::devices::test
