#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

namespace palpate::openigtlink {

/// A file descriptor that is closed with it.
class Socket {
 public:
  explicit Socket(int fd = -1) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  int fd() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }

  /// Whether it can be read (POLLIN) or written (POLLOUT) within so many ms, or has ended.
  bool is_ready(short events, int wait_ms) const {
    pollfd polled{fd_, events, 0};
    return poll(&polled, 1, wait_ms) > 0;
  }

 private:
  int fd_;
};

}  // namespace palpate::openigtlink
