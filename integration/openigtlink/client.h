#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "compute/volume/result.h"
#include "compute/volume/volume.h"
#include "integration/openigtlink/message.h"

namespace palpate::openigtlink {

class Socket;

/// igtl://HOST[:PORT][?crc=none], as a person gives it; an IPv6 address in [ ].
struct ServerAddress {
  std::string host;
  uint16_t port = 18944;
  /// Messages with the CRC 0, whose sender computes none, are taken as they are. Without it they
  /// are left out, as those with a wrong CRC always are.
  bool accepts_no_crc = false;
};
bool is_address(const std::string& text);
/// kBadInput in one sentence.
Result<ServerAddress> read_address(const std::string& text);

/// An image as it arrived: all of it.
struct ArrivedImage {
  std::string device;
  Volume volume;           ///< LPS, mm
  int64_t arrived_ns = 0;  ///< monotonic: when its last byte was here
  double time_s = 0.0;     ///< the sender's clock; 0: it gave none
};

struct ClientOptions {
  std::string image;             ///< device name of the images; empty: that of the first one
  std::string transform;         ///< device name of the transforms; empty: none are taken ...
  bool first_transform = false;  ///< ... or, with this, those of the first that sends any
  /// On the client's thread; they hold up what arrives, so they must be short.
  std::function<void(ArrivedImage)> on_image;
  std::function<void(const Rigid&)> on_transform;
  /// called with a sentence; never twice in a row with the same one
  std::function<void(const std::string&)> on_note;
};

/// What came, and what of it was not used and why.
struct ClientNumbers {
  uint64_t connections = 0, messages = 0, images = 0, transforms = 0;
  std::map<std::string, uint64_t> refused;  ///< reason in a few words -> how often
};

/// Listens to an OpenIGTLink server on a thread of its own; connects again, every half second, when
/// the connection is lost or what arrives is not OpenIGTLink. Every message is checked before it is
/// used, and memory is allocated only for bytes that have arrived. A part of an image changes the
/// whole image that came before it, at once. What is damaged, older than what came before, the same
/// once more, flat, a part without a whole image, or no image of a grid is left out and counted.
/// Where memory runs out, or a function that is called here throws, that is said
/// and counted too, and it connects again.
class Client {
 public:
  /// kBadInput if there is no such host. Does not wait for a connection.
  static Result<std::unique_ptr<Client>> start(const ServerAddress& server, ClientOptions options);
  /// Ends the thread within 100 ms.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool is_connected() const { return connected_; }
  ClientNumbers numbers() const;

 private:
  Client(ClientOptions options) : options_(std::move(options)) {}
  struct Address;
  void run(std::stop_token stop);
  void connect_once(std::stop_token stop);
  void listen(const Socket& socket, std::stop_token stop);
  void take(const Header& header, std::span<const std::byte> body);
  void take_image(const Header& header, std::span<const std::byte> content);
  void take_part(const ImageMessage& part);
  void give(const ImageMessage& image);
  void refuse(const std::string& reason, const std::string& sentence);
  void say(const std::string& sentence);

  ClientOptions options_;
  std::string name_;  ///< "host:port"
  bool accepts_no_crc_ = false;
  std::shared_ptr<Address> address_;
  std::atomic<bool> connected_{false};
  mutable std::mutex mutex_;
  ClientNumbers numbers_;
  // The thread's alone.
  std::string last_said_, device_, transform_device_;
  std::optional<ImageMessage> whole_;  ///< the last whole image, into which parts are put
  double last_time_s_ = 0.0;
  int64_t arrived_ns_ = 0;
  uint64_t last_crc_ = 0;
  bool any_image_ = false, said_waiting_ = false;
  std::jthread thread_;
};

}  // namespace palpate::openigtlink
