#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// The values at these ranks, from 0, in rising order: the same as std::nth_element for each, in a
/// fraction of its time. Maps values to integers of the same order, counts them once by their
/// leading 16 bits, and sorts only the groups that contain a rank. NaNs are larger than infinity.
/// Every rank < values.size(). Any thread.
template <size_t N>
std::array<float, N> at_ranks(std::span<const float> values, const std::array<size_t, N>& ranks) {
  const auto key = [](float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    return bits & 0x80000000U ? ~bits : bits | 0x80000000U;
  };
  // Two counters for each group, in turn: neighbouring values are often in one group, and each
  // addition to a counter waits for the one before.
  constexpr size_t kGroups = 1 << 16;
  std::vector<uint32_t> counts(2 * kGroups);
  for (size_t i = 0; i < values.size(); ++i) ++counts[i % 2 * kGroups + (key(values[i]) >> 16)];
  for (size_t g = 0; g < kGroups; ++g) counts[g] += counts[kGroups + g];
  std::array<float, N> result;
  for (size_t n = 0; n < N; ++n) {
    size_t rank = ranks[n];
    assert(rank < values.size());
    uint32_t group = 0;
    while (rank >= counts[group]) rank -= counts[group++];
    std::vector<uint32_t> inside;
    inside.reserve(counts[group]);
    for (const float value : values)
      if (key(value) >> 16 == group) inside.push_back(key(value));
    const auto at = inside.begin() + std::ptrdiff_t(rank);
    std::nth_element(inside.begin(), at, inside.end());
    result[n] = std::bit_cast<float>(*at & 0x80000000U ? *at & 0x7fffffffU : ~*at);
  }
  return result;
}

}  // namespace palpate
