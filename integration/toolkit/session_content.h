#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "integration/running/connected_session.h"
#include "integration/toolkit/handles.h"

namespace palpate::toolkit {

/// Sentences from any thread, which the session passes to its host on one thread, one after the
/// other and without a lock of ours.
class SessionNotes {
 public:
  void say(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    if (sentences_.size() < kMost) sentences_.push_back(sentence);
  }
  /// The oldest sentence, or "".
  std::string next() {
    const std::lock_guard lock(mutex_);
    if (sentences_.empty()) return {};
    std::string sentence = std::move(sentences_.front());
    sentences_.pop_front();
    return sentence;
  }

 private:
  static constexpr size_t kMost = 256;
  std::mutex mutex_;
  std::deque<std::string> sentences_;
};

/// The content of a PalSession.
class SessionContent {
 public:
  explicit SessionContent(std::shared_ptr<ContextContent> context) : context_(std::move(context)) {}
  ~SessionContent() { (void)finish(); }
  SessionContent(const SessionContent&) = delete;
  SessionContent& operator=(const SessionContent&) = delete;

  std::shared_ptr<SessionNotes> notes = std::make_shared<SessionNotes>();
  running::ConnectedSession connected;
  bool host_ticks = false;
  GripReading grip;  ///< of host ticks, by their thread alone

  const std::shared_ptr<ContextContent>& context() const { return context_; }
  /// Once it has been started.
  Session& session() const { return *connected.session; }
  /// The newest tick, for a viewer. Any thread: waits only for other threads in this function.
  SceneSnapshot snapshot() {
    const std::lock_guard lock(mutex_);
    session().newest(SnapshotReader::kPictures, snapshot_);
    return snapshot_;
  }
  /// The same, with the forces of that tick. Before the first one: as it was made.
  std::pair<SceneSnapshot, TickOutput> snapshot_and_tick() {
    const std::lock_guard lock(mutex_);
    session().newest(SnapshotReader::kPictures, snapshot_);
    session().newest(0, tick_);
    return {snapshot_, tick_};
  }

  /// From now on frames given to push() are followed.
  void follow(const Volume& first, LiveSequenceOptions options) {
    pushed_grid_ = first.grid;
    pushed_ = std::make_unique<LiveSequence>(session(), 0, first, std::move(options));
  }
  /// Takes a frame of the host; any thread, calls wait for each other. Errors: kBadInput for a
  /// session without such a source, or after stop().
  Status push(const PalGrid* grid, PalSampleType type, const void* samples, int64_t time_ns);
  /// What happened to the live frames.
  LiveNumbers live_numbers();

  /// From now on takes no frame and serves nothing; the force ramps to zero. Any thread.
  void stop();
  /// The same, and finishes the files. Errors: kBadOutput if one is not complete. Call it once, by
  /// the last owner.
  Status finish();

 private:
  std::shared_ptr<ContextContent> context_;
  std::mutex mutex_;
  SceneSnapshot snapshot_;
  TickOutput tick_;
  std::mutex pushing_, stopping_;
  std::mutex live_mutex_;  ///< guards the members below; never locked for long
  Grid pushed_grid_;
  std::unique_ptr<LiveSequence> pushed_;
  LiveNumbers last_numbers_;
  bool finished_ = false;
};

}  // namespace palpate::toolkit
