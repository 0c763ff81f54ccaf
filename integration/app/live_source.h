#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "integration/openigtlink/client.h"
#include "integration/scenes/load_scene.h"
#include "module/session/live_sequence.h"

namespace palpate::app {

struct LiveSourceOptions {
  std::string image;      ///< device name of the images; empty: the first one's
  std::string transform;  ///< device name of the transforms that place the volume; empty: none
  bool keep_cycles = true;
  std::string preset = "fast";
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  std::function<void(const std::string&)> on_note;
};

/// Frames from an OpenIGTLink server, from the first one on: joins the client with the session.
class LiveSource {
 public:
  /// kBadInput: no place, or no such host.
  static Result<std::unique_ptr<LiveSource>> open(const std::string& place,
                                                  LiveSourceOptions options);
  /// Ends the client, then what follows it.
  ~LiveSource();
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  /// The scene with the first frame, which is waited for; `doing` hears so meanwhile.
  Result<LoadedScene> load(const scenes::SequenceChoices& choices, bool felt,
                           const scenes::OnDoing& doing);
  /// Follows from now on. `session` is borrowed and feels what load() gave.
  void begin(Session& session);
  /// No frame goes into the session any more. Before the session ends.
  void end();

  /// For the live line: "12 frames, 0.21 s behind"; and at the end, in full.
  std::string live_text() const;
  std::string summary() const;
  /// What came and what became of it; after end().
  const LiveNumbers& numbers() const { return last_numbers_; }
  const openigtlink::ClientNumbers& arrived() const { return client_numbers_; }

 private:
  explicit LiveSource(LiveSourceOptions options) : options_(std::move(options)) {}
  void take(openigtlink::ArrivedImage image);
  void take(const openigtlink::Rigid& rigid);
  void say(const std::string& sentence);

  LiveSourceOptions options_;
  std::string place_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<openigtlink::ArrivedImage> first_;
  LiveNumbers last_numbers_;  ///< after end(), with the next
  openigtlink::ClientNumbers client_numbers_;
  Session* session_ = nullptr;
  std::unique_ptr<LiveSequence> sequence_;
  std::optional<openigtlink::Rigid> from_,
      at_;  ///< transforms: the one that changes nothing, and the last
  Transform placed_, start_;
  uint64_t jumps_ = 0;
  std::unique_ptr<openigtlink::Client> client_;
};

}  // namespace palpate::app
