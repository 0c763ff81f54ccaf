#pragma once

#include <mutex>

#include "integration/toolkit/handles.h"
#include "module/haptics/recording.h"
#include "module/session/session.h"

namespace palpate::toolkit {

/// What a PalSession stands for.
class SessionContent {
 public:
  SessionContent(std::shared_ptr<ContextContent> context, std::unique_ptr<ForceDevice> device)
      : context_(std::move(context)), device_(std::move(device)) {}

  /// Of every tick; null: nothing is recorded. Outlives the session.
  std::unique_ptr<Recorder> recorder;
  /// The session, once it has been started.
  std::unique_ptr<Session> session;
  bool host_ticks = false;

  const std::shared_ptr<ContextContent>& context() const { return context_; }
  ForceDevice* device() { return device_.get(); }
  /// The newest tick as an eye sees it. Any thread: waits for others in this call alone.
  SceneMoment moment() {
    const std::lock_guard lock(mutex_);
    session->newest(MomentReader::kPictures, moment_);
    return moment_;
  }

 private:
  std::shared_ptr<ContextContent> context_;
  std::unique_ptr<ForceDevice> device_;  ///< none where the host ticks; outlives the session
  std::mutex mutex_;
  SceneMoment moment_;
};

}  // namespace palpate::toolkit
