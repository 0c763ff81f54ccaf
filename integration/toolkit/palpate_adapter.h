#pragma once

// Shared by the adapters for ITK and VTK. Header only; not an interface for programs.
#include <palpate.h>

#include <atomic>
#include <chrono>
#include <future>
#include <string>

namespace palpate::adapter {

/// A handle that is closed with its owner.
template <class Handle, PalResult (*close)(Handle**)>
struct UniqueHandle {
  Handle* handle = nullptr;
  UniqueHandle() = default;
  UniqueHandle(const UniqueHandle&) = delete;
  UniqueHandle& operator=(const UniqueHandle&) = delete;
  ~UniqueHandle() { close(&handle); }
};

struct Finished {
  PalResult result = PAL_OK;
  std::string sentence;  ///< on a failure
};

/// Finishes an estimation on another thread. Meanwhile, on this thread, `on_progress(share)` is
/// called whenever `share`, which the estimator's on_progress sets, has changed, and the estimation
/// is cancelled as soon as `is_stopped()`. An exception from these also cancels it, and is passed
/// on to the caller.
template <class OnProgress, class IsStopped>
Finished finish(PalEstimator* estimator, PalMotion*& motion, const std::atomic<double>& share,
                const OnProgress& on_progress, const IsStopped& is_stopped) {
  Finished finished;
  auto running = std::async(std::launch::async, [&] {
    finished.result = pal_estimator_finish(estimator, &motion);
    finished.sentence = pal_last_error();  // of that thread
  });
  double told = -1.0;
  try {
    while (running.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
      const double now = share;
      if (now != told) {
        told = now;
        on_progress(now);
      }
      if (is_stopped()) pal_estimator_cancel(estimator);
    }
  } catch (...) {
    pal_estimator_cancel(estimator);
    running.wait();
    throw;
  }
  running.get();
  return finished;
}

}  // namespace palpate::adapter
