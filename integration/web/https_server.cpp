#include "integration/web/https_server.h"

#include <fmt/format.h>
#include <openssl/crypto.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <map>
#include <optional>
#include <thread>

#include "integration/web/own_addresses.h"

namespace palpate::web {
namespace {

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = net::ip::tcp;
using SocketError = boost::system::error_code;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;
using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTick{20};
constexpr std::chrono::seconds kPatience{30};     // for a client's next step
constexpr std::chrono::hours kRenewedBefore{24};  // its end
constexpr size_t kSlowestBytesPerSecond = 50'000;
constexpr size_t kTokenBytes = 16, kMostHeaderBytes = 8192, kMostFrameBytes = 65536;
// Nothing from elsewhere is loaded, and no other page may show this one.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
    "data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

std::string in_url(const std::string& host, uint16_t port, const std::string& token) {
  const bool is_v6 = host.find(':') != std::string::npos;
  return fmt::format("https://{}:{}/{}/", is_v6 ? "[" + host + "]" : host, port, token);
}

/// In a time that does not depend on where they differ.
bool is_same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

/// All of it runs on one thread; what other threads call posts to it.
class HttpsServer::Work : public std::enable_shared_from_this<HttpsServer::Work> {
 public:
  class Connection;

  Work(HttpsServerOptions given, std::string made)
      : options(std::move(given)), token(std::move(made)) {}
  ~Work() {
    // Connections are owned by what they wait for, and leave when the context is destroyed.
    options.on_leave = {};
    timer.reset();
    acceptor.reset();
    io.reset();
  }

  Status open() {
    SocketError failure;
    const auto address = net::ip::make_address(options.address, failure);
    if (failure)
      return Error{ErrorKind::kBadInput,
                   fmt::format("'{}' is no address of a network: 127.0.0.1 is this machine alone, "
                               "0.0.0.0 every network",
                               options.address)};
    const Tcp::endpoint endpoint(address, options.port);
    acceptor->open(endpoint.protocol(), failure);
    if (!failure) acceptor->set_option(Tcp::acceptor::reuse_address(true), failure);
    if (!failure) acceptor->bind(endpoint, failure);
    if (!failure) acceptor->listen(net::socket_base::max_listen_connections, failure);
    if (failure)
      return Error{ErrorKind::kBadInput,
                   fmt::format("The page can not be served at {} port {}: {}", options.address,
                               options.port, failure.message())};
    port = acceptor->local_endpoint().port();
    hosts = address.is_unspecified() ? own_addresses() : std::vector{options.address};
    if (address.is_unspecified() || hosts.empty()) hosts.insert(hosts.begin(), "127.0.0.1");
    return renew();
  }

  /// Makes a certificate; connections from now on use it.
  Status renew() {
    std::vector<std::string> names = hosts;
    names.emplace_back("localhost");
    auto made = make_certificate(names, options.certificate_valid);
    if (!made) return made.error();
    auto fresh = std::make_shared<ssl::context>(ssl::context::tls_server);
    SocketError failure;
    fresh->set_options(
        ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1,
        failure);
    if (!failure) fresh->use_certificate(net::buffer(made->pem), ssl::context::pem, failure);
    if (!failure) fresh->use_private_key(net::buffer(made->key_pem), ssl::context::pem, failure);
    if (failure)
      return Error{ErrorKind::kDeviceFailed,
                   "The page's certificate can not be used: " + failure.message()};
    tls = std::move(fresh);
    certificate = std::move(*made);
    return Nothing{};
  }

  void run() {
    accept();
    tick();
    // A handler that throws (memory) ends one step of one connection, not the server.
    for (;;) {
      try {
        io->run();
        return;
      } catch (const std::exception&) {
        ++refused;
      }
    }
  }

  void accept();
  void tick() {
    timer->expires_after(kTick);
    timer->async_wait([this](SocketError code) {
      if (code) return;
      if (options.on_tick) options.on_tick();
      tick();
    });
  }
  void send(const std::shared_ptr<const std::string>& text);

