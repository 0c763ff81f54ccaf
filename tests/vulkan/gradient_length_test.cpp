#include "docs/examples/gradient_length.h"

#include <algorithm>

#include "spirv/gradient_length.h"
#include "tests/support/device.h"
#include "tests/support/images.h"
#include "tests/support/random_fields.h"
#include "tests/support/tolerances.h"

/// The example step of the documentation, compared with the same equation in double precision.
namespace palpate::test {
namespace {

using vulkan::BindingKind;

class GradientLength : public DeviceTest {};

double expected(const oracle::Scalars& values, glm::dvec3 spacing_mm, glm::ivec3 i) {
  glm::dvec3 slope(0.0);
  for (int c = 0; c < 3; ++c) {
    glm::ivec3 step(0);
    step[c] = 1;
    const auto at = [&](glm::ivec3 j) {
      return values.at(glm::clamp(j, glm::ivec3(0), values.size - 1));
    };
    slope[c] = (at(i + step) - at(i - step)) / (2.0 * spacing_mm[c]);
  }
  return glm::length(slope);
}

TEST_F(GradientLength, IsThatOfTheOracle) {
  // More than one work group along x.
  const glm::ivec3 size{70, 5, 4};
  const glm::dvec3 spacing_mm{0.7, 1.3, 2.5};
  const DeviceImage values =
      upload(context(), texels_of(random_scalars(size, 3, 0.0, 1.0)), Format::kR32);
  const DeviceImage lengths = filled(context(), size, Format::kR32, -1.0);
  const oracle::Scalars stored = scalars_of(download(context(), values));

  vulkan::KernelOptions options;
  options.spirv = k_gradient_length;
  options.push_bytes = sizeof(GradientLengthPush);
  const vulkan::Kernel kernel(context(), options);
  const vulkan::Sampler nearest(context(), VK_FILTER_NEAREST);
  vulkan::Recorder recorder(context());
  recorder.dispatch(kernel, {{values.image, nearest}, lengths.image},
                    GradientLengthPush{glm::ivec4(size, 0), glm::vec4(spacing_mm, 0.0)},
                    {(size.x + 63) / 64, size.y, size.z});
  recorder.run();

  const oracle::Scalars found = scalars_of(download(context(), lengths));
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i)
        ASSERT_NEAR(found.at({i, j, k}), expected(stored, spacing_mm, {i, j, k}), kSingle)
            << i << ' ' << j << ' ' << k;
}

TEST(KernelBindings, AreThoseOfTheShader) {
  EXPECT_EQ(vulkan::bindings_of(k_gradient_length),
            (std::vector{BindingKind::kSampledImage, BindingKind::kStorageImage}));
}

TEST(KernelBindings, OfDamagedCodeAreRefused) {
  std::vector<uint32_t> code(std::begin(k_gradient_length), std::end(k_gradient_length));
  // An instruction without a length.
  code[5] = 0;
  EXPECT_THROW(vulkan::bindings_of(code), vulkan::Failure);
  // One that is longer than the code.
  code[5] = 0xffff0000U;
  EXPECT_THROW(vulkan::bindings_of(code), vulkan::Failure);
}

TEST(KernelBindings, HaveNoGap) {
  std::vector<uint32_t> code(std::begin(k_gradient_length), std::end(k_gradient_length));
  // OpDecorate, 4 words: variable, Binding (33), number.
  const std::vector<uint32_t> binding_one = {33, 1};
  const auto at = std::search(code.begin(), code.end(), binding_one.begin(), binding_one.end());
  ASSERT_NE(at, code.end());
  at[1] = 2;
  EXPECT_THROW(vulkan::bindings_of(code), vulkan::Failure);
}

}  // namespace
}  // namespace palpate::test
