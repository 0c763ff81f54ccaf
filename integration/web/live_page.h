#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "integration/web/https_server.h"
#include "integration/web/live_scene.h"
#include "module/haptics/servo/background.h"
#include "module/haptics/servo/position_source.h"
#include "module/session/session.h"

namespace palpate::web {

struct LivePageOptions {
  std::string address = "127.0.0.1";
  uint16_t port = 0;
  std::string title;  ///< of the page
  ViewChoices view;
  std::chrono::seconds certificate_valid = std::chrono::hours(24 * 30);
  std::function<void(const std::string& sentence)> on_note;  ///< on any thread; may be empty
};

/// A running scene as a page for browsers and their headsets: the page draws the moving volume
/// itself (live_view.js) from what LiveScene sends once; 30 times a second it gets the state of the
/// scene. Threads: the server's; one that packs the scene, at low priority; one that sends states.
///
/// A hand in the page is a probe without a force device. It moves `hand`, a PositionSource, and
/// nothing else: of a session with another device the page is a viewer. One client at a time holds
/// it, the first one that touches; it lets go when its hand does, when it leaves, and when nothing
/// comes from it for kSilence.
///
/// Texts of a client, JSON: {"hand": [x, y, z]} (world, m), {"hand": null}, {"play": true or
/// false}, {"scrub": share of the sequence}. Anything else closes its connection with a sentence.
class LivePage {
 public:
  /// Errors: as HttpsServer::start(). Nothing is drawn before begin().
  static Result<std::unique_ptr<LivePage>> start(LivePageOptions options);
  ~LivePage() { end(); }
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  /// `session` and `hand` (null: viewing only) are borrowed until end().
  void begin(Session& session, PositionSource* hand);
  /// Before the session's device is destroyed. Further calls do nothing.
  void end();
  /// A few words on the estimation of missing motion, shown in the page. Any thread.
  void set_note(const std::string& note);

  const HttpsServer& server() const { return *server_; }
  static constexpr std::chrono::milliseconds kSilence{300};

 private:
  LivePage() = default;
  WebReply get(std::string_view path);
  std::string take(uint64_t client, const std::string& text);
  void take_hand(uint64_t client, glm::dvec3 world_m);
  void let_go();
  void pack(std::stop_token stop);
  void send_state();

  LivePageOptions options_;
  std::mutex mutex_;  ///< guards what follows, up to the blank line
  Session* session_ = nullptr;
  PositionSource* hand_ = nullptr;
  std::shared_ptr<const std::string> description_, address_picture_;
  std::map<uint64_t, LiveScene::Part> parts_;
  uint64_t generation_ = 0;
  int volume_ = -1;
  std::string note_;
  SceneSnapshot snapshot_;
  Transform world_from_device_;

  std::atomic<uint64_t> holder_{0};                   ///< client; 0: no one
  std::chrono::steady_clock::time_point heard_at_{};  ///< from the holder; the server's thread
  std::unique_ptr<HttpsServer> server_;
  std::jthread packs_;
  std::unique_ptr<Background> states_;
};

}  // namespace palpate::web
