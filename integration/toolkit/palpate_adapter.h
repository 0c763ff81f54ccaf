#pragma once

// Shared by the adapters for ITK and VTK. Header only; not an interface for programs.
#include <palpate.h>

#include <atomic>
#include <chrono>
#include <future>
#include <string>

namespace palpate::adapter {

/// Owns a handle of palpate.h; closes it in the destructor.
template <class Handle, PalResult (*close)(Handle**)>
struct UniqueHandle {
  Handle* handle = nullptr;
  UniqueHandle() = default;
  UniqueHandle(const UniqueHandle&) = delete;
  UniqueHandle& operator=(const UniqueHandle&) = delete;
  ~UniqueHandle() { close(&handle); }
};

/// The result of finish().
struct Finished {
  PalResult result = PAL_OK;
  std::string sentence;  ///< pal_last_error() on a failure
};

/// Runs pal_estimator_finish() on a thread of its own and waits for it. `motion` is set if the
/// result is PAL_OK. Every 20 ms, on the calling thread: on_progress(now) is called if `share` has
/// changed, which the estimator's on_progress sets (0 to 1); the estimation is cancelled if
/// is_stopped() is true. An exception from on_progress or is_stopped cancels the estimation, and is
/// thrown again when it has ended.
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
