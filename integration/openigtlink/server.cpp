#include "integration/openigtlink/server.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <exception>
#include <optional>

namespace palpate::openigtlink {
namespace {

constexpr auto kPause = std::chrono::milliseconds(5);
constexpr size_t kMostWaiting = 8;  // messages that a client may be behind
constexpr int kMostReads = 16;      // of what a client says, at a time

/// A socket that listens on all addresses of a family; of IPv6, on those of IPv4 too. `taken`:
/// there is such a family, but not the port.
std::optional<Socket> listening(int family, uint16_t port, bool& taken) {
  Socket socket = Socket::make(family);
  if (!socket.is_open()) return std::nullopt;
#ifndef _WIN32
  // A port of which old connections are still ending. On Windows it would share one with another
  // program.
  socket.set(SOL_SOCKET, SO_REUSEADDR, 1);
#endif
  if (family == AF_INET6 && !socket.set(IPPROTO_IPV6, IPV6_V6ONLY, 0)) return std::nullopt;
  sockaddr_in6 six{};
  six.sin6_family = AF_INET6;
  six.sin6_addr = in6addr_any;
  six.sin6_port = htons(port);
  sockaddr_in four{};
  four.sin_family = AF_INET;
  four.sin_addr.s_addr = htonl(INADDR_ANY);
  four.sin_port = htons(port);
  const bool bound =
      family == AF_INET6
          ? bind(socket.handle(), reinterpret_cast<const sockaddr*>(&six), sizeof six) == 0
          : bind(socket.handle(), reinterpret_cast<const sockaddr*>(&four), sizeof four) == 0;
  if (bound && listen(socket.handle(), 4) == 0) return socket;
  taken = is_port_taken();
  return std::nullopt;
}

}  // namespace

Result<std::unique_ptr<Server>> Server::start(uint16_t port) {
  auto server = std::unique_ptr<Server>(new Server);
  bool taken = false;
  auto listener = listening(AF_INET6, port, taken);
  // Where the system has no IPv6; a port that is taken there is not had by halves.
  if (!listener && !taken) listener = listening(AF_INET, port, taken);
  if (!listener)
    return Error{ErrorKind::kBadInput,
                 fmt::format("Port {} can not be had: another program has it, or it needs more "
                             "rights; choose another",
                             port)};
  server->listener_ = std::move(*listener);
  sockaddr_storage at{};
  socklen_t size = sizeof at;
  getsockname(server->listener_.handle(), reinterpret_cast<sockaddr*>(&at), &size);
  // The port lies at the same place in addresses of both families.
  server->port_ = ntohs(reinterpret_cast<const sockaddr_in*>(&at)->sin_port);
  server->thread_ = std::jthread([s = server.get()](std::stop_token stop) { s->run(stop); });
  return server;
}

Server::~Server() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Server::send(std::shared_ptr<const Bytes> message) {
  if (clients_ == 0) return;
  const std::lock_guard lock(mutex_);
  fresh_.push_back(std::move(message));
}

/// An exception here would end the host's program. If memory runs out, all clients are
/// disconnected, which frees the messages that wait for them; they may connect again.
void Server::run(std::stop_token stop) {
  std::list<Connection> clients;
  while (!stop.stop_requested()) {
    try {
      serve(clients);
    } catch (const std::exception&) {
      for (const Connection& client : clients) missed_ += client.waiting.size();
      clients.clear();
    }
    clients_ = clients.size();
    std::this_thread::sleep_for(kPause);
  }
}

/// Accepts new clients, and sends to each as much as its socket takes without waiting.
void Server::serve(std::list<Connection>& clients) {
  if (clients.size() < kMostClients) {
    Socket socket = listener_.accept();
    if (socket.is_open()) {
      clients.push_back({std::move(socket), {}, 0});
      ++connections_;
    }
  }
  std::list<std::shared_ptr<const Bytes>> fresh;
  {
    const std::lock_guard lock(mutex_);
    fresh.swap(fresh_);
  }
  for (auto client = clients.begin(); client != clients.end();) {
    for (const auto& message : fresh) {
      if (client->waiting.size() < kMostWaiting)
        client->waiting.push_back(message);
      else
        ++missed_;
    }
    std::array<std::byte, 4096> said;
    size_t got = 1;
    SocketState state = SocketState::kDone;
    // One that never ends must not hold up the others.
    for (int n = 0; n < kMostReads && state == SocketState::kDone && got > 0; ++n)
      state = client->socket.receive(said.data(), said.size(), got);
    bool gone = state == SocketState::kFailed || (state == SocketState::kDone && got == 0);
    while (!gone && !client->waiting.empty()) {
      const Bytes& message = *client->waiting.front();
      size_t sent = 0;
      state = client->socket.send(message.data() + client->at, message.size() - client->at, sent);
      if (state != SocketState::kDone) {
        gone = state == SocketState::kFailed;
        break;
      }
      client->at += sent;
      if (client->at < message.size()) continue;
      client->at = 0;
      client->waiting.pop_front();
      ++sent_;
    }
    client = gone ? clients.erase(client) : std::next(client);
  }
}

}  // namespace palpate::openigtlink
