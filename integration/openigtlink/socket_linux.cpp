#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "integration/openigtlink/socket.h"

namespace palpate::openigtlink {
namespace {

SocketState state_of(ssize_t result) {
  if (result >= 0) return SocketState::kDone;
  const bool again = errno == EAGAIN || errno == EINTR || errno == EINPROGRESS;
  return again ? SocketState::kAgain : SocketState::kFailed;
}

}  // namespace

Socket::~Socket() {
  if (is_open()) ::close(handle_);
}

Socket Socket::make(int family, int protocol) {
  return Socket(::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, protocol));
}

Socket Socket::accept() const {
  return Socket(::accept4(handle_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

SocketState Socket::connect(const sockaddr* address, size_t bytes) const {
  return state_of(::connect(handle_, address, socklen_t(bytes)));
}

bool Socket::is_ready(short events, int wait_ms) const {
  pollfd polled{handle_, events, 0};
  return ::poll(&polled, 1, wait_ms) > 0;
}

int Socket::error() const {
  int error = 0;
  socklen_t size = sizeof error;
  return ::getsockopt(handle_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

SocketState Socket::receive(void* to, size_t bytes, size_t& got) const {
  const ssize_t result = ::recv(handle_, to, bytes, 0);
  got = result > 0 ? size_t(result) : 0;
  return state_of(result);
}

SocketState Socket::send(const void* from, size_t bytes, size_t& sent) const {
  const ssize_t result = ::send(handle_, from, bytes, MSG_NOSIGNAL);
  sent = result > 0 ? size_t(result) : 0;
  return state_of(result);
}

bool Socket::set(int level, int option, int value) const {
  return ::setsockopt(handle_, level, option, &value, sizeof value) == 0;
}

void start_sockets() {}

bool is_port_taken() {
  return errno == EADDRINUSE || errno == EACCES;
}

}  // namespace palpate::openigtlink
