#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

#include "compute/volume/result.h"

namespace palpate::app {

/// "12 s", "3 min 5 s", "1 h 20 min"; under ten seconds with one decimal.
std::string duration_text(double seconds);

/// "190 MB", "7.5 GB": decimal units, as disks and memory are sold.
std::string bytes_text(double bytes);

/// How progress is shown if stderr is no terminal: not at all, or by a line on stderr for each
/// finished step, for work of many minutes.
enum class Steps { kSilent, kLines };

/// Prints the user's view of the work: lines, and on a terminal a bar below them with the time
/// left. With JSON on stdout, lines go to stderr. Quiet: errors only. Any thread.
class Console {
 public:
  Console(bool quiet, bool json, Steps steps = Steps::kSilent);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  bool quiet() const { return quiet_; }

  /// Prints a line, unless quiet.
  void say(std::string_view line);

  /// Prints a line on stderr, only with --verbose: details for a bug report.
  void detail(std::string_view line);
  /// Sets --verbose for all consoles of the program. Call it before the first of them is created.
  static void set_verbose(bool verbose);
  static bool verbose();

  /// How sentences of the libraries are spelled for the user of this program: they name options as
  /// `key`. Call it before the first console is created.
  static void set_spelling(std::string (*spelling)(std::string_view));

  /// The share done, 0 to 1, and the present step. On a terminal redraws the bar at most ten times
  /// a second; elsewhere prints a line when `doing` changes, which ends the step before, or
  /// nothing: see Steps.
  void progress(double share, std::string_view doing);

  /// The present state of work without an end: on a terminal one line that is redrawn. Elsewhere,
  /// in a log file, a line when `state` (a word or two) changes, at most one a second, and one
  /// every ten seconds. Calls in between cost little.
  void live(std::string_view line, std::string_view state);

  /// Removes the bar; the next progress() restarts the clock.
  void end_progress();

  /// Prints a sentence on stderr, also if quiet.
  void complain(std::string_view sentence);

 private:
  using Clock = std::chrono::steady_clock;
  static std::string spelled(std::string_view sentence);
  void erase_bar();
  void draw_bar();
  std::string time_left(Clock::time_point now) const;
  void end_step(Clock::time_point now, double share);

  static inline std::atomic<bool> verbose_{false};
  static inline std::string (*spelling_)(std::string_view) = nullptr;

  std::mutex mutex_;
  std::FILE* const lines_;
  const bool quiet_;
  const bool has_bar_, has_step_lines_;
  bool running_ = false;
  bool drawn_ = false;
  Clock::time_point last_live_{};
  std::string last_state_;
  double share_ = 0.0;
  std::string doing_;
  Clock::time_point start_, step_start_;
  Clock::time_point last_draw_;
};

/// Prints the error as the last line and returns its exit code.
int fail(Console& console, const Error& error);

}  // namespace palpate::app
