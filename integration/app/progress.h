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

/// Where stderr is no terminal, how a person follows the work: not at all, or by a line on stderr
/// for each step that is done, for work of many minutes.
enum class Steps { kSilent, kLines };

/// What a person sees while the program works: lines, and on a terminal a bar with the time left
/// that stays below them. With JSON on stdout, lines go to stderr. Quiet: errors only. Any thread.
class Console {
 public:
  Console(bool quiet, bool json, Steps steps = Steps::kSilent);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  bool quiet() const { return quiet_; }

  /// A line for the person, unless quiet.
  void say(std::string_view line);

  /// A line on stderr, only with --verbose: what a report of an error should hold.
  void detail(std::string_view line);
  /// What --verbose says, for all consoles of the program. Before the first of them.
  static void set_verbose(bool verbose);
  static bool verbose();

  /// The share done, 0 to 1, and of what. On a terminal redraws the bar at most ten times a second;
  /// elsewhere a line when `doing` changes, which ends the step before, or nothing: see Steps.
  void progress(double share, std::string_view doing);

  /// What happens now, for work without an end: on a terminal one line that is redrawn, elsewhere a
  /// line each second. Calls in between are cheap.
  void live(std::string_view line);

  /// Removes the bar; the next progress() restarts the clock.
  void end_progress();

  /// A sentence on stderr, also when quiet.
  void complain(std::string_view sentence);

 private:
  using Clock = std::chrono::steady_clock;
  void erase_bar();
  void draw_bar();
  std::string time_left(Clock::time_point now) const;
  void end_step(Clock::time_point now, double share);

  static inline std::atomic<bool> verbose_{false};

  std::mutex mutex_;
  std::FILE* const lines_;
  const bool quiet_;
  const bool has_bar_, has_step_lines_;
  bool running_ = false;
  bool drawn_ = false;
  Clock::time_point last_live_{};
  double share_ = 0.0;
  std::string doing_;
  Clock::time_point start_, step_start_;
  Clock::time_point last_draw_;
};

/// Prints the error as the program's last word and returns its exit code.
int fail(Console& console, const Error& error);

}  // namespace palpate::app
