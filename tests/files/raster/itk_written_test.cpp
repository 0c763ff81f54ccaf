// ITK is the oracle: palpate must read what it writes, with every number in its place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;

struct Case {
  const char* name;
  SampleType type;
  bool compressed;
};

class ItkWrittenFile : public ::testing::TestWithParam<std::tuple<Case, bool>> {};

TEST_P(ItkWrittenFile, KeepsValuesSpacingAndDirection) {
  const auto& [file, oblique] = GetParam();
  const TemporaryFolder folder;
  const auto path = folder / file.name;
  const Volume volume = known_volume(oblique ? oblique_grid() : straight_grid());
  itk_oracle::write(path, {volume}, {.type = file.type, .compressed = file.compressed});
  const auto found = read_volume(path);
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, volume.grid, tolerance_of(file.name));
  EXPECT_EQ(found->values, volume.values);
}

TEST_P(ItkWrittenFile, KeepsFramesAndTimesOfA4DImage) {
  const auto& [file, oblique] = GetParam();
  const TemporaryFolder folder;
  const auto path = folder / file.name;
  std::vector<Volume> frames;
  for (size_t k = 0; k < 4; ++k)
    frames.push_back(known_volume(oblique ? oblique_grid() : straight_grid(), k));
  itk_oracle::write(path, frames,
                    {.type = file.type, .compressed = file.compressed, .time_step_s = 0.25});
  const auto found = read_sequence({path});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->frames.size(), 4u);
  for (size_t k = 0; k < 4; ++k) {
    expect_grid(found->frames[k].grid, frames[k].grid, tolerance_of(file.name));
    EXPECT_EQ(found->frames[k].values, frames[k].values) << "frame " << k;
  }
  EXPECT_TRUE(found->times_known);
  EXPECT_THAT(found->times_s, ElementsAre(0.0, 0.25, 0.5, 0.75));
}

INSTANTIATE_TEST_SUITE_P(
    AllFormatsAndTypes, ItkWrittenFile,
    ::testing::Combine(
        ::testing::Values(
            Case{"a.mha", SampleType::kUint8, false}, Case{"b.mha", SampleType::kInt16, true},
            Case{"c.mha", SampleType::kUint16, false}, Case{"d.mha", SampleType::kFloat, true},
            Case{"e.mhd", SampleType::kInt16, false}, Case{"f.mhd", SampleType::kFloat, true},
            Case{"g.mha", SampleType::kDouble, false}, Case{"h.mha", SampleType::kInt32, true},
            Case{"a.nrrd", SampleType::kUint8, true}, Case{"b.nrrd", SampleType::kInt16, false},
            Case{"c.nrrd", SampleType::kUint16, true}, Case{"d.nrrd", SampleType::kFloat, false},
            Case{"e.nhdr", SampleType::kInt16, false}, Case{"f.nhdr", SampleType::kFloat, true},
            Case{"g.nrrd", SampleType::kDouble, true}, Case{"h.nrrd", SampleType::kUint32, false},
            Case{"a.nii", SampleType::kUint8, false}, Case{"b.nii.gz", SampleType::kInt16, true},
            Case{"c.nii", SampleType::kUint16, false}, Case{"d.nii.gz", SampleType::kFloat, true},
            Case{"e.nii", SampleType::kDouble, false}, Case{"f.nii.gz", SampleType::kInt32, true}),
        ::testing::Bool()),
    [](const auto& of_case) {
      std::string name = std::get<0>(of_case.param).name;
      for (char& c : name) {
        if (c == '.') c = '_';
      }
      return name + (std::get<1>(of_case.param) ? "_oblique" : "_straight");
    });

class ItkWrittenField : public ::testing::TestWithParam<const char*> {};

TEST_P(ItkWrittenField, IsReadInMillimetresAlongLps) {
  const TemporaryFolder folder;
  const auto path = folder / GetParam();
  const Field field = known_field(oblique_grid());
  itk_oracle::write_field(path, field);
  const auto found = read_field(path);
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, field.grid, tolerance_of(GetParam()));
  EXPECT_EQ(found->u_mm, field.u_mm);
}

INSTANTIATE_TEST_SUITE_P(AllFormats, ItkWrittenField,
                         ::testing::Values("u.mha", "u.mhd", "u.nrrd", "u.nhdr", "u.nii",
                                           "u.nii.gz"));

TEST(VolumeReader, TakesA4DFileWithOneFrame) {
  const TemporaryFolder folder;
  for (const char* name : {"one.mha", "one.nrrd", "one.nii.gz"}) {
    itk_oracle::write(folder / name, {known_volume(oblique_grid())}, {.four_d = true});
    const auto found = read_volume(folder / name);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->values, known_volume(oblique_grid()).values);
  }
}

TEST(MaskReader, TakesEverythingThatIsNotZeroAsInside) {
  const TemporaryFolder folder;
  Volume labels = known_volume(straight_grid());
  labels.values[3] = 0.0f;
  itk_oracle::write(folder / "labels.nii.gz", {labels}, {.type = SampleType::kUint8});
  const auto mask = read_mask(folder / "labels.nii.gz");
  ASSERT_TRUE(mask) << mask.error().message;
  for (size_t v = 0; v < labels.values.size(); ++v)
    EXPECT_EQ(mask->values[v], labels.values[v] != 0.0f) << v;
}

}  // namespace
}  // namespace palpate::files
