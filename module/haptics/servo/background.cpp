#include "module/haptics/servo/background.h"

namespace palpate {

Background::Background(std::chrono::milliseconds pause, std::function<void()> work)
    : work_(std::move(work)), thread_([this, pause] {
        std::unique_lock lock(mutex_);
        while (!over_changed_.wait_for(lock, pause, [this] { return over_; })) {
          lock.unlock();
          work_();
          lock.lock();
        }
      }) {}

Background::~Background() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  over_changed_.notify_one();
  thread_.join();
  work_();
}

}  // namespace palpate
