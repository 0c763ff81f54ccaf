#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// The k-th smallest value, k from 0: what std::nth_element puts there, in a fraction of its time.
/// Counts values by the leading half of their bits, made to order as the numbers do, and sorts out
/// only where the k-th falls. NaNs count as beyond infinity. k < values.size(). Any thread.
inline float kth_smallest(std::span<const float> values, size_t k) {
  assert(k < values.size());
  const auto key = [](float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    return bits & 0x80000000U ? ~bits : bits | 0x80000000U;
  };
  std::vector<uint32_t> counts(1 << 16);
  for (const float value : values) ++counts[key(value) >> 16];
  uint32_t bin = 0;
  while (k >= counts[bin]) k -= counts[bin++];
  std::vector<float> inside;
  inside.reserve(counts[bin]);
  for (const float value : values)
    if (key(value) >> 16 == bin) inside.push_back(value);
  const auto at = inside.begin() + std::ptrdiff_t(k);
  std::nth_element(inside.begin(), at, inside.end(),
                   [&](float a, float b) { return key(a) < key(b); });
  return *at;
}

}  // namespace palpate
