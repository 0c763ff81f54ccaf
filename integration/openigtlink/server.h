#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "compute/volume/result.h"
#include "integration/openigtlink/message.h"
#include "integration/openigtlink/socket.h"

namespace palpate::openigtlink {

/// Sends messages to all that connect, at most kMostClients at a time, from a thread of its own.
/// Nobody is waited for: who has not taken a message yet misses the next ones, which is counted.
/// What the clients say is thrown away. If memory runs out they are disconnected.
class Server {
 public:
  static constexpr size_t kMostClients = 8;

  /// kBadInput: the port can not be had. 0: any that is free. On all addresses of this machine,
  /// IPv4's and, where it has it, IPv6's.
  static Result<std::unique_ptr<Server>> start(uint16_t port);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  uint16_t port() const { return port_; }
  size_t clients() const { return clients_; }
  /// How many have connected since the start: who comes back is another one.
  uint64_t connections() const { return connections_; }
  /// To each client that has taken everything before. Any thread; does not wait.
  void send(std::shared_ptr<const Bytes> message);
  uint64_t sent() const { return sent_; }
  uint64_t missed() const { return missed_; }  ///< messages that a slow client did not get

 private:
  struct Connection {
    Socket socket;
    std::list<std::shared_ptr<const Bytes>> waiting;
    size_t at = 0;  ///< bytes of the first that are gone
  };
  Server() = default;
  void run(std::stop_token stop);
  void serve(std::list<Connection>& clients);

  Socket listener_;
  uint16_t port_ = 0;
  std::mutex mutex_;  ///< of fresh_
  std::list<std::shared_ptr<const Bytes>> fresh_;
  std::atomic<size_t> clients_{0};
  std::atomic<uint64_t> connections_{0}, sent_{0}, missed_{0};
  std::jthread thread_;
};

}  // namespace palpate::openigtlink
