#include "integration/devices/web_socket.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>

namespace palpate::devices {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = net::ip::tcp;
using Clock = std::chrono::steady_clock;
using Nanoseconds = std::chrono::nanoseconds;
using SocketError = boost::system::error_code;

/// Runs what was begun until done(), or until the time is over.
template <class Done>
bool run_until(net::io_context& io, int64_t wait_ns, Done done) {
  const auto end = Clock::now() + Nanoseconds(wait_ns);
  io.restart();
  while (!done()) {
    const auto left = end - Clock::now();
    if (left <= Nanoseconds(0)) {
      io.poll();
      return done();
    }
    if (io.run_one_for(left) == 0 && !done()) return false;
  }
  return true;
}

/// Connects within the time. Names stand for an address on this machine, so that asking for it
/// takes no time.
bool connect_stream(net::io_context& io, beast::tcp_stream& stream, const std::string& host,
                    uint16_t port, int64_t wait_ns) {
  SocketError failure;
  Tcp::resolver resolver(io);
  const auto places = resolver.resolve(host, std::to_string(port), failure);
  if (failure) return false;
  bool connected = false, ended = false;
  stream.async_connect(places, [&](SocketError code, const Tcp::endpoint&) {
    connected = !code;
    ended = true;
  });
  if (!run_until(io, wait_ns, [&] { return ended; })) {
    stream.cancel();
    run_until(io, wait_ns, [&] { return ended; });
  }
  if (connected) stream.socket().set_option(Tcp::no_delay(true), failure);
  return connected && !failure;
}

}  // namespace

class WebSocket::Connection {
 public:
  Connection() : stream_(io_) {
    // Time-outs are ours: those of the library would need its timers between our calls.
    stream_.set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                       websocket::stream_base::none(), false});
    stream_.read_message_max(kLargestMessage);
  }

  ~Connection() {
    SocketError failure;
    beast::get_lowest_layer(stream_).socket().close(failure);
    // What was begun ends now, while what it writes to is still there.
    io_.restart();
    io_.poll();
  }

  bool connect(const std::string& host, uint16_t port, int64_t wait_ns) {
    if (!connect_stream(io_, beast::get_lowest_layer(stream_), host, port, wait_ns)) return false;
    bool ended = false, agreed = false;
    stream_.async_handshake(host + ":" + std::to_string(port), "/", [&](SocketError code) {
      agreed = !code;
      ended = true;
    });
    if (!run_until(io_, wait_ns, [&] { return ended; })) {
      beast::get_lowest_layer(stream_).cancel();
      run_until(io_, wait_ns, [&] { return ended; });
    }
    if (!agreed) return false;
    stream_.text(true);
    open_ = true;
    read();
    return true;
  }

  bool send(std::string text) {
    if (!open_ || sending_) return false;
    out_ = std::move(text);
    sending_ = true;
    stream_.async_write(net::buffer(out_), [this](SocketError code, size_t) {
      sending_ = false;
      if (code) open_ = false;
    });
    io_.restart();
    io_.poll();
    return open_;
  }

  std::optional<std::string> receive(int64_t wait_ns) {
    run_until(io_, wait_ns, [&] { return !messages_.empty() || !open_; });
    if (messages_.empty()) return std::nullopt;
    std::string text = std::move(messages_.front());
    messages_.pop_front();
    return text;
  }

  void close(int64_t wait_ns) noexcept {
    try {
      if (!run_until(io_, wait_ns, [&] { return !sending_ || !open_; }) || !open_) return;
      bool ended = false;
      stream_.async_close(websocket::close_code::normal, [&](SocketError) { ended = true; });
      if (!run_until(io_, wait_ns, [&] { return ended; })) {
        beast::get_lowest_layer(stream_).cancel();
        run_until(io_, wait_ns, [&] { return ended; });
      }
    } catch (...) {
    }
    open_ = false;
  }

  bool open() const noexcept { return open_; }
  bool flooded() const noexcept { return flooded_; }

 private:
  void read() {
    stream_.async_read(in_, [this](SocketError code, size_t) {
      if (code || messages_.size() >= kMostWaiting) {
        flooded_ = !code || code == websocket::error::message_too_big ||
                   code == websocket::error::buffer_overflow;
        open_ = false;
        return;
      }
      messages_.push_back(beast::buffers_to_string(in_.data()));
      in_.consume(in_.size());
      read();
    });
  }

  net::io_context io_;
  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer in_;
  std::string out_;
  std::deque<std::string> messages_;
  bool open_ = false, sending_ = false, flooded_ = false;
};

WebSocket::WebSocket(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}

WebSocket::~WebSocket() = default;

std::unique_ptr<WebSocket> WebSocket::connect(const std::string& host, uint16_t port,
                                              int64_t wait_ns) {
  auto connection = std::make_unique<Connection>();
  if (!connection->connect(host, port, wait_ns)) return nullptr;
  return std::unique_ptr<WebSocket>(new WebSocket(std::move(connection)));
}

bool WebSocket::send(std::string text) {
  return connection_->send(std::move(text));
}

std::optional<std::string> WebSocket::receive(int64_t wait_ns) {
  return connection_->receive(wait_ns);
}

bool WebSocket::is_open() const noexcept {
  return connection_->open();
}

bool WebSocket::was_flooded() const noexcept {
  return connection_->flooded();
}

void WebSocket::close(int64_t wait_ns) noexcept {
  connection_->close(wait_ns);
}

std::optional<std::string> http_get(const std::string& host, uint16_t port, const std::string& path,
                                    int64_t wait_ns) {
  net::io_context io;
  beast::tcp_stream stream(io);
  if (!connect_stream(io, stream, host, port, wait_ns)) return std::nullopt;
  http::request<http::empty_body> request(http::verb::get, path, 11);
  request.set(http::field::host, host);
  request.set(http::field::connection, "close");
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(WebSocket::kLargestMessage);
  bool ended = false, answered = false;
  http::async_write(stream, request, [&](SocketError sent, size_t) {
    if (sent) {
      ended = true;
      return;
    }
    http::async_read(stream, buffer, parser, [&](SocketError code, size_t) {
      answered = !code;
      ended = true;
    });
  });
  if (!run_until(io, wait_ns, [&] { return ended; })) {
    stream.cancel();
    run_until(io, wait_ns, [&] { return ended; });
  }
  if (!answered || parser.get().result() != http::status::ok) return std::nullopt;
  return parser.get().body();
}

}  // namespace palpate::devices
