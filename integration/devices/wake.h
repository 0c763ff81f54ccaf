#pragma once

#ifdef _WIN32
#include <windows.h>
#else
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>
#endif

#include <cstdint>
#include <span>
#include <vector>

namespace palpate::devices {

/// Wakes a thread that sleeps on it, or on it and other files. wake() is one system call and takes
/// no lock: the servo thread may use it.
class Wake {
 public:
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;
#ifdef _WIN32
  Wake() : event_(CreateEventW(nullptr, FALSE, FALSE, nullptr)) {}
  ~Wake() {
    CloseHandle(event_);
  }

  void wake() noexcept {
    SetEvent(event_);
  }
  /// Sleeps until wake(), or the time is over; forgets the wake-ups.
  void sleep(int milliseconds) {
    WaitForSingleObject(event_, DWORD(milliseconds));
  }

 private:
  HANDLE event_;
#else
  Wake() : file_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~Wake() {
    close(file_);
  }

  void wake() noexcept {
    const uint64_t one = 1;
    [[maybe_unused]] const auto written = write(file_, &one, sizeof one);
  }

  /// Sleeps until wake(), an event of the others, or the time is over; forgets the wake-ups.
  void sleep(int milliseconds, std::span<const pollfd> others = {}) {
    std::vector<pollfd> files(others.begin(), others.end());
    files.push_back({file_, POLLIN, 0});
    poll(files.data(), nfds_t(files.size()), milliseconds);
    uint64_t count = 0;
    [[maybe_unused]] const auto got = read(file_, &count, sizeof count);
  }

 private:
  int file_;
#endif
};

}  // namespace palpate::devices
