#pragma once

#include <memory>

#include "compute/motion/bricks.h"
#include "compute/vulkan/image.h"
#include "compute/vulkan/recorder.h"
#include "tests/motion/oracle/oracle.h"

namespace palpate::test {

/// The image formats that the engine uses.
enum class Format { kR8, kR16, kR32, kRgba16, kRgba32 };

/// A device image and its format, which download() needs.
struct DeviceImage {
  vulkan::Image image;
  Format format = Format::kRgba32;
};

/// The values as an image of this format stores them: rounded, missing channels 0. An oracle gets
/// these, so that its input is the same as the kernel's.
oracle::Texels as_stored(const oracle::Texels& texels, Format format);

/// An image with these values; missing channels are dropped.
DeviceImage upload(const std::shared_ptr<vulkan::Context>& context, const oracle::Texels& texels,
                   Format format);
/// An image filled with `value`, for outputs: places that a kernel does not write keep it.
DeviceImage filled(const std::shared_ptr<vulkan::Context>& context, glm::ivec3 size, Format format,
                   double value);
/// All values; missing channels are 0.
oracle::Texels download(const std::shared_ptr<vulkan::Context>& context, const DeviceImage& image);

oracle::Texels texels_of(const oracle::Scalars& scalars);
oracle::Texels texels_of(const oracle::Vectors& vectors);
oracle::Scalars scalars_of(const oracle::Texels& texels);
oracle::Vectors vectors_of(const oracle::Texels& texels);

/// Every second brick of a grid of cells (at least one brick), and whether a cell is in a list of
/// bricks.
BrickList every_second_brick(glm::ivec3 cells);
bool in_bricks(const BrickList& bricks, glm::ivec3 cell);

}  // namespace palpate::test
