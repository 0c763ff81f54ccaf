#pragma once

namespace palpate::test {

/// Counts what a servo thread must never call: memory, locks, output, the kernel by hand. This test
/// program stands in front of the C library's functions; calls of a thread that is watched are
/// counted and passed on. What the C library calls within itself is not seen, hence printf and
/// write both.
struct ForbiddenCalls {
  /// False in builds with a sanitizer, which stands in the same place itself.
  static bool can_watch();
  /// The calling thread, from now on.
  static void watch_this_thread(bool on);
  /// All threads that are watched: whether they count now.
  static void count(bool on);
  static int counted();
  /// Name of the first one, or "".
  static const char* first();
  static void forget();
};

}  // namespace palpate::test
