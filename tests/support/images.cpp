#include "tests/support/images.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/packing.hpp>

namespace palpate::test {
namespace {

int channels_of(Format format) {
  return format == Format::kRgba16 || format == Format::kRgba32 ? 4 : 1;
}

size_t bytes_of_channel(Format format) {
  switch (format) {
    case Format::kR8:
      return 1;
    case Format::kR16:
    case Format::kRgba16:
      return 2;
    default:
      return 4;
  }
}

VkFormat vulkan_format(Format format) {
  switch (format) {
    case Format::kR8:
      return VK_FORMAT_R8_UNORM;
    case Format::kR16:
      return VK_FORMAT_R16_SFLOAT;
    case Format::kR32:
      return VK_FORMAT_R32_SFLOAT;
    case Format::kRgba16:
      return VK_FORMAT_R16G16B16A16_SFLOAT;
    default:
      return VK_FORMAT_R32G32B32A32_SFLOAT;
  }
}

void write_channel(uint8_t* to, double value, Format format) {
  const uint8_t byte = uint8_t(std::lround(std::clamp(value, 0.0, 1.0) * 255.0));
  const uint16_t half = glm::packHalf1x16(float(value));
  const float whole = float(value);
  const void* from = format == Format::kR8           ? static_cast<const void*>(&byte)
                     : bytes_of_channel(format) == 2 ? static_cast<const void*>(&half)
                                                     : static_cast<const void*>(&whole);
  std::memcpy(to, from, bytes_of_channel(format));
}

double read_channel(const uint8_t* from, Format format) {
  if (format == Format::kR8) return double(*from) / 255.0;
  if (bytes_of_channel(format) == 2) {
    uint16_t half = 0;
    std::memcpy(&half, from, sizeof(half));
    return double(glm::unpackHalf1x16(half));
  }
  float whole = 0.0F;
  std::memcpy(&whole, from, sizeof(whole));
  return double(whole);
}

std::vector<uint8_t> packed_bytes(const oracle::Texels& texels, Format format) {
  const int channels = channels_of(format);
  const size_t each = bytes_of_channel(format);
  std::vector<uint8_t> bytes(texels.values.size() * size_t(channels) * each);
  uint8_t* to = bytes.data();
  for (const glm::dvec4& texel : texels.values) {
    for (int c = 0; c < channels; ++c, to += each) write_channel(to, texel[c], format);
  }
  return bytes;
}

oracle::Texels unpacked(const uint8_t* from, glm::ivec3 size, Format format) {
  oracle::Texels texels(size);
  for (glm::dvec4& texel : texels.values) {
    for (int c = 0; c < channels_of(format); ++c, from += bytes_of_channel(format))
      texel[c] = read_channel(from, format);
  }
  return texels;
}

}  // namespace

oracle::Texels as_stored(const oracle::Texels& texels, Format format) {
  return unpacked(packed_bytes(texels, format).data(), texels.size, format);
}

DeviceImage upload(const std::shared_ptr<vulkan::Context>& context, const oracle::Texels& texels,
                   Format format) {
  DeviceImage result{vulkan::Image(context, texels.size, vulkan_format(format)), format};
  const std::vector<uint8_t> bytes = packed_bytes(texels, format);
  vulkan::Buffer staging(context, bytes.size(), vulkan::Buffer::Kind::kHostVisible);
  std::copy(bytes.begin(), bytes.end(), staging.as<uint8_t>().begin());
  vulkan::Recorder recorder(context);
  recorder.prepare(result.image);
  recorder.copy(staging, result.image);
  recorder.run();
  return result;
}

DeviceImage filled(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 size, Format format,
                   double value) {
  return upload(context, oracle::Texels(size, glm::dvec4(value)), format);
}

oracle::Texels download(const std::shared_ptr<vulkan::Context>& context, const DeviceImage& image) {
  const glm::ivec3 size = image.image.size();
  const size_t texels = size_t(size.x) * size_t(size.y) * size_t(size.z);
  vulkan::Buffer staging(
      context, texels * size_t(channels_of(image.format)) * bytes_of_channel(image.format),
      vulkan::Buffer::Kind::kHostVisible);
  vulkan::Recorder recorder(context);
  recorder.copy(image.image, staging);
  recorder.run();
  return unpacked(staging.as<uint8_t>().data(), size, image.format);
}

oracle::Texels texels_of(const oracle::Scalars& scalars) {
  oracle::Texels texels(scalars.size);
  for (size_t i = 0; i < scalars.values.size(); ++i) texels.values[i].x = scalars.values[i];
  return texels;
}

oracle::Texels texels_of(const oracle::Vectors& vectors) {
  oracle::Texels texels(vectors.size);
  for (size_t i = 0; i < vectors.values.size(); ++i)
    texels.values[i] = glm::dvec4(vectors.values[i], 0.0);
  return texels;
}

oracle::Scalars scalars_of(const oracle::Texels& texels) {
  oracle::Scalars scalars(texels.size);
  for (size_t i = 0; i < texels.values.size(); ++i) scalars.values[i] = texels.values[i].x;
  return scalars;
}

oracle::Vectors vectors_of(const oracle::Texels& texels) {
  oracle::Vectors vectors(texels.size);
  for (size_t i = 0; i < texels.values.size(); ++i)
    vectors.values[i] = glm::dvec3(texels.values[i]);
  return vectors;
}

BrickList every_second_brick(glm::ivec3 cells) {
  BrickList chosen;
  const BrickList all = all_bricks(cells);
  for (size_t i = 0; i < all.size(); i += 2) chosen.push_back(all[i]);
  return chosen;
}

bool in_bricks(const BrickList& bricks, glm::ivec3 cell) {
  const glm::ivec3 brick = cell / shaders::kBrick;
  const uint32_t packed = uint32_t(brick.x) | uint32_t(brick.y) << 10 | uint32_t(brick.z) << 20;
  return std::find(bricks.begin(), bricks.end(), packed) != bricks.end();
}

}  // namespace palpate::test
