// Files without a header, as in H3D's scenes: only the scene describes them.
#include "integration/files/raster/raw_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "integration/files/read_volume.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

/// The bytes of numbers as this machine, which is little endian, stores them.
template <class T>
std::string bytes_of_all(const std::vector<T>& numbers) {
  std::string bytes(numbers.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

RawSamples samples_of(SampleType type, int components = 1) {
  return {{4, 3, 2}, type, components, {0.001, 0.002, 0.003}};
}

template <class T>
void expect_read(SampleType type) {
  const TemporaryFolder folder;
  std::vector<T> numbers;
  for (size_t k = 0; k < 24; ++k) numbers.push_back(T(int(known_value(k, 0))));
  // For unsigned types: close to the highest value.
  numbers[5] = T(-3);
  write_bytes(folder / "a.raw", bytes_of_all(numbers));
  const auto volume = read_raw_volume(folder / "a.raw", samples_of(type));
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_EQ(volume->values.size(), 24U);
  for (size_t k = 0; k < 24; ++k) EXPECT_EQ(volume->values[k], float(numbers[k])) << k;
}

TEST(RawHeader, EveryTypeOfNumberIsRead) {
  expect_read<uint8_t>(SampleType::kUint8);
  expect_read<int8_t>(SampleType::kInt8);
  expect_read<uint16_t>(SampleType::kUint16);
  expect_read<int16_t>(SampleType::kInt16);
  expect_read<uint32_t>(SampleType::kUint32);
  expect_read<int32_t>(SampleType::kInt32);
  expect_read<uint64_t>(SampleType::kUint64);
  expect_read<int64_t>(SampleType::kInt64);
  expect_read<float>(SampleType::kFloat);
  expect_read<double>(SampleType::kDouble);
}

/// A scene has x to the patient's left, y to the head, z to the front.
TEST(RawHeader, AxesAreThoseOfAScene) {
  const auto raster = raw_header("a.raw", samples_of(SampleType::kUint8));
  ASSERT_TRUE(raster) << raster.error().message;
  const Grid& grid = raster->grid;
  EXPECT_FALSE(grid.j_reversed_in_file);
  const glm::dvec3 from = grid.lps_from_index({0, 0, 0});
  EXPECT_LT(glm::distance(grid.lps_from_index({1, 0, 0}) - from, {1.0, 0.0, 0.0}), 1e-12);
  EXPECT_LT(glm::distance(grid.lps_from_index({0, 1, 0}) - from, {0.0, 0.0, 2.0}), 1e-12);
  EXPECT_LT(glm::distance(grid.lps_from_index({0, 0, 1}) - from, {0.0, -3.0, 0.0}), 1e-12);
}

TEST(RawHeader, VectorsTurnWithTheAxes) {
  const TemporaryFolder folder;
  std::vector<float> numbers;
  for (int k = 0; k < 24; ++k) numbers.insert(numbers.end(), {float(k), 0.5F, -2.0F});
  write_bytes(folder / "a.raw", bytes_of_all(numbers));
  const auto vectors = read_raw_vectors(folder / "a.raw", samples_of(SampleType::kFloat, 3));
  ASSERT_TRUE(vectors) << vectors.error().message;
  // LPS of x, y, z: x, -z, y.
  for (size_t k = 0; k < 24; ++k)
    EXPECT_EQ(vectors->values[k], glm::vec3(float(k), 2.0F, 0.5F)) << k;
}

TEST(RawHeader, AFileThatDoesNotFitIsRefusedInASentence) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& bytes, const RawSamples& samples) {
    write_bytes(folder / "a.raw", bytes);
    const auto scalars = read_raw_volume(folder / "a.raw", samples);
    const auto vectors = read_raw_vectors(folder / "a.raw", samples);
    const bool of_vectors = samples.components == 3;
    EXPECT_FALSE(of_vectors ? bool(vectors) : bool(scalars));
    return (of_vectors ? vectors.error() : scalars.error()).message;
  };
  const RawSamples bytes = samples_of(SampleType::kUint8);
  for (const size_t size : {size_t(0), size_t(23), size_t(25), size_t(48)})
    EXPECT_THAT(refusal(std::string(size, 'a'), bytes),
                AllOf(HasSubstr(std::to_string(size) + " bytes, but 4 x 3 x 2 samples of 1 bytes "
                                                       "are 24"),
                      EndsWith("correct what the scene says of it")));
  std::vector<float> numbers(24, 1.0F);
  numbers[7] = std::nanf("");
  EXPECT_THAT(refusal(bytes_of_all(numbers), samples_of(SampleType::kFloat)),
              HasSubstr("not finite"));
  EXPECT_THAT(refusal(std::string(72, 'a'), samples_of(SampleType::kUint8, 3)),
              HasSubstr("colour picture"));
  RawSamples huge = bytes;
  huge.size = {65536, 65536, 65536};
  EXPECT_THAT(refusal(std::string(24, 'a'), huge), HasSubstr("a.raw"));
  EXPECT_THAT(read_raw_volume(folder / "none.raw", bytes).error().message,
              HasSubstr("can not be read"));
}

}  // namespace
}  // namespace palpate::files
