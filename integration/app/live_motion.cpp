#include "integration/app/live_motion.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>

#include "compute/motion/estimator.h"
#include "integration/app/frames.h"

namespace palpate::app {
namespace {

constexpr int kNice = 10;

int64_t steady_ns() {
  return std::chrono::steady_clock::now().time_since_epoch().count();
}

/// Of this thread and, by inheritance, of all that the Vulkan driver starts from it.
void yield_to_the_hand() {
  setpriority(PRIO_PROCESS, id_t(gettid()), kNice);
}

}  // namespace

LiveMotion::LiveMotion(const FeltScene& scene, const DeviceOptions& device,
                       const std::string& preset, OnStep on_step, Console& console)
    : device_(device), preset_(preset), on_step_(std::move(on_step)), console_(console) {
  for (const MissingMotion& missing : scene.missing) {
    jobs_.push_back({missing, scene.spec.volumes[missing.volume].cyclic});
    steps_ += size_t(scene.data[missing.volume]->times.steps());
  }
  if (jobs_.empty()) {
    done_ = true;
    return;
  }
  worker_ = std::jthread([this](std::stop_token stop) { run(stop); });
}

LiveMotion::~LiveMotion() = default;

void LiveMotion::wait() {
  if (worker_.joinable()) worker_.join();
}

std::string LiveMotion::text() const {
  if (done_) return {};
  std::string text = fmt::format("motion {} of {} steps", known_.load(), steps_.load());
  const double share = share_, elapsed_s = 1e-9 * double(steady_ns() - start_ns_);
  // Before this nothing can be said about the time left.
  if (start_ns_ > 0 && share > 0.02 && elapsed_s > 0.5)
    text += ", " + duration_text(elapsed_s * (1.0 - share) / share) + " left";
  return text;
}

std::string LiveMotion::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void LiveMotion::run(std::stop_token stop) {
  yield_to_the_hand();
  const auto start = std::chrono::steady_clock::now();
  Status status = Nothing{};
  for (const Job& job : jobs_) {
    if (status) status = estimate(job, stop);
  }
  if (!status) {
    const std::lock_guard lock(mutex_);
    trouble_ = status.error().message;
  } else {
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  done_ = true;
}

Status LiveMotion::estimate(const Job& job, std::stop_token stop) {
  auto frames = job.missing.open();
  if (!frames) return frames.error();
  const auto context = open_device(device_, console_);
  if (!context) return context.error();
  const auto preset = motion_preset(preset_);
  if (!preset)
    return Error{ErrorKind::kBadInput,
                 "There is no preset '" + preset_ + "': see 'palpate motion --help'"};
  EstimatorOptions options;
  options.motion = *preset;
  options.cyclic = job.cyclic;
  Status taken = Nothing{};
  start_ns_ = steady_ns();
  auto estimator = SequenceEstimator::open(
      *context, frames->grid, options,
      [&](PairMotion motion) {
        if (!taken) return;
        taken = on_step_(job.missing.volume, motion.fixed_frame,
                         MotionMap::of(motion.field, &motion.confidence));
        ++known_;
      },
      [&](size_t, size_t, double share) { share_ = (double(known_) + share) / double(steps_); });
  if (!estimator) return estimator.error();
  const std::stop_callback on_stop(stop, [&] { (*estimator)->cancel(); });
  for (size_t k = 0; k < frames->count && !stop.stop_requested(); ++k) {
    auto frame = frames->read(k);
    if (!frame) {
      (*estimator)->cancel();
      return frame.error();
    }
    if (!(*estimator)->push(k, *frame)) break;
  }
  const Status finished = (*estimator)->finish();
  if (stop.stop_requested()) return Nothing{};
  return taken ? finished : taken;
}

}  // namespace palpate::app
