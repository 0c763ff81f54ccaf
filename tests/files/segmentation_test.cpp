// Hand-written segmentations: as 3D Slicer writes them, and label maps.
#include "integration/files/segmentation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compute/volume/signed_distance.h"
#include "tests/files/expect_grid.h"
#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kSlicer =
    "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n"
    "space directions: (0.5,0,0) (0,0.75,0) (0,0,2.5)\nkinds: domain domain domain\n"
    "encoding: raw\nspace origin: (-10,20,30)\n"
    "Segment0_Color:=0.9 0.25 0.5\nSegment0_ID:=Segment_1\nSegment0_LabelValue:=3\n"
    "Segment0_Layer:=0\nSegment0_Name:=left ventricle\n"
    "Segment1_Color:=0 1 0\nSegment1_ID:=Segment_2\nSegment1_LabelValue:=7\nSegment1_Layer:=0\n"
    "Segment1_Name:=myocardium\n"
    "Segment2_ID:=Segment_3\nSegment2_LabelValue:=9\nSegment2_Layer:=0\nSegment2_Name:=not drawn\n"
    "Segmentation_ReferenceImageExtentOffset:=35 86 -1\n\n";

class SegmentationReader : public ::testing::Test {
 protected:
  std::vector<Segmentation> read(const std::string& header, const std::vector<uint8_t>& samples,
                                 const char* name = "a.seg.nrrd") {
    write_bytes(folder_ / name, header + std::string(samples.begin(), samples.end()));
    auto segmentations = read_segmentation(folder_ / name);
    error_ = segmentations ? "" : segmentations.error().message;
    return segmentations ? std::move(*segmentations) : std::vector<Segmentation>();
  }
  TemporaryFolder folder_;
  std::string error_;
};

TEST_F(SegmentationReader, GivesNamesColoursAndPlaceOfASlicerFile) {
  const auto found = read(kSlicer, {0, 3, 3, 0, 7, 7, 0, 0, 3, 0, 0, 7});
  ASSERT_EQ(found.size(), 1U) << error_;
  const Segmentation& one = found.front();
  // A segment that is named but has no voxel is no part.
  ASSERT_EQ(one.parts.size(), 2U);
  EXPECT_EQ(one.parts[0].name, "left ventricle");
  EXPECT_EQ(one.parts[0].colour, glm::vec3(0.9F, 0.25F, 0.5F));
  EXPECT_EQ(one.parts[1].name, "myocardium");
  EXPECT_EQ(one.parts[1].label, 7);
  // The extent offset gives the place of the file's grid in the image's; so does the origin.
  EXPECT_EQ(one.grid.origin_mm, glm::dvec3(-10.0, 20.0, 30.0));
  EXPECT_EQ(one.grid.spacing_mm, glm::dvec3(0.5, 0.75, 2.5));
  const auto mask = one.mask({"left ventricle"});
  ASSERT_TRUE(mask);
  EXPECT_THAT(mask->values, ElementsAre(0, 1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0));
  const auto both = one.mask({"3", "myocardium"});
  ASSERT_TRUE(both);
  EXPECT_THAT(both->values, ElementsAre(0, 1, 1, 0, 1, 1, 0, 0, 1, 0, 0, 1));
  EXPECT_TRUE(is_slicer_segmentation(folder_ / "a.seg.nrrd"));
}

TEST_F(SegmentationReader, SaysWhichSegmentsThereAreWhenANameIsNone) {
  const auto found = read(kSlicer, {0, 3, 3, 0, 7, 7, 0, 0, 3, 0, 0, 7});
  ASSERT_EQ(found.size(), 1U) << error_;
  const auto mask = found.front().mask({"right ventricle"});
  ASSERT_FALSE(mask);
  EXPECT_EQ(mask.error().message, "'" + (folder_ / "a.seg.nrrd").string() +
                                      "' has no segment \"right ventricle\": it has \"left "
                                      "ventricle\", \"myocardium\"");
}

