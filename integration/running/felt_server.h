#pragma once

#include <memory>
#include <thread>

#include "integration/openigtlink/server.h"
#include "module/session/session.h"

namespace palpate::running {

/// Sends the running scene to OpenIGTLink clients, on two threads: places and images, the latter at
/// low priority. Ten times a second: the proxy (TRANSFORM "palpate_proxy") and the force (SENSOR
/// "palpate_force", N). Once a second: the state (STATUS "palpate"). At most twice a second: the
/// first volume as it is moved now (IMAGE "palpate_volume") and its displacement (IMAGE
/// "palpate_motion", three values, mm). All are in the volume's own patient space, RAS in the
/// messages.
class FeltServer {
 public:
  /// Errors: kBadInput: the port can not be opened.
  static Result<std::unique_ptr<FeltServer>> start(uint16_t port);

  /// Starts to send. `session` is borrowed until end().
  void begin(Session& session);
  void end();
  uint16_t port() const { return server_->port(); }
  const openigtlink::Server& server() const { return *server_; }

 private:
  FeltServer() = default;
  void send_places(Session& session);
  void send_images(std::stop_token stop, Session& session);

  std::unique_ptr<openigtlink::Server> server_;
  std::mutex mutex_;        ///< guards snapshot_
  SceneSnapshot snapshot_;  ///< the newest; now_ns 0: none yet
  int ticks_ = 0;
  std::unique_ptr<Background> places_;
  std::jthread images_;
};

}  // namespace palpate::running
