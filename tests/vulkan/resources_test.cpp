#include <algorithm>
#include <numeric>

#include "tests/support/device.h"
#include "tests/support/images.h"
#include "tests/support/random_fields.h"
#include "tests/support/tolerances.h"

namespace palpate::test {
namespace {

using vulkan::Buffer;
using vulkan::Recorder;

class VulkanBuffer : public DeviceTest {
 protected:
  Buffer host(size_t words) { return {context(), 4 * words, Buffer::Kind::kHostVisible}; }
};

class VulkanImage : public DeviceTest {};

TEST_F(VulkanBuffer, GoesToTheDeviceAndBackUnchanged) {
  for (const size_t words : {size_t(1), size_t(7), size_t(100000)}) {
    Buffer sent = host(words), back = host(words);
    const Buffer there(context(), 4 * words);
    std::iota(sent.as<uint32_t>().begin(), sent.as<uint32_t>().end(), 17U);
    Recorder recorder(context());
    recorder.copy(sent, there, 4 * words);
    recorder.copy(there, back, 4 * words);
    recorder.run();
    EXPECT_TRUE(std::ranges::equal(sent.as<uint32_t>(), back.as<uint32_t>())) << words;
  }
}

TEST_F(VulkanBuffer, IsFilledWithAWord) {
  Buffer buffer = host(1000);
  Recorder recorder(context());
  recorder.fill(buffer, 0x12345678U);
  recorder.run();
  EXPECT_TRUE(
      std::ranges::all_of(buffer.as<uint32_t>(), [](uint32_t w) { return w == 0x12345678U; }));
}

TEST_F(VulkanBuffer, IsOwnedByOneAfterAMove) {
  const uint64_t before = context()->memory_used_bytes();
  {
    Buffer first = host(10);
    first.as<uint32_t>()[3] = 42;
    Buffer second = std::move(first);
    EXPECT_EQ(second.as<uint32_t>()[3], 42U);
    EXPECT_EQ(second.bytes(), 40U);
    Buffer third = host(20);
    third = std::move(second);
    EXPECT_EQ(third.as<uint32_t>()[3], 42U);
  }
  EXPECT_EQ(context()->memory_used_bytes(), before);
  EXPECT_FALSE(Buffer());
}

TEST_F(VulkanImage, HoldsAnyFormatAtAnySizeWithinItsRounding) {
  for (const glm::ivec3 size : {glm::ivec3(1), glm::ivec3(1, 7, 3), glm::ivec3(17, 9, 5)}) {
    for (const Format format :
         {Format::kR8, Format::kR16, Format::kR32, Format::kRgba16, Format::kRgba32}) {
      oracle::Texels texels = random_texels(size, 5);
      if (format == Format::kR8) {
        for (glm::dvec4& texel : texels.values) texel = glm::abs(texel);
      }
      const oracle::Texels back = download(context(), upload(context(), texels, format));
      EXPECT_EQ(back.values, as_stored(texels, format).values);
      // The rounding itself: the values that tests compare with must be near the original ones.
      const double rounding = format == Format::kR8 ? 0.5 / 255.0 : kHalf;
      for (size_t i = 0; i < texels.values.size(); ++i)
        EXPECT_NEAR(back.values[i].x, texels.values[i].x, rounding);
    }
  }
}

TEST_F(VulkanImage, IsClearedToZero) {
  const DeviceImage image = upload(context(), random_texels({9, 5, 3}, 6), Format::kRgba16);
  Recorder recorder(context());
  recorder.clear(image.image);
  recorder.run();
  EXPECT_EQ(download(context(), image).values, oracle::Texels(glm::ivec3(9, 5, 3)).values);
}

TEST_F(VulkanImage, IsOwnedByOneAfterAMove) {
  const uint64_t before = context()->memory_used_bytes();
  {
    vulkan::Image first(context(), {4, 4, 4}, VK_FORMAT_R32_SFLOAT);
    const VkImage handle = first.handle();
    vulkan::Image second;
    EXPECT_FALSE(second);
    second = std::move(first);
    EXPECT_EQ(second.handle(), handle);
    EXPECT_EQ(second.size(), glm::ivec3(4));
  }
  EXPECT_EQ(context()->memory_used_bytes(), before);
}

}  // namespace
}  // namespace palpate::test
