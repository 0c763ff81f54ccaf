#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace palpate::devices {

/// A WebSocket (RFC 6455) for text messages to a service on this machine. Whatever the other side
/// does, each call ends after its time, and no message above kLargestMessage is taken in. One
/// thread.
class WebSocket {
 public:
  static constexpr size_t kLargestMessage = 1 << 16;  ///< bytes
  static constexpr size_t kMostWaiting = 64;          ///< messages that nobody has received yet

  /// Null if nobody listens there, or who does speaks no WebSocket, or it takes too long.
  static std::unique_ptr<WebSocket> connect(const std::string& host, uint16_t port,
                                            int64_t wait_ns);
  ~WebSocket();
  WebSocket(const WebSocket&) = delete;
  WebSocket& operator=(const WebSocket&) = delete;

  /// False: it is closed, or the last message is still on its way.
  bool send(std::string text);
  /// The oldest message that has come; waits for one. Nothing: none came in time, or it is closed.
  std::optional<std::string> receive(int64_t wait_ns);
  /// False after an error, an end, or a message or a flood of messages that is too large.
  bool is_open() const noexcept;
  /// It was closed for what the other side sent, not because that one went away.
  bool was_flooded() const noexcept;
  /// Says goodbye; waits for what is on its way.
  void close(int64_t wait_ns) noexcept;

 private:
  class Connection;
  explicit WebSocket(std::unique_ptr<Connection> connection);
  std::unique_ptr<Connection> connection_;
};

/// The body of an HTTP GET, of at most kLargestMessage; nothing without an answer 200 in time.
std::optional<std::string> http_get(const std::string& host, uint16_t port, const std::string& path,
                                    int64_t wait_ns);

}  // namespace palpate::devices