  HttpsServerOptions options;
  std::string token;
  std::optional<net::io_context> io{std::in_place, 1};
  std::optional<Tcp::acceptor> acceptor{std::in_place, *io};
  std::optional<net::steady_timer> timer{std::in_place, *io};
  std::shared_ptr<ssl::context> tls;
  Certificate certificate;
  uint16_t port = 0;
  std::vector<std::string> hosts;
  std::string first_fingerprint;
  std::map<uint64_t, Connection*> clients;  ///< those that get messages
  uint64_t last_client = 0;
  size_t connections = 0;
  std::atomic<uint64_t> joined{0}, sent{0}, left_out{0}, refused{0};
  std::thread thread;
};

/// A connection: requests one after the other, until one of them asks for messages.
class HttpsServer::Work::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Work& work, Tcp::socket socket)
      : work_(work), tls_(work.tls), stream_(std::move(socket), *tls_) {
    ++work_.connections;
  }
  ~Connection() {
    leave();
    --work_.connections;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void start() {
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    stream_.async_handshake(ssl::stream_base::server,
                            [self = shared_from_this()](SocketError code) {
                              if (!code) self->read_request();
                            });
  }

  void send(const std::shared_ptr<const std::string>& text) {
    if (writing_ || closing_) {
      if (next_) ++work_.left_out;
      next_ = text;
      return;
    }
    writing_ = text;
    messages_->text(true);
    messages_->async_write(net::buffer(*text),
                           [self = shared_from_this()](SocketError code, size_t) {
                             self->writing_.reset();
                             if (code) return self->leave();
                             ++self->work_.sent;
                             if (self->closing_) return self->close_now();
                             if (self->next_) self->send(std::exchange(self->next_, nullptr));
                           });
  }

 private:
  void read_request() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(0);
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](SocketError code, size_t) {
                       if (!code) self->answer();
                     });
  }

  void answer() {
    const auto& request = parser_->get();
    std::string_view path(request.target().data(), request.target().size());
    path = path.substr(0, path.find_first_of("?#"));
    // /TOKEN/what
    const size_t slash = path.find('/', 1);
    const bool has_token = !path.empty() && slash != std::string_view::npos &&
                           is_same(path.substr(1, slash - 1), work_.token);
    if (!has_token) {
      ++work_.refused;
      return reply(http::status::forbidden,
                   {"text/plain", std::make_shared<const std::string>(
                                      "The address lacks the token that palpate has printed.\n")});
    }
    path.remove_prefix(slash + 1);
    if (websocket::is_upgrade(request)) return upgrade(path);
    if (request.method() != http::verb::get)
      return reply(http::status::method_not_allowed,
                   {"text/plain", std::make_shared<const std::string>("Only GET is answered.\n")});
    WebReply found = work_.options.get(path);
    if (!found.body) {
      return reply(http::status::not_found,
                   {"text/plain", std::make_shared<const std::string>("There is no such part.\n")});
    }
    reply(http::status::ok, std::move(found));
  }

  void reply(http::status status, WebReply what) {
    body_ = std::move(what.body);
    response_.emplace(status, parser_->get().version());
    response_->set(http::field::content_type,
                   boost::string_view(what.type.data(), what.type.size()));
    response_->set(http::field::cache_control, "no-store");
    response_->set("Content-Security-Policy", kPolicy);
    response_->set("Referrer-Policy", "no-referrer");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->body() = {body_->data(), body_->size()};
    response_->prepare_payload();
    response_->keep_alive(parser_->get().keep_alive());
    beast::get_lowest_layer(stream_).expires_after(
        kPatience + std::chrono::seconds(body_->size() / kSlowestBytesPerSecond));
    http::async_write(stream_, *response_, [self = shared_from_this()](SocketError code, size_t) {
      if (code) return;
      if (self->response_->keep_alive()) return self->read_request();
      self->shut_down();
    });
  }

  void shut_down() {
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    stream_.async_shutdown([self = shared_from_this()](SocketError) {});
  }

  void upgrade(std::string_view path) {
    if (path != "state")
      return reply(http::status::not_found,
                   {"text/plain", std::make_shared<const std::string>("There is no such part.\n")});
    beast::get_lowest_layer(stream_).expires_never();
    messages_.emplace(std::move(stream_));
    websocket::stream_base::timeout times{};
    times.handshake_timeout = kPatience;
    times.idle_timeout = kPatience;
    times.keep_alive_pings = true;
    messages_->set_option(times);
    messages_->read_message_max(kMostFrameBytes);
    messages_->async_accept(parser_->get(), [self = shared_from_this()](SocketError code) {
      if (!code) self->join();
    });
  }

  void join() {
    client_ = ++work_.last_client;
    work_.clients.emplace(client_, this);
    ++work_.joined;
    if (work_.options.on_join)
      send(std::make_shared<const std::string>(work_.options.on_join(client_)));
    second_ = SteadyClock::now();
    read_message();
  }

  void leave() {
    if (client_ == 0) return;
    work_.clients.erase(client_);
    if (work_.options.on_leave) work_.options.on_leave(client_);
    client_ = 0;
  }

  void read_message() {
    buffer_.consume(buffer_.size());
    messages_->async_read(buffer_, [self = shared_from_this()](SocketError code, size_t) {
      if (code) return self->leave();
      self->take();
    });
  }

  void take() {
    const auto now = SteadyClock::now();
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      in_second_ = 0;
    }
    if (++in_second_ > kMostPerSecond)
      return close(fmt::format("More than {} messages in a second", kMostPerSecond));
    if (!messages_->got_text()) return close("A message that is not text");
    if (buffer_.size() > kMostBytes)
      return close(fmt::format("A message of more than {} bytes", kMostBytes));
    const std::string why =
        work_.options.on_text
            ? work_.options.on_text(client_, beast::buffers_to_string(buffer_.data()))
            : std::string();
    if (!why.empty()) return close(why);
    read_message();
  }

  /// Closes with a sentence, once a message that is being written is out.
  void close(const std::string& why) {
    ++work_.refused;
    closing_ = websocket::close_reason(websocket::close_code::policy_error, why);
    leave();
    if (!writing_) close_now();
  }
  void close_now() {
    messages_->async_close(*closing_, [self = shared_from_this()](SocketError) {});
  }

  Work& work_;
  std::shared_ptr<ssl::context> tls_;
  TlsStream stream_;
  std::optional<websocket::stream<TlsStream, false>> messages_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::span_body<const char>>> response_;
  std::shared_ptr<const std::string> body_;            ///< of the response
  std::shared_ptr<const std::string> writing_, next_;  ///< messages
  std::optional<websocket::close_reason> closing_;
  uint64_t client_ = 0;  ///< 0: gets no messages
  SteadyClock::time_point second_;
  size_t in_second_ = 0;
};

