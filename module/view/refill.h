#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "compute/vulkan/buffer.h"

namespace palpate::view {

/// Writes values that change with the picture into a buffer. It is made anew only where they do not
/// fit, with room for half as many more: then one or two more tubes need no new buffer.
template <class Value>
void refill(const std::shared_ptr<vulkan::Context>& context, const std::vector<Value>& values,
            vulkan::Buffer& buffer) {
  const uint64_t bytes = values.size() * sizeof(Value);
  if (bytes == 0) return;
  if (buffer.bytes() < bytes)
    buffer = vulkan::Buffer(context, bytes * 3 / 2 + 4096, vulkan::Buffer::Kind::kFilledByHost);
  std::copy(values.begin(), values.end(), buffer.as<Value>().begin());
}

}  // namespace palpate::view
