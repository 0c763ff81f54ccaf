#pragma once

namespace palpate::test {

/// Counts calls that a servo thread must never make: allocation, locks, output, direct system
/// calls. This test program replaces the C library's functions; calls from a watched thread are
/// counted and passed on. Calls within the C library are not counted, hence both printf and write
/// are replaced.
struct ForbiddenCalls {
  /// False in builds with a sanitizer, which replaces the same functions.
  static bool can_watch();
  /// Watches the calling thread from now on, or stops watching it.
  static void watch_this_thread(bool on);
  /// Whether calls of watched threads are counted now.
  static void count(bool on);
  static int counted();
  /// Name of the first counted function, or "".
  static const char* first();
  static void forget();
};

}  // namespace palpate::test