TEST_F(SegmentationReader, ReadsLayersOfPartsThatOverlap) {
  // Two layers, along the fastest axis.
  std::string header = kSlicer;
  header.replace(header.find("dimension: 3"), 12, "dimension: 4");
  header.replace(header.find("sizes: 3 2 2"), 12, "sizes: 2 3 2 2");
  header.replace(header.find("directions: "), 12, "directions: none ");
  header.replace(header.find("kinds: "), 7, "kinds: list ");
  header.replace(header.find("Segment1_Layer:=0"), 17, "Segment1_Layer:=1");
  std::vector<uint8_t> samples(24, 0);
  samples[0] = 3;  // voxel 0 of layer 0
  samples[1] = 7;  // and of layer 1
  samples[2 * 5 + 1] = 7;
  const auto found = read(header, samples);
  ASSERT_EQ(found.size(), 1U) << error_;
  EXPECT_EQ(found.front().layers.size(), 2U);
  EXPECT_THAT(found.front().mask({"left ventricle"})->values,
              ElementsAre(1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(found.front().mask({"myocardium"})->values,
              ElementsAre(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0));
}

const std::string kLabels =
    "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n"
    "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nencoding: raw\n\n";

TEST_F(SegmentationReader, NamesTheValuesOfALabelMap) {
  const auto found = read(kLabels, {0, 2, 2, 0, 1, 1, 0, 0, 40, 0, 0, 1}, "labels.nrrd");
  ASSERT_EQ(found.size(), 1U) << error_;
  const auto& parts = found.front().parts;
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].name, "label 1");
  EXPECT_EQ(parts[2].name, "label 40");
  EXPECT_GT(glm::distance(parts[0].colour, parts[1].colour), 0.2F);
  EXPECT_GT(glm::distance(parts[1].colour, parts[2].colour), 0.2F);
  EXPECT_FALSE(is_slicer_segmentation(folder_ / "labels.nrrd"));
}

TEST_F(SegmentationReader, GivesOneOfEachFrameOfA4DLabelMap) {
  const std::string header =
      "NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\n"
      "sizes: 3 2 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"
      "kinds: domain domain domain list\nencoding: raw\n\n";
  std::vector<uint8_t> samples(24, 0);
  samples[1] = samples[14] = 1;
  const auto found = read(header, samples, "labels.nrrd");
  ASSERT_EQ(found.size(), 2U) << error_;
  EXPECT_EQ(found[0].mask({"1"})->values[1], 1);
  EXPECT_EQ(found[1].mask({"1"})->values[1], 0);
  EXPECT_EQ(found[1].mask({"label 1"})->values[2], 1);
}

TEST_F(SegmentationReader, RefusesWhatIsNoSegmentation) {
  EXPECT_TRUE(read(kLabels, std::vector<uint8_t>(12, 0), "nothing.nrrd").empty());
  EXPECT_THAT(error_, HasSubstr("holds no label: every sample is 0"));
  EXPECT_TRUE(read(kSlicer, std::vector<uint8_t>(12, 0)).empty());
  EXPECT_THAT(error_, HasSubstr("holds no label"));
  std::string text = kLabels;
  text.replace(text.find("unsigned char"), 13, "float");
  text.replace(text.find("raw"), 3, "text");
  text += "0 1 2 3 4 5.5 0 0 0 0 0 0\n";
  EXPECT_TRUE(read(text, {}, "values.nrrd").empty());
  EXPECT_THAT(error_, HasSubstr("holds 5.5, which is no label"));
  EXPECT_FALSE(read_segmentation(folder_.path()));
  std::string wrong = kSlicer;
  wrong.replace(wrong.find("Segment0_Layer:=0"), 17, "Segment0_Layer:=4");
  EXPECT_TRUE(read(wrong, std::vector<uint8_t>(12, 3)).empty());
  EXPECT_THAT(error_, HasSubstr("a label or a layer that makes no sense"));
}

