#include "integration/app/progress.h"

#include <fmt/format.h>

#include <algorithm>

#include "integration/app/exit_code.h"
#include "integration/app/program.h"
#include "integration/files/descriptor.h"

namespace palpate::app {
namespace {

/// Without exceptions: the work goes on even if the output is no longer read.
void put(std::FILE* stream, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fflush(stream);
}

constexpr int kBarWidth = 24;
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr auto kChangedLine = std::chrono::seconds(1);
constexpr auto kSameLine = std::chrono::seconds(10);

// Below this share the time left can not be estimated.
constexpr double kEarlyShare = 0.02;
constexpr double kEarlySeconds = 0.5;

}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

std::string bytes_text(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} bytes", bytes);
  if (bytes < 1e6) return fmt::format("{:.3g} kB", bytes / 1e3);
  if (bytes < 1e9) return fmt::format("{:.0f} MB", bytes / 1e6);
  return fmt::format("{:.1f} GB", bytes / 1e9);
}

Console::Console(bool quiet, bool json, Steps steps)
    : lines_(json ? stderr : stdout),
      quiet_(quiet),
      has_bar_(!quiet && files::is_terminal(2)),
      has_step_lines_(!quiet && !has_bar_ && steps == Steps::kLines) {}

Console::~Console() {
  end_progress();
}

void Console::set_spelling(std::string (*spelling)(std::string_view)) {
  spelling_ = spelling;
}

std::string Console::spelled(std::string_view sentence) {
  return spelling_ ? spelling_(sentence) : std::string(sentence);
}

void Console::say(std::string_view line) {
  if (quiet_) return;
  const std::lock_guard lock(mutex_);
  erase_bar();
  put(lines_, fmt::format("{}\n", spelled(line)));
  if (running_ && has_bar_) draw_bar();
}

void Console::progress(double share, std::string_view doing) {
  if (!has_bar_ && !has_step_lines_) return;
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  if (!running_) start_ = step_start_ = now;
  if (has_step_lines_) {
    if (running_ && doing != doing_) end_step(now, share);
    running_ = true;
    doing_ = doing;
    return;
  }
  if (running_ && now - last_draw_ < kRedraw) return;
  running_ = true;
  last_draw_ = now;
  share_ = std::clamp(share, 0.0, 1.0);
  doing_ = doing;
  draw_bar();
}

void Console::live(std::string_view line, std::string_view state) {
  if (quiet_) return;
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  const Clock::duration pause = has_bar_               ? Clock::duration(kRedraw)
                                : state == last_state_ ? Clock::duration(kSameLine)
                                                       : Clock::duration(kChangedLine);
  if (now - last_live_ < pause) return;
  last_live_ = now;
  last_state_ = state;
  if (has_bar_) {
    put(stderr, fmt::format("\r\033[K{}", line));
    drawn_ = true;
  } else {
    put(lines_, fmt::format("{}\n", line));
  }
}

void Console::end_progress() {
  const std::lock_guard lock(mutex_);
  erase_bar();
  if (running_ && has_step_lines_) end_step(Clock::now(), 1.0);
  running_ = false;
}

void Console::detail(std::string_view line) {
  if (!verbose_) return;
  const std::lock_guard lock(mutex_);
  erase_bar();
  fmt::print(stderr, "{}\n", line);
}

void Console::set_verbose(bool verbose) {
  verbose_ = verbose;
}

bool Console::verbose() {
  return verbose_;
}

void Console::complain(std::string_view sentence) {
  const std::lock_guard lock(mutex_);
  erase_bar();
  put(stderr, fmt::format("{}\n", spelled(sentence)));
}

void Console::erase_bar() {
  if (!drawn_) return;
  put(stderr, "\r\033[K");
  drawn_ = false;
}

std::string Console::time_left(Clock::time_point now) const {
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  if (share_ <= kEarlyShare || share_ >= 1.0 || elapsed_s <= kEarlySeconds) return "";
  return duration_text(elapsed_s * (1.0 - share_) / share_) + " left";
}

void Console::end_step(Clock::time_point now, double share) {
  share_ = std::clamp(share, 0.0, 1.0);
  const double took_s = std::chrono::duration<double>(now - step_start_).count();
  const std::string left = time_left(now);
  put(stderr, fmt::format("{:3.0f} %  {}  {}{}{}\n", 100.0 * share_, doing_, duration_text(took_s),
                          left.empty() ? "" : ", about ", left));
  step_start_ = now;
}

void Console::draw_bar() {
  const std::string left = time_left(Clock::now());
  const int full = int(share_ * kBarWidth);
  put(stderr, fmt::format("\r\033[K[{:#<{}}{:.<{}}] {:3.0f} %  {}  {}", "", full, "",
                          kBarWidth - full, 100.0 * share_, doing_, left));
  drawn_ = true;
}

int fail(Console& console, const Error& error) {
  console.end_progress();
  std::string sentence = std::string(kProgramName) + ": " + error.message;
  if (error.kind == ErrorKind::kNotFinite)
    sentence += "; --nan-as VALUE of 'palpate motion', 'check', 'feel' and 'view' replaces NaN";
  if (!sentence.ends_with('.')) sentence += '.';
  console.complain(sentence);
  return exit_code(error);
}

}  // namespace palpate::app
