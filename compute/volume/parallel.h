#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <thread>
#include <vector>

namespace palpate {

/// Calls work(begin, end) on disjoint ranges that cover [0, count), on as many threads as the
/// machine has or fewer, and returns when all are done. `cost` is the work of one item in
/// elementary steps (an addition or so): small jobs run on the calling thread, and no job on so
/// many threads that starting them takes longer than their work. work must not throw. Any thread.
template <class Work>
void parallel_ranges(int count, double cost, const Work& work) {
  // Starting a thread takes about as long as this many steps. w steps on n threads then take
  // w / n + n of these; the sum is smallest at n = sqrt(w / kStart).
  constexpr double kStart = 1e5;
  const int cores = std::max(1, int(std::thread::hardware_concurrency()));
  const int wanted = int(std::min(double(cores), std::sqrt(double(count) * cost / kStart)));
  const int threads = std::clamp(wanted, 1, std::max(1, count));
  const auto start = [&](int part) { return int(static_cast<long long>(count) * part / threads); };
  std::vector<std::thread> others;
  others.reserve(size_t(threads - 1));
  for (int part = 1; part < threads; ++part) {
    others.emplace_back([&work, begin = start(part), end = start(part + 1)] { work(begin, end); });
  }
  work(0, start(1));
  for (std::thread& other : others) other.join();
}

}  // namespace palpate