/// How well a distance agrees with the border of a label within the slices, and how smooth it is:
/// along columns and rows in which the label changes, the place of distance 0. And the angle
/// between the normals at crossings that are neighbours in the slice.
struct Border {
  double mean_mm = 0.0, rms_mm = 0.0;
  double angle_rms_degrees = 0.0;
};
Border border_of(const Mask& mask, const Volume& distance) {
  const Grid& grid = mask.grid;
  // Place (mm), normal.
  std::vector<std::pair<glm::dvec3, glm::dvec3>> crossings;
  double sum = 0.0, squares = 0.0;
  const auto value = [&](glm::dvec3 mm) {
    return sample(distance, distance.grid.index_from_lps(mm));
  };
  for (int k = 1; k + 1 < grid.size.z; ++k)
    for (int j = 1; j + 1 < grid.size.y; ++j)
      for (int i = 1; i + 1 < grid.size.x; ++i)
        for (const glm::ivec3 step : {glm::ivec3(1, 0, 0), glm::ivec3(0, 1, 0)}) {
          const bool here = mask.values[grid.offset(i, j, k)];
          const glm::ivec3 other = glm::ivec3(i, j, k) + step;
          if (here == bool(mask.values[grid.offset(other.x, other.y, other.z)])) continue;
          const glm::dvec3 a = grid.lps_from_index({i, j, k});
          const glm::dvec3 b = grid.lps_from_index(glm::dvec3(other));
          const glm::dvec3 in = here ? a : b, out = here ? b : a;
          const double d_in = value(in), d_out = value(out);
          // Not across the border.
          if (!(d_in - d_out > 0.2 * glm::length(in - out))) continue;
          const double share = d_in / (d_in - d_out);
          // Above 0 where the wall is outside the label.
          const double off = (share - 0.5) * glm::length(out - in);
          sum += off;
          squares += off * off;
          glm::dvec3 normal;
          const glm::dvec3 at = glm::mix(in, out, std::clamp(share, -1.0, 2.0));
          for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 aside(0.0);
            aside[axis] = 0.4;
            normal[axis] = value(at + aside) - value(at - aside);
          }
          crossings.emplace_back(at, glm::normalize(normal));
        }
  Border border;
  const double count = double(crossings.size());
  border.mean_mm = sum / count;
  border.rms_mm = std::sqrt(squares / count);
  double angles = 0.0, pairs = 0.0;
  for (size_t n = 0; n < crossings.size(); ++n)
    for (size_t m = n + 1; m < std::min(n + 400, crossings.size()); ++m) {
      const double apart = glm::distance(crossings[n].first, crossings[m].first);
      if (apart > 1.2 || apart < 0.4) continue;
      const double angle = glm::degrees(
          std::acos(std::clamp(glm::dot(crossings[n].second, crossings[m].second), -1.0, 1.0)));
      angles += angle * angle;
      ++pairs;
    }
  border.angle_rms_degrees = std::sqrt(angles / pairs);
  return border;
}

TEST(SegmentOfARealHeart, IsNeitherMovedNorStepped) {
  const std::filesystem::path file =
      std::filesystem::path(PALPATE_SHARED_DATA) / "heart_cine/lv_00.mha";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "There is no heart_cine here.";
  const auto read = read_segmentation(file);
  ASSERT_TRUE(read) << read.error().message;
  for (const std::vector<std::string>& labels :
       std::vector<std::vector<std::string>>{{"2"}, {"1", "2"}, {"1"}}) {
    const auto mask = read->front().mask(labels);
    ASSERT_TRUE(mask);
    const Border smooth = border_of(*mask, signed_distance(*mask));
    const Border exact = border_of(*mask, exact_signed_distance(*mask));
    // A quarter of a voxel of 0.82 mm on average; half a voxel is the resolution of a label.
    // Measured: the pool is 0.13 mm smaller, because a Gaussian shrinks curved surfaces.
    EXPECT_LT(std::abs(smooth.mean_mm), 0.2);
    EXPECT_LT(smooth.rms_mm, 0.41);
    // The myocardium alone is one to two voxels thick in places. There it keeps the steps of its
    // voxels, because smoothing would remove it.
    const bool is_thin = labels == std::vector<std::string>{"1"};
    EXPECT_LT(smooth.angle_rms_degrees, (is_thin ? 0.8 : 0.25) * exact.angle_rms_degrees);
  }
}

TEST_F(SegmentationReader, RefusesAnImageWithManyValues) {
  std::string header = kLabels;
  header.replace(header.find("unsigned char"), 13, "unsigned short");
  header.replace(header.find("sizes: 3 2 2"), 12, "sizes: 30 20 2");
  header.replace(header.find("encoding"), 8, "endian: little\nencoding");
  std::vector<uint8_t> samples;
  for (int n = 0; n < 1200; ++n) {
    samples.push_back(uint8_t(n & 255));
    samples.push_back(uint8_t(n >> 8));
  }
  EXPECT_TRUE(read(header, samples, "image.nrrd").empty());
  EXPECT_THAT(error_, HasSubstr("more than 1000 labels"));
}

}  // namespace
}  // namespace palpate::files
