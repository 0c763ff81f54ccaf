#pragma once

#ifdef _WIN32
// Before windows.h, which brings an older one.
#include <winsock2.h>
#include <ws2tcpip.h>
#else
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#endif

#include <cstddef>
#include <cstdint>
#include <utility>

namespace palpate::openigtlink {

/// A file descriptor, or what Windows has in its place.
using SocketHandle = decltype(::socket(0, 0, 0));
inline constexpr SocketHandle kNoSocket = SocketHandle(-1);

/// What became of a call on a socket that never waits.
enum class SocketState { kDone, kAgain, kFailed };

/// A TCP socket that never waits, and is closed with it.
class Socket {
 public:
  explicit Socket(SocketHandle handle = kNoSocket) : handle_(handle) {}
  Socket(Socket&& other) noexcept : handle_(std::exchange(other.handle_, kNoSocket)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Socket();

  /// Of that family, like AF_INET. Not open where the system has none. Starts what the system's
  /// sockets need.
  static Socket make(int family, int protocol = 0);
  /// The next client; not open where none waits.
  Socket accept() const;

  SocketHandle handle() const { return handle_; }
  bool is_open() const { return handle_ != kNoSocket; }

  /// kAgain: it goes on; is_ready(POLLOUT) and then error() say how it ended.
  SocketState connect(const sockaddr* address, size_t bytes) const;
  /// Whether it can be read (POLLIN) or written (POLLOUT) within so many ms, or has ended.
  bool is_ready(short events, int wait_ms) const;
  /// 0 after a connection was made.
  int error() const;

  /// kDone with `got` = 0: the other side has ended it.
  SocketState receive(void* to, size_t bytes, size_t& got) const;
  SocketState send(const void* from, size_t bytes, size_t& sent) const;
  bool set(int level, int option, int value) const;

 private:
  SocketHandle handle_;
};

/// Has to be called before addresses are looked up; make() does it, too.
void start_sockets();
/// Whether the last call failed because another program has the port, or rights are missing.
bool is_port_taken();

}  // namespace palpate::openigtlink