void HttpsServer::Work::accept() {
  acceptor->async_accept([this](SocketError code, Tcp::socket socket) {
    if (!acceptor->is_open()) return;
    if (!code && connections < kMostConnections) {
      if (std::chrono::system_clock::now() + std::min<std::chrono::system_clock::duration>(
                                                 kRenewedBefore, options.certificate_valid / 2) >
          certificate.expires) {
        // The old one stays if no other one can be made: the browser says then what it thinks.
        if (renew() && options.on_certificate) options.on_certificate(certificate);
      }
      socket.set_option(Tcp::no_delay(true), code);
      std::make_shared<Connection>(*this, std::move(socket))->start();
    }
    accept();
  });
}

void HttpsServer::Work::send(const std::shared_ptr<const std::string>& text) {
  // One that leaves meanwhile takes itself out.
  for (auto at = clients.begin(); at != clients.end();) (at++)->second->send(text);
}

Result<std::unique_ptr<HttpsServer>> HttpsServer::start(HttpsServerOptions options) {
  auto token = random_hex(kTokenBytes);
  if (!token) return token.error();
  auto work = std::make_shared<Work>(std::move(options), std::move(*token));
  if (const Status opened = work->open(); !opened) return opened.error();
  work->first_fingerprint = work->certificate.fingerprint;
  work->thread = std::thread([work = work.get()] { work->run(); });
  return std::unique_ptr<HttpsServer>(new HttpsServer(std::move(work)));
}

HttpsServer::HttpsServer(std::shared_ptr<Work> work) : work_(std::move(work)) {}

HttpsServer::~HttpsServer() {
  work_->io->stop();
  work_->thread.join();
}

void HttpsServer::send(std::shared_ptr<const std::string> text) {
  net::post(*work_->io, [work = work_.get(), text = std::move(text)] { work->send(text); });
}

uint16_t HttpsServer::port() const {
  return work_->port;
}
const std::string& HttpsServer::token() const {
  return work_->token;
}
const std::string& HttpsServer::fingerprint() const {
  return work_->first_fingerprint;
}

std::vector<std::string> HttpsServer::page_addresses() const {
  std::vector<std::string> addresses;
  for (const std::string& host : work_->hosts)
    addresses.push_back(in_url(host, work_->port, work_->token));
  return addresses;
}

HttpsServer::Traffic HttpsServer::traffic() const {
  return {work_->joined, work_->sent, work_->left_out, work_->refused};
}

}  // namespace palpate::web
