#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace palpate {

/// An ordinary thread that does `work` every `pause`, and once more when it is destroyed. It polls,
/// since a real-time thread that had to wake it would need a system call.
class Background {
 public:
  Background(std::chrono::milliseconds pause, std::function<void()> work);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

 private:
  std::function<void()> work_;
  std::mutex mutex_;
  std::condition_variable over_changed_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace palpate
