#include "integration/files/frame_names.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::filesystem::path> paths(const std::vector<std::string>& names) {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : names) files.push_back(std::filesystem::path("scan") / name);
  return files;
}

/// The names in the order that is found, from any order in which the folder lists them.
NamedFrames found(const std::vector<std::string>& names) {
  std::vector<std::filesystem::path> files = paths(names);
  std::mt19937 random(unsigned(names.size()));
  std::shuffle(files.begin(), files.end(), random);
  const auto frames = frames_by_name("scan", files);
  EXPECT_TRUE(frames) << frames.error().message;
  return frames ? *frames : NamedFrames{};
}

std::string refusal(const std::vector<std::string>& names) {
  const auto frames = frames_by_name("scan", paths(names));
  return frames ? "" : frames.error().message;
}

TEST(FrameNames, AreOrderedByTheirNumber) {
  for (const std::vector<std::string>& names : std::vector<std::vector<std::string>>{
           {"frame_0.mha", "frame_1.mha", "frame_2.mha"},
           {"frame9.nrrd", "frame10.mha", "Frame11.nii.gz"},
           {"phase00%.nii", "phase10%.nii", "phase20%.nii"},
           {"heart-1.mha", "heart-2.mha", "heart-10.mha"},
           {"t-2.mha", "t-1.mha", "t0.mha", "t+1.mha"},
           {"r_-400 ms.nii", "r_-300 ms.nii", "r_-50 ms.nii"},
           {"t0.mha", "t0.5.mha", "t1.mha", "t1.25.mha", "t1.5.mha"},
           {"1.2.826.9.mha", "1.2.826.10.mha", "1.2.826.11.mha"},
           {"scan_20240131101559.mha", "scan_20240131101600.mha", "scan_20240131101601.mha"},
           {"07_30%.mha", "08_40%.mha", "09_50%.mha"}}) {
    const NamedFrames frames = found(names);
    EXPECT_EQ(frames.files, paths(names)) << names.front();
    EXPECT_THAT(frames.notes, IsEmpty()) << names.front();
  }
}

TEST(FrameNames, OfOtherFilesAreLeftOut) {
  const NamedFrames frames = found({"f0.mha", "f1.mha", "f2.mha", "mean.mha", "f1_mask.mha"});
  EXPECT_EQ(frames.files, paths({"f0.mha", "f1.mha", "f2.mha"}));
  EXPECT_THAT(frames.notes,
              ElementsAre("Left out, because the 3 frames are called 'f#': 'f1_mask.mha', "
                          "'mean.mha'."));
}

TEST(FrameNames, ThatAreNotCertainAreSaid) {
  EXPECT_THAT(found({"heart_ed.mha", "heart_es.mha"}).notes,
              ElementsAre("The names of the frames say no order: they are taken by their letters, "
                          "'heart_ed.mha', 'heart_es.mha'."));
  const NamedFrames two = found({"t1_z1.mha", "t1_z2.mha", "t2_z1.mha", "t10_z1.mha"});
  EXPECT_EQ(two.files, paths({"t1_z1.mha", "t1_z2.mha", "t2_z1.mha", "t10_z1.mha"}));
  EXPECT_THAT(two.notes, ElementsAre(AllOf(HasSubstr("differ in 2 numbers"),
                                           HasSubstr("from 't1_z1.mha' to 't10_z1.mha'"))));
  EXPECT_THAT(found({"00_100%.mha", "01_90%.mha", "02_80%.mha"}).notes,
              ElementsAre(HasSubstr("differ in 2 numbers")));
  EXPECT_THAT(found({"f1.mha", "f2.mha", "f4.mha", "f5.mha"}).notes,
              ElementsAre("Between 'f2.mha' and 'f4.mha' a number is missing: is a frame?"));
  EXPECT_THAT(found({"f0.mha", "f10.mha", "f20.mha", "f40.mha"}).notes,
              ElementsAre(HasSubstr("Between 'f20.mha' and 'f40.mha'")));
}

TEST(FrameNames, WithoutOneOrderAreRefused) {
  EXPECT_THAT(refusal({"mag_0.mha", "mag_1.mha", "phase_0.mha", "phase_1.mha"}),
              HasSubstr("2 sequences by the names of its files, 'mag_#' (2 files), 'phase_#' (2 "
                        "files): name"));
  EXPECT_THAT(refusal({"f1.mha", "f1.nii.gz", "f2.mha"}), HasSubstr("'f1.mha' and 'f1.nii.gz'"));
  EXPECT_THAT(refusal({"F1.mha", "f1.mha"}), HasSubstr("which have one name"));
  EXPECT_THAT(refusal({"f1.mha", "f01.mha", "f2.mha"}), HasSubstr("have the same number"));
  EXPECT_THAT(refusal({"t0.5.mha", "t0.25.mha", "t0.75.mha"}),
              AllOf(HasSubstr("by decimals"), HasSubstr("'t0.25.mha' comes before")));
  EXPECT_EQ(refusal({"t1.05.mha", "t1.10.mha", "t2.00.mha"}), "");
}

