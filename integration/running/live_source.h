#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "integration/loading/load_scene.h"
#include "integration/openigtlink/client.h"
#include "module/session/live_sequence.h"

namespace palpate::running {

/// The scene of a live source of that name: its first frame, which stands still until a
/// LiveSequence follows the source. `felt` false: for viewing only. `placed`: transforms, or a
/// host, place the volume. Errors: kBadInput with one sentence. Any thread.
Result<LoadedScene> live_scene(const std::string& name, const Volume& first,
                               const loading::SequenceChoices& choices, bool felt, bool placed,
                               const loading::OnDoing& doing = {});

struct LiveSourceOptions {
  std::string image;      ///< device name of the images; empty: that of the first one
  std::string transform;  ///< device name of the transforms that place the volume; empty: none
  bool keep_cycles = true;
  std::string preset = "fast";
  std::function<Result<std::shared_ptr<vulkan::Context>>()> open_context;
  std::function<void(const std::string&)> on_note;
};

/// Frames from an OpenIGTLink server, from the first one on: connects the client with the session.
class LiveSource {
 public:
  /// Errors: kBadInput: no valid address, or no such host.
  static Result<std::unique_ptr<LiveSource>> open(const std::string& address,
                                                  LiveSourceOptions options);
  /// Ends the client, then the LiveSequence.
  ~LiveSource();
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  /// Waits for the first frame and returns its scene; `doing` is called meanwhile. Errors:
  /// kNoDevice if no frame has arrived after `most_s` seconds; 0: wait without limit.
  Result<LoadedScene> load(const loading::SequenceChoices& choices, bool felt,
                           const loading::OnDoing& doing, double most_s = 0.0);
  /// The first frame; after load().
  const Volume& first() const { return first_; }
  /// Follows the source from now on. `session` is borrowed and runs the scene of load(), or one
  /// that another source has loaded; `first` is that scene's first frame.
  void begin(Session& session, const Volume& first);
  /// After this no frame is given to the session. Call it before the session ends.
  void end();

  /// For the live line: "12 frames, 0.21 s behind"; at the end the full text.
  std::string live_text() const;
  std::string summary() const;
  /// What happened to the received frames. Any thread.
  LiveNumbers numbers() const;
  /// What was received; after end().
  const openigtlink::ClientNumbers& arrived() const { return client_numbers_; }

 private:
  explicit LiveSource(LiveSourceOptions options) : options_(std::move(options)) {}
  void take(openigtlink::ArrivedImage image);
  void take(const openigtlink::Rigid& rigid);
  void say(const std::string& sentence);

  LiveSourceOptions options_;
  std::string address_;
  Volume first_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<openigtlink::ArrivedImage> newest_;  ///< received while no LiveSequence runs
  LiveNumbers last_numbers_;                         ///< after end(), with the next
  openigtlink::ClientNumbers client_numbers_;
  Session* session_ = nullptr;
  std::unique_ptr<LiveSequence> sequence_;
  /// Transforms: the one at which the volume is at `start_`, and the last.
  std::optional<openigtlink::Rigid> from_, at_;
  Transform placed_, start_;
  uint64_t jumps_ = 0;
  std::unique_ptr<openigtlink::Client> client_;
};

}  // namespace palpate::running
