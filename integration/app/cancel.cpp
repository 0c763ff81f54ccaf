#include "integration/app/cancel.h"

#include <cstdlib>
#include <string_view>
#include <utility>

#include "integration/app/exit_code.h"
#include "integration/files/descriptor.h"
#include "module/haptics/servo/emergency.h"

namespace palpate::app {
namespace {

/// Called on a thread that shares no lock with threads that may hang. Waits for the end of the
/// force's ramp.
[[noreturn]] void end_now(std::string_view sentence) {
  files::write_some(2, sentence.data(), sentence.size());
  emergency::end_process(kExitInternal);
}

}  // namespace

CancelOnSignal::CancelOnSignal() {
  watcher_ = std::jthread([this](std::stop_token ended) { watch(std::move(ended)); });
}

CancelOnSignal::~CancelOnSignal() {
  watcher_.request_stop();
  watcher_.join();
  requests_.give_back(source_.stop_requested());
}

void CancelOnSignal::watch(std::stop_token ended) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point asked;
  // A request wakes this thread at once. The time limit of wait() bounds the delay after the end of
  // the work.
  while (!ended.stop_requested()) {
    const bool is_new = requests_.wait();
    if (is_new && at_once_) end_now("palpate: Stopped as asked, before anything began.\n");
    if (is_new && source_.stop_requested() && Clock::now() - asked > kSameRequest)
      end_now("palpate: Ended at once, after a second signal.\n");
    if (is_new && !source_.stop_requested()) {
      asked = Clock::now();
      source_.request_stop();
    }
    const auto patience = patience_.load();
    if (source_.stop_requested() && patience != std::chrono::seconds::max() &&
        Clock::now() - asked > patience)
      end_now("palpate: Something did not stop when it was asked to, so the program was ended.\n");
  }
}

}  // namespace palpate::app
