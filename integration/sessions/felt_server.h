#pragma once

#include <memory>
#include <thread>

#include "integration/openigtlink/server.h"
#include "module/session/session.h"

namespace palpate::sessions {

/// Sends what is felt to OpenIGTLink clients while it is felt, from threads of low priority: ten
/// times a second where the proxy is (TRANSFORM "palpate_proxy") and the force (SENSOR
/// "palpate_force", N), once a second how it is (STATUS "palpate"), and twice a second at most the
/// first volume as it is moved now (IMAGE "palpate_volume") and by how much (IMAGE
/// "palpate_motion", three values, mm). Places, vectors and the force are those of the volume's own
/// patient space.
class FeltServer {
 public:
  /// kBadInput: the port can not be had.
  static Result<std::unique_ptr<FeltServer>> start(uint16_t port);

  /// `session` is borrowed, until end().
  void begin(Session& session);
  void end();
  uint16_t port() const { return server_->port(); }
  const openigtlink::Server& server() const { return *server_; }

 private:
  FeltServer() = default;
  void send_places(Session& session);
  void send_images(std::stop_token stop, Session& session);

  std::unique_ptr<openigtlink::Server> server_;
  std::mutex mutex_;
  SceneSnapshot snapshot_;  ///< the newest; now_ns 0: none yet
  int ticks_ = 0;
  std::unique_ptr<Background> places_;
  std::jthread images_;
};

}  // namespace palpate::sessions
