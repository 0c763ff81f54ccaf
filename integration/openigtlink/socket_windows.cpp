#include <algorithm>
#include <mutex>

#include "integration/openigtlink/socket.h"

namespace palpate::openigtlink {
namespace {

/// Counts of bytes have 32 bits here.
constexpr size_t kMostBytes = size_t(1) << 30;

SocketState state_of(int result) {
  if (result != SOCKET_ERROR) return SocketState::kDone;
  const int error = WSAGetLastError();
  const bool again = error == WSAEWOULDBLOCK || error == WSAEINPROGRESS || error == WSAEINTR;
  return again ? SocketState::kAgain : SocketState::kFailed;
}

Socket never_waits(SOCKET handle) {
  Socket socket(handle);
  u_long on = 1;
  if (socket.is_open() && ioctlsocket(handle, FIONBIO, &on) != 0) return Socket();
  return socket;
}

}  // namespace

Socket::~Socket() {
  if (is_open()) closesocket(handle_);
}

Socket Socket::make(int family, int protocol) {
  start_sockets();
  return never_waits(::socket(family, SOCK_STREAM, protocol));
}

Socket Socket::accept() const {
  return never_waits(::accept(handle_, nullptr, nullptr));
}

SocketState Socket::connect(const sockaddr* address, size_t bytes) const {
  return state_of(::connect(handle_, address, int(bytes)));
}

bool Socket::is_ready(short events, int wait_ms) const {
  WSAPOLLFD polled{handle_, events, 0};
  return WSAPoll(&polled, 1, wait_ms) > 0;
}

int Socket::error() const {
  int error = 0, size = sizeof error;
  const int result =
      getsockopt(handle_, SOL_SOCKET, SO_ERROR, reinterpret_cast<char*>(&error), &size);
  return result == 0 ? error : WSAGetLastError();
}

SocketState Socket::receive(void* to, size_t bytes, size_t& got) const {
  const int result = ::recv(handle_, static_cast<char*>(to), int(std::min(bytes, kMostBytes)), 0);
  got = result > 0 ? size_t(result) : 0;
  return state_of(result);
}

SocketState Socket::send(const void* from, size_t bytes, size_t& sent) const {
  const int result =
      ::send(handle_, static_cast<const char*>(from), int(std::min(bytes, kMostBytes)), 0);
  sent = result > 0 ? size_t(result) : 0;
  return state_of(result);
}

bool Socket::set(int level, int option, int value) const {
  return setsockopt(handle_, level, option, reinterpret_cast<const char*>(&value), sizeof value) ==
         0;
}

void start_sockets() {
  static std::once_flag once;
  std::call_once(once, [] {
    WSADATA ignored;
    WSAStartup(MAKEWORD(2, 2), &ignored);
  });
}

bool is_port_taken() {
  const int error = WSAGetLastError();
  return error == WSAEADDRINUSE || error == WSAEACCES;
}

}  // namespace palpate::openigtlink
