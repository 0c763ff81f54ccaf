#include "integration/app/estimation.h"

#include <fmt/format.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

namespace palpate::app {
namespace {

/// Pairs waiting to be judged and written before the estimator is blocked.
constexpr size_t kWaitingPairs = 2;

/// Three threads: the caller reads and pushes frames, the estimator's worker puts its fields into a
/// queue, and a delivery thread takes them from there to judge and write them.
class Estimation {
 public:
  Estimation(const std::shared_ptr<vulkan::Context>& context, const EstimationJob& job,
             const OnPair& on_pair, Console& console, std::stop_token stop)
      : context_(context),
        job_(job),
        on_pair_(on_pair),
        console_(console),
        stop_(std::move(stop)) {}

  Status run() {
    auto estimator = SequenceEstimator::open(
        context_, job_.grid, job_.options, [this](PairMotion motion) { take(std::move(motion)); },
        [this](size_t fixed, size_t moving, double share) {
          show(share, fmt::format("frame {} to {}", fixed, moving));
        });
    if (!estimator) return estimator.error();
    estimator_ = std::move(*estimator);
    announce();
    start_delivery();
    Status done = Nothing{};
    {
      const std::stop_callback on_stop(stop_, [&] { estimator_->cancel(); });
      done = feed();
      if (!done) estimator_->cancel();
      const Status finished = estimator_->finish();
      if (done && !finished) done = finished;
    }
    {
      // Its memory is free for judging.
      const std::lock_guard lock(queue_mutex_);
      estimator_.reset();
    }
    finish_delivery();
    console_.end_progress();
    if (stop_.stop_requested()) return stopped();
    if (!delivered_) return delivered_;
    return done;
  }

 private:
  void announce() {
    const MemoryEstimate memory = estimator_->memory();
    console_.say(fmt::format("Memory    {} of {} on the device{}",
                             bytes_text(double(memory.device_bytes)),
                             bytes_text(double(memory.budget_bytes)),
                             memory.slabs > 1 ? fmt::format(", in {} slabs", memory.slabs) : ""));
    if (job_.options.backward && !memory.backward)
      console_.say(
          "There is too little device memory to check each field by a second one from moving to "
          "fixed.");
    if (has_sliding_step(plan_motion(job_.grid, job_.options.motion)) && !memory.sliding)
      console_.say(
          "There is too little device memory to sharpen the borders at which material slides: the "
          "field is smooth across them.");
  }

  /// Reads and pushes every frame. If a push fails, finish() returns the cause.
  Status feed() {
    for (size_t k = 0; k < job_.frame_count && !stop_.stop_requested(); ++k) {
      auto read = read_frame(k);
      if (!read) return read.error();
      auto frame = std::make_shared<const Volume>(std::move(*read));
      if (job_.keeps_frames) {
        const std::lock_guard lock(frames_mutex_);
        frames_[k] = frame;
      }
      const Status pushed = same_geometry(frame->grid, job_.grid)
                                ? estimator_->push(k, *frame)
                                : estimator_->push(k, resampled(*frame, job_.grid));
      if (!pushed && pushed.error().kind == ErrorKind::kBadInput) return pushed;
      if (!pushed) break;
    }
    return Nothing{};
  }

  Result<Volume> read_frame(size_t k) {
    const std::lock_guard lock(read_mutex_);
    return job_.read_frame(k);
  }

  /// Frame k of a pair that is judged.
  Status bring(size_t k, std::shared_ptr<const Volume>& frame) {
    if (frame) return Nothing{};
    auto read = read_frame(k);
    if (!read) return read.error();
    frame = std::make_shared<const Volume>(std::move(*read));
    return Nothing{};
  }

  /// One unit of progress per field; judging and writing run in parallel to the next estimation.
  void show(double share, const std::string& doing) {
    console_.progress((double(units_done_) + share) / double(job_.pair_count()), doing);
  }

  /// Called on the estimator's worker.
  void take(PairMotion motion) {
    ++units_done_;
    EstimatedPair pair{std::move(motion), {}, {}};
    if (job_.keeps_frames) {
      const std::lock_guard lock(frames_mutex_);
      pair.fixed = frames_.at(pair.motion.fixed_frame);
      pair.moving = frames_.at(pair.motion.moving_frame);
      std::erase_if(frames_, [&](const auto& frame) {
        return frame.first < pair.motion.moving_frame && !(job_.options.cyclic && frame.first == 0);
      });
    }
    std::unique_lock lock(queue_mutex_);
    queue_changed_.wait(lock, [&] { return queue_.size() < kWaitingPairs || failed_; });
    if (!failed_) queue_.push_back(std::move(pair));
    queue_changed_.notify_all();
  }

  void start_delivery() {
    delivery_ = std::thread([this] { deliver(); });
  }

  void finish_delivery() {
    {
      const std::lock_guard lock(queue_mutex_);
      closed_ = true;
    }
    queue_changed_.notify_all();
    delivery_.join();
  }

  /// Runs on the delivery thread until the queue is closed and empty.
  void deliver() {
    for (;;) {
      std::unique_lock lock(queue_mutex_);
      queue_changed_.wait(lock, [&] { return !queue_.empty() || closed_; });
      if (queue_.empty()) return;
      EstimatedPair pair = std::move(queue_.front());
      queue_.pop_front();
      queue_changed_.notify_all();
      lock.unlock();
      const Status status = hand_over(std::move(pair));
      if (!status) give_up(status);
    }
  }

  Status hand_over(EstimatedPair pair) {
    if (stop_.stop_requested()) return stopped();
    Status there = bring(pair.motion.fixed_frame, pair.fixed);
    if (there) there = bring(pair.motion.moving_frame, pair.moving);
    return there ? on_pair_(std::move(pair)) : there;
  }

  /// Keeps the first error. Empties the queue, so that no thread waits for room in it.
  void give_up(const Status& status) {
    const std::lock_guard lock(queue_mutex_);
    if (delivered_) delivered_ = status;
    failed_ = true;
    queue_.clear();
    queue_changed_.notify_all();
    if (estimator_) estimator_->cancel();
  }

  const std::shared_ptr<vulkan::Context>& context_;
  const EstimationJob& job_;
  const OnPair& on_pair_;
  Console& console_;
  const std::stop_token stop_;
  std::unique_ptr<SequenceEstimator> estimator_;

  std::mutex read_mutex_;  ///< frames are read by two threads
  std::mutex frames_mutex_;
  std::map<size_t, std::shared_ptr<const Volume>> frames_;  ///< read and still needed

  std::mutex queue_mutex_;
  std::condition_variable queue_changed_;
  std::deque<EstimatedPair> queue_;
  bool closed_ = false;
  bool failed_ = false;
  Status delivered_ = Nothing{};
  std::thread delivery_;
  std::atomic<size_t> units_done_{0};
};

}  // namespace

Error stopped() {
  return {ErrorKind::kCancelled, "Stopped as asked: no output was written or changed"};
}

Status estimate(const std::shared_ptr<vulkan::Context>& context, const EstimationJob& job,
                const OnPair& on_pair, Console& console, std::stop_token stop) {
  return Estimation(context, job, on_pair, console, std::move(stop)).run();
}

}  // namespace palpate::app
