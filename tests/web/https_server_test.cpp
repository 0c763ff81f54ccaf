// The server of the live page, from the other side: TLS, requests and messages of clients that
// behave, and of some that do not.
#include "integration/web/https_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/x509.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <mutex>
#include <thread>

namespace palpate::web {
namespace {

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using ::testing::HasSubstr;
using Tls = beast::ssl_stream<net::ip::tcp::socket>;

std::unique_ptr<HttpsServer> serve(HttpsServerOptions options = {}) {
  if (!options.get)
    options.get = [](std::string_view path) -> WebReply {
      if (path == "part") return {"text/plain", std::make_shared<const std::string>("bytes")};
      return {};
    };
  if (!options.on_text)
    options.on_text = [](uint64_t, const std::string& text) {
      return text == "wrong" ? std::string("That is wrong") : std::string();
    };
  if (!options.on_join) options.on_join = [](uint64_t) { return std::string("hello"); };
  auto server = HttpsServer::start(std::move(options));
  EXPECT_TRUE(server) << (server ? "" : server.error().message);
  return server ? std::move(*server) : nullptr;
}

/// A client that trusts any certificate, as a person does who has compared the fingerprint.
struct Client {
  explicit Client(uint16_t port) {
    tls.set_verify_mode(ssl::verify_none);
    stream.next_layer().connect({net::ip::make_address("127.0.0.1"), port});
    stream.handshake(ssl::stream_base::client);
  }
  http::response<http::string_body> get(const std::string& target,
                                        http::verb verb = http::verb::get) {
    http::request<http::empty_body> request{verb, target, 11};
    request.set(http::field::host, "here");
    http::write(stream, request);
    http::response<http::string_body> response;
    http::read(stream, buffer, response);
    return response;
  }
  std::string fingerprint() {
    X509* const shown = SSL_get1_peer_certificate(stream.native_handle());
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned count = 0;
    X509_digest(shown, EVP_sha256(), digest.data(), &count);
    X509_free(shown);
    std::string text;
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    for (unsigned n = 0; n < count; ++n) {
      if (n > 0) text += ':';
      text += kDigits[digest[n] >> 4];
      text += kDigits[digest[n] & 15];
    }
    return text;
  }

  net::io_context io;
  ssl::context tls{ssl::context::tls_client};
  Tls stream{io, tls};
  beast::flat_buffer buffer;
};

/// A client that gets messages.
struct Listener {
  explicit Listener(const HttpsServer& server) : client(server.port()) {
    messages.handshake("here", "/" + server.token() + "/state");
  }
  std::string read() {
    beast::flat_buffer buffer;
    messages.read(buffer);
    return beast::buffers_to_string(buffer.data());
  }
  /// Why the server closed, once it has.
  std::string closed() {
    boost::system::error_code failure;
    while (!failure) {
      beast::flat_buffer buffer;
      messages.read(buffer, failure);
    }
    const auto reason = messages.reason().reason;
    return {reason.data(), reason.size()};
  }
  Client client;
  websocket::stream<Tls&> messages{client.stream};
};

TEST(HttpsServer, AnswersNothingWithoutItsToken) {
  const auto server = serve();
  Client client(server->port());
  const std::string there = "/" + server->token() + "/";
  EXPECT_EQ(client.get(there + "part").body(), "bytes");
  std::string other = server->token();
  other[0] = other[0] == '0' ? '1' : '0';
  for (const std::string& target : {std::string("/"), std::string("/part"), "/" + other + "/part",
                                    "/" + server->token(), "/" + server->token() + "0/part"})
    EXPECT_EQ(client.get(target).result(), http::status::forbidden) << target;
  for (const std::string& target :
       {there + "other", there + "../../etc/passwd", there + "/etc/passwd", there + "%2e%2e/part"})
    EXPECT_EQ(client.get(target).result(), http::status::not_found) << target;
  EXPECT_EQ(client.get(there + "part", http::verb::delete_).result(),
            http::status::method_not_allowed);
  EXPECT_EQ(server->traffic().refused, 5U);
}

TEST(HttpsServer, ShowsTheCertificateThatItNames) {
  const auto server = serve();
  EXPECT_EQ(Client(server->port()).fingerprint(), server->fingerprint());
}

TEST(HttpsServer, RenewsItsCertificateBeforeItExpires) {
  HttpsServerOptions options;
  options.certificate_valid = std::chrono::seconds(2);
  std::mutex mutex;
  std::string told;
  options.on_certificate = [&](const Certificate& renewed) {
    const std::lock_guard lock(mutex);
    told = renewed.fingerprint;
  };
  const auto server = serve(std::move(options));
  std::string shown = Client(server->port()).fingerprint();
  EXPECT_EQ(shown, server->fingerprint());
  // After half of its time.
  while (shown == server->fingerprint()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    shown = Client(server->port()).fingerprint();
  }
  const std::lock_guard lock(mutex);
  EXPECT_FALSE(told.empty());
}

TEST(HttpsServer, ClosesWhoDoesNotBehaveWithOneReason) {
  const auto server = serve();
  const auto reason_of = [&](const auto& does) {
    Listener listener(*server);
    boost::system::error_code ignored;
    does(listener, ignored);
    return listener.closed();
  };
  EXPECT_EQ(reason_of([](Listener& l, auto& e) {
              l.messages.write(net::buffer(std::string("wrong")), e);
            }),
            "That is wrong");
  EXPECT_THAT(reason_of([](Listener& l, auto& e) {
                l.messages.write(net::buffer(std::string(513, 'x')), e);
              }),
              HasSubstr("more than 512 bytes"));
  EXPECT_THAT(reason_of([](Listener& l, auto& e) {
                l.messages.binary(true);
                l.messages.write(net::buffer(std::string("right")), e);
              }),
              HasSubstr("not text"));
  EXPECT_THAT(reason_of([](Listener& l, auto& e) {
                for (int n = 0; n < 1000 && !e; ++n)
                  l.messages.write(net::buffer(std::string("right")), e);
              }),
              HasSubstr("More than 300 messages"));
  // Others are not disturbed.
  Listener listener(*server);
  EXPECT_EQ(listener.read(), "hello");
  EXPECT_EQ(server->traffic().refused, 4U);
}

TEST(HttpsServer, SendsToFiftyClientsAndRefusesNone) {
  const auto server = serve();
  std::vector<std::unique_ptr<Listener>> all;
  for (int n = 0; n < 50; ++n) all.push_back(std::make_unique<Listener>(*server));
  for (const auto& one : all) EXPECT_EQ(one->read(), "hello");
  server->send(std::make_shared<const std::string>("state"));
  for (const auto& one : all) EXPECT_EQ(one->read(), "state");
}

TEST(HttpsServer, AClientThatDoesNotReadGetsOnlyTheNewestState) {
  constexpr int kStates = 100;
  const auto server = serve();
  Listener slow(*server), quick(*server);
  EXPECT_EQ(slow.read(), "hello");
  EXPECT_EQ(quick.read(), "hello");
  // Larger than what the system buffers for a connection.
  const auto state = [](int n) {
    return std::make_shared<const std::string>(std::to_string(n) + std::string(1 << 18, ' '));
  };
  for (int n = 1; n <= kStates; ++n) {
    server->send(state(n));
    EXPECT_EQ(std::stoi(quick.read()), n) << "the other client gets every one";
  }
  EXPECT_GT(server->traffic().left_out, 0U);
  int count = 0, last = 0;
  while (last < kStates) {
    last = std::stoi(slow.read());
    ++count;
  }
  EXPECT_LT(count, kStates);
}

}  // namespace
}  // namespace palpate::web
