#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

namespace palpate {

/// Counters of two threads are a cache line apart, to avoid false sharing.
inline constexpr size_t kCacheLine = 64;

/// A queue from one writing thread to one reading thread, in order, of fixed capacity (a power of
/// two). Wait-free on both sides, no allocation after construction. What does not fit is refused
/// and counted.
template <class T, size_t kCapacity>
class Ring {
  static_assert(kCapacity > 0 && (kCapacity & (kCapacity - 1)) == 0);
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Writer: false, and one more in dropped(), if it is full.
  bool push(const T& item) noexcept {
    const uint64_t end = end_.load(std::memory_order_relaxed);
    if (end - begin_.load(std::memory_order_acquire) == kCapacity) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    items_[end & (kCapacity - 1)] = item;
    end_.store(end + 1, std::memory_order_release);
    return true;
  }
  /// Writer: both, one after the other, or neither, as push().
  bool push(const T& first, const T& second) noexcept {
    const uint64_t end = end_.load(std::memory_order_relaxed);
    if (end - begin_.load(std::memory_order_acquire) + 2 > kCapacity) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 2, std::memory_order_relaxed);
      return false;
    }
    items_[end & (kCapacity - 1)] = first;
    items_[(end + 1) & (kCapacity - 1)] = second;
    end_.store(end + 2, std::memory_order_release);
    return true;
  }
  /// Reader: false if there is nothing.
  bool pop(T& item) noexcept {
    const uint64_t begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return false;
    item = items_[begin & (kCapacity - 1)];
    begin_.store(begin + 1, std::memory_order_release);
    return true;
  }
  /// Any thread.
  uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  alignas(kCacheLine) std::atomic<uint64_t> end_{0};
  std::atomic<uint64_t> dropped_{0};
  alignas(kCacheLine) std::atomic<uint64_t> begin_{0};
  alignas(kCacheLine) std::array<T, kCapacity> items_{};
};

/// The newest value from one writing thread to one reading thread; older ones are forgotten. Three
/// places: one being written, one being read, one in between that both swap with. Wait-free, no
/// allocation.
template <class T>
class Newest {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Writer.
  void put(const T& value) noexcept {
    places_[writing_] = value;
    writing_ = between_.exchange(writing_ | kNew, std::memory_order_acq_rel) & kPlace;
  }
  /// Reader: the newest value into `value`, true if it is another one than last time. Before the
  /// first put() `value` is left alone.
  bool get(T& value) noexcept {
    const bool is_new = (between_.load(std::memory_order_relaxed) & kNew) != 0;
    if (is_new) {
      reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kPlace;
      any_ = true;
    }
    if (any_) value = places_[reading_];
    return is_new;
  }

 private:
  static constexpr uint32_t kPlace = 3, kNew = 4;
  std::array<T, 3> places_{};
  alignas(kCacheLine) std::atomic<uint32_t> between_{1};
  alignas(kCacheLine) uint32_t writing_ = 0;
  alignas(kCacheLine) uint32_t reading_ = 2;
  bool any_ = false;
};

/// Hands objects to a real-time thread and takes them back for deletion: the real-time thread never
/// allocates and never frees. The owner offers; the loop takes the newest and retires what it no
/// longer uses, in any order and as late as it likes (two scenes may live while one fades into the
/// other). At most kMost objects are out at a time. Wait-free for the loop. The owner's functions
/// are one thread's, the loop's another's; both have ended when it is destroyed.
template <class T, size_t kMost = 8>
class Handover {
 public:
  Handover() { out_.reserve(kMost); }
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  /// Owner: true if the loop will see it (an offer that was not taken yet is replaced and deleted).
  /// False, and `fresh` is left with the caller, if kMost objects are out: try again later.
  bool offer(std::unique_ptr<T>& fresh) {
    collect();
    if (T* stale = pending_.exchange(nullptr, std::memory_order_acquire)) drop(stale);
    if (out_.size() == kMost) return false;
    out_.push_back(std::move(fresh));
    pending_.store(out_.back().get(), std::memory_order_release);
    return true;
  }
  /// Owner: deletes what the loop has retired. Call it now and then.
  void collect() {
    T* retired = nullptr;
    while (retired_.pop(retired)) drop(retired);
  }
  /// Owner: objects that are not deleted yet.
  size_t out() const { return out_.size(); }

  /// Loop: the newest object offered since the last call, or null. Real-time safe.
  T* take() noexcept { return pending_.exchange(nullptr, std::memory_order_acq_rel); }
  /// Loop: no longer uses what take() gave. Never fails: there is room for all that can be out.
  /// Real-time safe.
  void retire(T* used) noexcept {
    if (used) retired_.push(used);
  }

 private:
  static constexpr size_t power_of_two(size_t n) {
    size_t power = 1;
    while (power < n) power *= 2;
    return power;
  }
  void drop(T* object) {
    std::erase_if(out_, [&](const std::unique_ptr<T>& kept) { return kept.get() == object; });
  }

  std::vector<std::unique_ptr<T>> out_;  ///< all that exist, the owner's
  std::atomic<T*> pending_{nullptr};
  Ring<T*, power_of_two(kMost)> retired_;
};

}  // namespace palpate
