#pragma once

#include <array>
#include <sstream>
#include <string>

#include "compute/motion/bricks.h"
#include "shaders/interface/motion.h"
#include "tests/support/device.h"
#include "tests/support/images.h"
#include "tests/support/random_fields.h"
#include "tests/support/tolerances.h"

namespace palpate::test {

/// Sizes at which kernels may fail: one sample, one less and one more than a brick, odd numbers,
/// and a different size on each axis.
inline constexpr std::array<glm::ivec3, 5> kSizes = {glm::ivec3(1, 7, 9), glm::ivec3(17, 9, 7),
                                                     glm::ivec3(9, 17, 1), glm::ivec3(8, 16, 8),
                                                     glm::ivec3(7, 1, 17)};

inline std::string text(glm::dvec3 v) {
  std::ostringstream out;
  out << "(" << v.x << " " << v.y << " " << v.z << ")";
  return out.str();
}

/// Random vectors as an image of the device stores them, that is rounded.
inline oracle::Vectors stored_vectors(glm::ivec3 cells, uint32_t seed, double reach) {
  return vectors_of(as_stored(texels_of(random_vectors(cells, seed, reach)), Format::kRgba32));
}

/// Runs one kernel on the device, to compare it with its oracle. The kernel is right if its result
/// equals the oracle's for the same, already rounded, input.
class KernelTest : public DeviceTest {
 protected:
  DeviceImage put(const oracle::Texels& texels, Format format) {
    return upload(context(), texels, format);
  }
  DeviceImage output(glm::ivec3 size, Format format) {
    return filled(context(), size, format, kUntouched);
  }
  oracle::Texels get(const DeviceImage& image) { return download(context(), image); }
  vulkan::Binding nearest(const DeviceImage& image) {
    return {image.image, device().kernels->nearest()};
  }
  vulkan::Binding linear(const DeviceImage& image) {
    return {image.image, device().kernels->linear()};
  }

  template <class Push>
  void dispatch(const vulkan::Kernel& kernel, const std::vector<vulkan::Binding>& bindings,
                const Push& push, glm::ivec3 groups) {
    vulkan::Recorder recorder(context());
    recorder.dispatch(kernel, bindings, push, groups);
    recorder.run();
  }

  /// Groups of a kernel that takes 64 samples in a row.
  static glm::ivec3 rows(glm::ivec3 size) { return {(size.x + 63) / 64, size.y, size.z}; }

  /// Tolerance of a value read through the linear sampler, as a fraction of the range.
  double sampling_tolerance() const { return context()->is_cpu() ? kSingle : kTextureUnit; }

  /// Compares channels [0, channels) of all cells in `bricks` with the expected ones, and requires
  /// that all other cells are unchanged. scale: the largest number that takes part.
  void expect_cells(const DeviceImage& image, const oracle::Texels& expected,
                    const BrickList& bricks, int channels, double scale, double tolerance) {
    const oracle::Texels actual = get(image);
    const bool half = image.format == Format::kR16 || image.format == Format::kRgba16;
    ASSERT_EQ(actual.size, expected.size);
    size_t wrong = 0;
    std::string first;
    oracle::for_each(actual.size, [&](glm::ivec3 i) {
      const bool listed = in_bricks(bricks, i);
      for (int c = 0; c < channels; ++c) {
        const double is = actual.at(i)[c];
        const double wanted = listed ? expected.at(i)[c] : kUntouched;
        const double rounding = half ? kHalf * std::abs(wanted) + kHalfSmallest : 0.0;
        const double allowed = listed ? tolerance * scale + rounding : 0.0;
        // Equality first: voxels without a value are infinite, and their difference is NaN.
        if (is == wanted || std::abs(is - wanted) <= allowed) continue;
        if (wrong++ == 0) {
          std::ostringstream out;
          out << "cell " << text(i) << " channel " << c << " is " << is << ", not " << wanted
              << " +- " << allowed << (listed ? "" : " (not in the list of bricks)");
          first = out.str();
        }
      }
    });
    EXPECT_EQ(wrong, 0U) << first << "; cells are " << text(actual.size);
  }
  void expect_all(const DeviceImage& image, const oracle::Texels& expected, int channels,
                  double scale, double tolerance = kSingle) {
    expect_cells(image, expected, all_bricks(expected.size), channels, scale, tolerance);
  }

  /// Outputs are filled with this before a kernel runs; exact in every format but R8.
  static constexpr double kUntouched = -77.0;
};

}  // namespace palpate::test