TEST(ListedOrder, IsRefusedWhereAShellSortedNumbersByLetters) {
  const auto check = [](const std::vector<std::string>& names) {
    const Status status = check_listed_order(paths(names));
    return status ? "" : status.error().message;
  };
  EXPECT_THAT(check({"f_0.mha", "f_1.mha", "f_10.mha", "f_11.mha", "f_2.mha"}),
              AllOf(HasSubstr("f_2.mha' is listed after 'f_11.mha'"), HasSubstr("ls -v")));
  EXPECT_THAT(check({"f1.nii.gz", "f10.nii.gz", "f2.nii.gz"}), HasSubstr("'f10.nii.gz'"));
  // As a shell with a language sorts, which does not look at points.
  EXPECT_THAT(check({"f10.nii.gz", "f1.nii.gz", "f2.nii.gz"}), HasSubstr("f1.nii.gz"));
  EXPECT_EQ(check({"f_00.mha", "f_01.mha", "f_10.mha"}), "");
  // A person's own orders: backwards, from another phase on, and pairs.
  EXPECT_EQ(check({"f_11.mha", "f_10.mha", "f_9.mha"}), "");
  EXPECT_EQ(check({"f_5.mha", "f_10.mha", "f_0.mha", "f_1.mha"}), "");
  EXPECT_EQ(check({"f_10.mha", "f_2.mha"}), "");
  EXPECT_EQ(check({"a_2.mha", "b_1.mha", "c_0.mha"}), "");
  EXPECT_EQ(check({"f-1.mha", "f-2.mha", "f-3.mha"}), "");
  EXPECT_EQ(check({}), "");
}

/// A frame of 2^3 voxels that all have one value.
void write_frame(const std::filesystem::path& path, float value) {
  Grid grid;
  grid.size = glm::ivec3(2);
  ASSERT_TRUE(write_volume({grid, std::vector<float>(grid.count(), value)}, path));
}

std::vector<float> values_of(const std::vector<std::filesystem::path>& inputs,
                             std::vector<std::string>* notes = nullptr) {
  auto reader = SequenceReader::open(inputs);
  EXPECT_TRUE(reader) << reader.error().message;
  std::vector<float> values;
  if (!reader) return values;
  if (notes) *notes = reader->notes();
  for (size_t k = 0; k < reader->frame_count(); ++k)
    values.push_back(reader->frame(k)->values.front());
  return values;
}

TEST(FrameNames, OrderTheFramesOfAFolder) {
  const TemporaryFolder folder;
  for (const int k : {10, 2, 1}) write_frame(folder / fmt::format("Frame {}.mha", k), float(k));
  write_frame(folder / "average.mha", 4.0F);
  std::vector<std::string> notes;
  EXPECT_THAT(values_of({folder.path()}, &notes), ElementsAre(1.0F, 2.0F, 10.0F));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("'average.mha'")));
  // A list has its own order, but not that in which a shell sorts numbers.
  EXPECT_THAT(values_of({folder / "Frame 10.mha", folder / "Frame 2.mha", folder / "Frame 1.mha"}),
              ElementsAre(10.0F, 2.0F, 1.0F));
  const auto shell = SequenceReader::open(
      {folder / "Frame 1.mha", folder / "Frame 10.mha", folder / "Frame 2.mha"});
  ASSERT_FALSE(shell);
  EXPECT_THAT(shell.error().message, HasSubstr("ls -v"));
  // One frame in two formats.
  write_frame(folder / "Frame 2.nii.gz", 2.0F);
  const auto twice = SequenceReader::open({folder.path()});
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message, HasSubstr("'Frame 2.mha' and 'Frame 2.nii.gz'"));
}

TEST(FrameNames, OfImagesAndDicomInOneFolderAreRefused) {
  const TemporaryFolder folder;
  write_frame(folder / "IM1_converted.nii.gz", 1.0F);
  std::ofstream(folder / "notes.txt") << "no image";
  EXPECT_TRUE(SequenceReader::open({folder.path()}));
  std::ofstream(folder / "IM1") << std::string(128, '\0') << "DICM" << std::string(8, '\0');
  const auto mixed = SequenceReader::open({folder.path()});
  ASSERT_FALSE(mixed);
  EXPECT_THAT(mixed.error().message, AllOf(HasSubstr("'IM1'"), HasSubstr("'IM1_converted.nii.gz'"),
                                           HasSubstr("either can be meant")));
}

}  // namespace
}  // namespace palpate::files
