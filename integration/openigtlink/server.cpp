#include "integration/openigtlink/server.h"

#include <fmt/format.h>
#include <netinet/in.h>

#include <array>
#include <cerrno>
#include <chrono>

namespace palpate::openigtlink {
namespace {

constexpr auto kPause = std::chrono::milliseconds(5);
constexpr size_t kMostWaiting = 8;  // messages that a client may be behind
constexpr int kMostReads = 16;      // of what a client says, at a time

}  // namespace

Result<std::unique_ptr<Server>> Server::start(uint16_t port) {
  auto server = std::unique_ptr<Server>(new Server);
  server->listener_ = Socket(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(server->listener_.fd(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_ANY);
  at.sin_port = htons(port);
  socklen_t size = sizeof at;
  if (bind(server->listener_.fd(), reinterpret_cast<sockaddr*>(&at), size) != 0 ||
      listen(server->listener_.fd(), 4) != 0)
    return Error{ErrorKind::kBadInput,
                 fmt::format("Port {} can not be had: another program has it, or it needs more "
                             "rights; choose another",
                             port)};
  getsockname(server->listener_.fd(), reinterpret_cast<sockaddr*>(&at), &size);
  server->port_ = ntohs(at.sin_port);
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

void Server::run(std::stop_token stop) {
  std::list<Client> clients;
  while (!stop.stop_requested()) {
    if (clients.size() < kMostClients) {
      Socket socket(accept4(listener_.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
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
      bool gone = false;
      std::array<std::byte, 4096> said;
      ssize_t got = 0;
      // One that never ends must not hold up the others.
      for (int n = 0; n < kMostReads; ++n)
        if ((got = recv(client->socket.fd(), said.data(), said.size(), 0)) <= 0) break;
      gone = got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
      while (!gone && !client->waiting.empty()) {
        const Bytes& message = *client->waiting.front();
        const ssize_t n = ::send(client->socket.fd(), message.data() + client->at,
                                 message.size() - client->at, MSG_NOSIGNAL);
        if (n < 0) {
          gone = errno != EAGAIN && errno != EINTR;
          break;
        }
        client->at += size_t(n);
        if (client->at < message.size()) continue;
        client->at = 0;
        client->waiting.pop_front();
        ++sent_;
      }
      client = gone ? clients.erase(client) : std::next(client);
    }
    clients_ = clients.size();
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace palpate::openigtlink
