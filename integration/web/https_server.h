#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compute/volume/result.h"
#include "integration/web/certificate.h"

namespace palpate::web {

/// What is answered to a GET.
struct WebReply {
  std::string_view type;                    ///< "text/html"
  std::shared_ptr<const std::string> body;  ///< null: there is no such thing (404)
};

/// All functions are called on the server's own thread, and must not wait.
struct HttpsServerOptions {
  std::string address = "127.0.0.1";  ///< where it listens; 0.0.0.0 or :: is every network
  uint16_t port = 0;                  ///< 0: any that is free
  /// How long a certificate is valid. A new one is made before it expires; connections that are
  /// open go on.
  std::chrono::seconds certificate_valid = std::chrono::hours(24 * 30);
  std::function<WebReply(std::string_view path)> get;  ///< path: what is behind the token
  /// Returns the first text that a new client gets.
  std::function<std::string(uint64_t client)> on_join;
  std::function<void(uint64_t client)> on_leave;
  /// A text message of a client. Returns why its connection is to be closed; empty: it stays.
  std::function<std::string(uint64_t client, const std::string& text)> on_text;
  std::function<void(const Certificate& renewed)> on_certificate;
  std::function<void()> on_tick;  ///< every 20 ms
};

/// A page and its messages on https, for browsers on the same network: TLS 1.2 or newer with a
/// certificate of its own, HTTP GET and WebSocket, on one thread. Every path begins with a token
/// that is made at the start and is part of the address; without it the answer is 403, whatever is
/// asked for. Only what `get` returns is ever sent: the server opens no files.
///
/// A client is closed with one sentence: messages above 512 bytes, more than 300 in a second,
/// binary ones, and what on_text refuses. At most 128 connections at a time.
class HttpsServer {
 public:
  /// Errors: kBadInput, in one sentence: no such address, or the port can not be opened.
  static Result<std::unique_ptr<HttpsServer>> start(HttpsServerOptions options);
  ~HttpsServer();
  HttpsServer(const HttpsServer&) = delete;
  HttpsServer& operator=(const HttpsServer&) = delete;

  /// Sends a text to all clients. A client that has not yet taken the one before gets only the
  /// newest one, later. Any thread.
  void send(std::shared_ptr<const std::string> text);

  uint16_t port() const;
  const std::string& token() const;
  /// The address of the page from this machine and, where others may connect, from these.
  std::vector<std::string> page_addresses() const;
  /// Of the first certificate.
  const std::string& fingerprint() const;

  struct Traffic {
    uint64_t joined = 0;    ///< clients so far
    uint64_t sent = 0;      ///< messages
    uint64_t left_out = 0;  ///< messages that a slow client did not get
    uint64_t refused = 0;   ///< requests without the token, and clients that were closed
  };
  /// Any thread.
  Traffic traffic() const;
  static constexpr size_t kMostBytes = 512, kMostPerSecond = 300, kMostConnections = 128;

 private:
  class Work;
  explicit HttpsServer(std::shared_ptr<Work> work);
  std::shared_ptr<Work> work_;
};

}  // namespace palpate::web
