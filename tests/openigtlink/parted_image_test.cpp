// Parts of an image in any order, compared with an image that is filled sample by sample.
#include "integration/openigtlink/parted_image.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

namespace palpate::openigtlink {
namespace {

using Came = PartedImage::Came;

ImageMessage part_of(glm::ivec3 whole, glm::ivec3 first, glm::ivec3 size, float value) {
  ImageMessage part;
  part.grid.size = whole;
  part.first = first;
  part.size = size;
  part.values.resize(size_t(size.x) * size_t(size.y) * size_t(size.z));
  for (float& sample : part.values) sample = value++;
  return part;
}

/// Lines of 150 samples span three or four runs of 64; the last run of the image is not full.
TEST(PartedImages, AreWholeAsSoonAsEverySampleCameAndHaveTheNewest) {
  constexpr glm::ivec3 kWhole(150, 7, 5);
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&](int n) { return int(random() % uint32_t(n)); };
    std::vector<float> expected(size_t(kWhole.x * kWhole.y * kWhole.z));
    std::vector<bool> came(expected.size());
    size_t missing = expected.size();
    std::optional<PartedImage> image;
    bool said = false;
    for (int n = 0; missing > 0; ++n) {
      glm::ivec3 first, size;
      for (int a = 0; a < 3; ++a) {
        first[a] = below(kWhole[a]);
        size[a] = 1 + below(kWhole[a] - first[a]);
      }
      const ImageMessage part = part_of(kWhole, first, size, float(10'000 * n));
      bool again = false;
      const float* value = part.values.data();
      for (int k = first.z; k < first.z + size.z; ++k)
        for (int j = first.y; j < first.y + size.y; ++j)
          for (int i = first.x; i < first.x + size.x; ++i) {
            const size_t at = size_t(i + kWhole.x * (j + kWhole.y * k));
            expected[at] = *value++;
            if (came[at])
              again = true;
            else
              --missing;
            came[at] = true;
          }
      if (!image) image.emplace(part);
      ASSERT_TRUE(image->takes(part));
      const Came wanted = missing == 0 ? Came::kWhole : again && !said ? Came::kAgain : Came::kPart;
      said |= again;
      ASSERT_EQ(image->put(part), wanted) << "part " << n;
      ASSERT_EQ(image->was_whole(), missing == 0);
    }
    EXPECT_EQ(image->image().values, expected);
  }
}

TEST(PartedImages, TheNextOneBeginsWithASampleThatComesOnceMore) {
  constexpr glm::ivec3 kWhole(70, 2, 2), kSlice(70, 2, 1);
  const ImageMessage low = part_of(kWhole, {0, 0, 0}, kSlice, 0.0f),
                     high = part_of(kWhole, {0, 0, 1}, kSlice, 1000.0f),
                     newer = part_of(kWhole, {0, 0, 0}, kSlice, 2000.0f);
  PartedImage image(low);
  EXPECT_EQ(image.put(low), Came::kPart);
  EXPECT_EQ(image.put(low), Came::kAgain);
  EXPECT_EQ(image.put(high), Came::kWhole);
  EXPECT_FALSE(image.begins_next(newer));
  EXPECT_EQ(image.put(newer), Came::kPart);
  EXPECT_TRUE(image.begins_next(newer));
  EXPECT_FALSE(image.begins_next(high));
  EXPECT_EQ(image.image().values[3], 2003.0f);
  EXPECT_EQ(image.put(high), Came::kWhole);
}

}  // namespace
}  // namespace palpate::openigtlink
