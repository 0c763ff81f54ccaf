// Tracked ultrasound as PLUS and 3D Slicer's IGT modules write it: frames, times, places.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/files/raster/raster_file.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr size_t kTrackedFrames = 4;

/// Pictures of 5 x 4 pixels.
std::string tracked_pictures(size_t voxels = 20) {
  std::string bytes;
  for (size_t k = 0; k < kTrackedFrames; ++k)
    for (size_t v = 0; v < voxels; ++v) bytes += char(uint8_t(known_value(v, k)));
  return bytes;
}

std::string shift_text(double x, double z = 0.0) {
  return fmt::format("1 0 0 {} 0 1 0 0 0 0 1 {} 0 0 0 1", x, z);
}

/// The fields of all frames. field(k): lines without the frame's name, "Timestamp = 3".
template <class Field>
std::string of_frames(const Field& field, const char* equals = " = ") {
  std::string text;
  for (size_t k = 0; k < kTrackedFrames; ++k)
    for (const auto& [name, value] : field(k))
      text += fmt::format("Seq_Frame{:04}_{}{}{}\n", k, name, equals, value);
  return text;
}

using FrameLines = std::vector<std::pair<std::string, std::string>>;
FrameLines time_stamp(size_t k) {
  return {{"FrameNumber", std::to_string(k)},
          {"Timestamp", fmt::format("{}", 100.0 + 0.25 * double(k) + (k == 3 ? 0.1 : 0.0))},
          {"UnfilteredTimestamp", fmt::format("{}", 7.0 * double(k))},
          {"ImageStatus", "OK"}};
}

std::string tracked_mha(const std::string& kinds, const std::string& more,
                        const char* orientation = "MFA") {
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = True\n"
      "CenterOfRotation = 0 0 0\nCompressedData = False\nDimSize = 5 4 {}\nElementSpacing = 0.5 "
      "0.25 "
      "1\nElementType = MET_UCHAR\n{}Offset = 10 20 30\nTransformMatrix = 1 0 0 0 1 0 0 0 "
      "1\nUltrasoundImageOrientation = {}\nUltrasoundImageType = BRIGHTNESS\n{}ElementDataFile = "
      "LOCAL\n",
      kTrackedFrames, kinds, orientation, more);
}

class TrackedFrames : public ::testing::Test {
 protected:
  Result<SequenceReader> opened(const std::string& bytes, const char* name = "s.igs.mha") {
    write_bytes(folder_ / name, bytes);
    return SequenceReader::open({folder_ / name});
  }
  std::string refusal(const std::string& bytes) {
    const auto found = opened(bytes);
    EXPECT_FALSE(found);
    return found ? std::string() : found.error().message;
  }
  TemporaryFolder folder_;
};

void expect_tracked_slices(SequenceReader& found) {
  ASSERT_EQ(found.frame_count(), kTrackedFrames);
  EXPECT_EQ(found.grid().size, glm::ivec3(5, 4, 1));
  ASSERT_TRUE(found.times_known());
  EXPECT_THAT(found.times_s(), ElementsAre(100.0, 100.25, 100.5, 100.85));
  EXPECT_THAT(found.notes(), IsEmpty());
  for (size_t k = 0; k < kTrackedFrames; ++k) {
    const auto frame = found.frame(k);
    ASSERT_TRUE(frame) << frame.error().message;
    for (size_t v = 0; v < 20; ++v) EXPECT_EQ(frame->values[v], known_value(v, k)) << k << ' ' << v;
  }
}

TEST_F(TrackedFrames, OfTwoDimensionsAreSlicesInTime) {
  const std::string times = of_frames(time_stamp);
  // Kinds say it; files of old PLUS have none, and say something of each frame.
  for (const char* kinds : {"Kinds = domain domain list\n", ""}) {
    auto found = opened(tracked_mha(kinds, times) + tracked_pictures());
    ASSERT_TRUE(found) << found.error().message;
    expect_tracked_slices(*found);
    EXPECT_EQ(found->grid().spacing_mm, glm::dvec3(0.5, 0.25, 0.5));
    EXPECT_EQ(found->grid().origin_mm, glm::dvec3(10, 20, 30));
  }
  // Without either it is a volume.
  const auto volume = opened(tracked_mha("", "") + tracked_pictures());
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->frame_count(), 1U);
  EXPECT_EQ(volume->grid().size.z, int(kTrackedFrames));
  // Kinds without times.
  const auto counted = opened(tracked_mha("Kinds = domain domain list\n", "") + tracked_pictures());
  ASSERT_TRUE(counted) << counted.error().message;
  EXPECT_EQ(counted->frame_count(), kTrackedFrames);
  EXPECT_FALSE(counted->times_known());
}

TEST_F(TrackedFrames, AreReadFromNrrd) {
  const std::string keys = of_frames(time_stamp, ":=");
  for (const char* space :
       {"space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.25,0) none\nspace "
        "origin: "
        "(10,20,30)\n",
        "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.25,0) (0,0,1)\nspace "
        "origin: (10,20,30)\n",
        ""}) {
    auto found = opened(fmt::format("NRRD0005\ntype: unsigned char\ndimension: 3\nsizes: 5 4 {}\n{}"
                                    "kinds: domain domain list\nencoding: raw\n{}\n",
                                    kTrackedFrames, space, keys) +
                            tracked_pictures(),
                        "s.igs.nrrd");
    ASSERT_TRUE(found) << found.error().message;
    expect_tracked_slices(*found);
  }
}

TEST_F(TrackedFrames, OfThreeDimensionsHaveTheirTimeStamps) {
  const std::string header = fmt::format(
      "ObjectType = Image\nNDims = 4\nDimSize = 5 2 2 {}\nElementSpacing = 1 1 1 1\n"
      "ElementType = MET_UCHAR\nKinds = domain domain domain list\nOffset = 0 0 0 0\n"
      "TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n{}ElementDataFile = LOCAL\n",
      kTrackedFrames, of_frames(time_stamp));
  const auto found = opened(header + tracked_pictures(), "s.seq.mha");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->frame_count(), kTrackedFrames);
  EXPECT_THAT(found->times_s(), ElementsAre(100.0, 100.25, 100.5, 100.85));
}

TEST_F(TrackedFrames, LieWherePlusPlacesThemWhateverTheirOrientation) {
  // The pixel (1, 0) of the file. M counts to the right, F down; x and y of MF are those of Offset.
  struct OrientedCase {
    const char* orientation;
    glm::dvec3 place;
  };
  const OrientedCase cases[] = {{"MFA", {10.5, 20.0, 30.0}},  {"MF", {10.5, 20.0, 30.0}},
                                {"UFA", {11.5, 20.0, 30.0}},  {"UF", {11.5, 20.0, 30.0}},
                                {"MNA", {10.5, 20.75, 30.0}}, {"UNA", {11.5, 20.75, 30.0}},
                                {"FMA", {10.0, 20.5, 30.0}},  {"NM", {10.0, 21.5, 30.0}}};
  for (const auto& [orientation, place] : cases) {
    const auto found =
        opened(tracked_mha("Kinds = domain domain list\n", of_frames(time_stamp), orientation) +
               tracked_pictures());
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_THAT(found->notes(), IsEmpty());
    const Grid stored = as_in_file(found->grid());
    EXPECT_LT(glm::length(stored.lps_from_index({1, 0, 0}) - place), 1e-12) << orientation;
  }
  // The same key in NRRD.
  const auto nrrd = opened(
      fmt::format("NRRD0005\ntype: unsigned char\ndimension: 3\nsizes: 5 4 {}\nspace: "
                  "left-posterior-superior\nspace directions: (0.5,0,0) (0,0.25,0) none\nspace "
                  "origin: (10,20,30)\nencoding: raw\nUltrasoundImageOrientation:=UNA\n{}\n",
                  kTrackedFrames, of_frames(time_stamp, ":=")) +
          tracked_pictures(),
      "s.igs.nrrd");
  ASSERT_TRUE(nrrd) << nrrd.error().message;
  EXPECT_EQ(nrrd->frame_count(), kTrackedFrames);
  EXPECT_LT(glm::length(as_in_file(nrrd->grid()).lps_from_index({1, 0, 0}) -
                        glm::dvec3(11.5, 20.75, 30.0)),
            1e-12);
  const auto unknown =
      opened(tracked_mha("Kinds = domain domain list\n", of_frames(time_stamp), "XYZ") +
             tracked_pictures());
  ASSERT_TRUE(unknown) << unknown.error().message;
  ASSERT_THAT(unknown->notes(), SizeIs(1));
  EXPECT_THAT(unknown->notes().front(), HasSubstr("'XYZ'"));
}

TEST_F(TrackedFrames, OfASweepAreRefused) {
  const auto swept = [](const char* name, double step_mm) {
    return of_frames([=](size_t k) {
      FrameLines fields = time_stamp(k);
      fields.emplace_back(std::string(name) + "Transform", shift_text(0.0, step_mm * double(k)));
      fields.emplace_back(std::string(name) + "TransformStatus", "OK");
      return fields;
    });
  };
  const std::string kinds = "Kinds = domain domain list\n";
  for (const char* name :
       {"ProbeToTracker", "ImageToReference", "ProbeToReference", "TransducerToTracker"}) {
    EXPECT_THAT(refusal(tracked_mha(kinds, swept(name, 10.0)) + tracked_pictures()),
                HasSubstr("moved by up to 30 mm"));
    const auto at_rest = opened(tracked_mha(kinds, swept(name, 0.1)) + tracked_pictures());
    ASSERT_TRUE(at_rest) << at_rest.error().message;
    EXPECT_THAT(at_rest->notes(), IsEmpty());
    const auto held = opened(tracked_mha(kinds, swept(name, 1.0)) + tracked_pictures());
    ASSERT_TRUE(held) << held.error().message;
    ASSERT_THAT(held->notes(), SizeIs(1));
    EXPECT_THAT(held->notes().front(), HasSubstr("moved by up to 3 mm"));
  }
  // What is tracked beside the probe says nothing of the picture.
  const auto stylus =
      opened(tracked_mha(kinds, swept("StylusToTracker", 10.0)) + tracked_pictures());
  EXPECT_TRUE(stylus) << stylus.error().message;
}

TEST_F(TrackedFrames, TurnOfTheProbeCountsWhereThePictureIs) {
  // 90 degrees about the probe's own place: its origin stays, the picture's corner goes.
  const auto turned = of_frames([](size_t k) {
    FrameLines fields = time_stamp(k);
    fields.emplace_back("ImageToReferenceTransform", k == 2 ? "0 0 4 0 0 1 0 0 -4 0 0 0 0 0 0 1"
                                                            : "4 0 0 0 0 4 0 0 0 0 4 0 0 0 0 1");
    return fields;
  });
  EXPECT_THAT(refusal(tracked_mha("Kinds = domain domain list\n", turned) + tracked_pictures()),
              HasSubstr("lie at different places"));
}

TEST_F(TrackedFrames, MoveOfThePatientWithTheProbeIsTakenOff) {
  const auto together = of_frames([](size_t k) {
    FrameLines fields = time_stamp(k);
    fields.emplace_back("ProbeToTrackerTransform", shift_text(20.0 * double(k)));
    fields.emplace_back("ReferenceToTrackerTransform", shift_text(20.0 * double(k)));
    return fields;
  });
  const auto found =
      opened(tracked_mha("Kinds = domain domain list\n", together) + tracked_pictures());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_THAT(found->notes(), IsEmpty());
}

TEST_F(TrackedFrames, WithoutAPlaceOrAPictureAreNamed) {
  const auto with_status = [](const char* name, const char* status) {
    return of_frames([=](size_t k) {
      FrameLines fields = time_stamp(k);
      fields.emplace_back("ProbeToTrackerTransform", k == 2 ? shift_text(500.0) : shift_text(1.0));
      fields.emplace_back("ProbeToTrackerTransformStatus", "OK");
      for (auto& [key, value] : fields)
        if (k == 2 && key == name) value = status;
      return fields;
    });
  };
  // The transform of a frame that is not tracked is no place.
  const std::string kinds = "Kinds = domain domain list\n";
  for (const char* status : {"INVALID", "MISSING", "Invalid"}) {
    const auto found =
        opened(tracked_mha(kinds, with_status("ProbeToTrackerTransformStatus", status)) +
               tracked_pictures());
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_THAT(found->notes(), SizeIs(1));
    EXPECT_THAT(found->notes().front(), HasSubstr("in 1 of 4 frames"));
  }
  EXPECT_THAT(
      refusal(tracked_mha(kinds, with_status("ImageStatus", "INVALID")) + tracked_pictures()),
      HasSubstr("no picture in frame 2"));
  EXPECT_THAT(refusal(tracked_mha(kinds, with_status("Timestamp", "100.1")) + tracked_pictures()),
              HasSubstr("order of their times"));
  const auto lacks =
      opened(tracked_mha(
                 kinds, of_frames([](size_t k) { return k == 2 ? FrameLines{} : time_stamp(k); })) +
             tracked_pictures());
  ASSERT_TRUE(lacks) << lacks.error().message;
  EXPECT_FALSE(lacks->times_known());
  ASSERT_THAT(lacks->notes(), SizeIs(1));
  EXPECT_THAT(lacks->notes().front(), HasSubstr("no time stamp of frame 2"));
}

TEST_F(TrackedFrames, LieAlongTheLastAxis) {
  EXPECT_THAT(refusal(tracked_mha("Kinds = list domain domain\n", "") + tracked_pictures()),
              HasSubstr("'Kinds'"));
}

TEST(MetaImages, OfTwoDimensionsAreSlicesAndOfFourMayTurnInThree) {
  const TemporaryFolder folder;
  write_bytes(
      folder / "s.mha",
      "NDims = 2\nDimSize = 5 4\nElementSpacing = 0.5 0.25\nOffset = 3 4\nTransformMatrix = 0 "
      "1 -1 0\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
          tracked_pictures().substr(0, 20));
  const auto slice = read_volume(folder / "s.mha");
  ASSERT_TRUE(slice) << slice.error().message;
  EXPECT_EQ(slice->grid.size, glm::ivec3(5, 4, 1));
  EXPECT_EQ(slice->grid.spacing_mm, glm::dvec3(0.5, 0.25, 0.5));
  EXPECT_LT(glm::length(slice->grid.lps_from_index({2, 0, 0}) - glm::dvec3(3, 5, 0)), 1e-12);
  // Nine numbers for the three axes of space of four.
  write_bytes(folder / "t.mha",
              "NDims = 4\nDimSize = 5 2 2 4\nElementSpacing = 1 1 1 0.5\nOffset = 1 2 3 0\n"
              "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nElementType = MET_UCHAR\nElementDataFile = "
              "LOCAL\n" +
                  tracked_pictures());
  const auto frames = SequenceReader::open({folder / "t.mha"});
  ASSERT_TRUE(frames) << frames.error().message;
  EXPECT_EQ(frames->frame_count(), kTrackedFrames);
  EXPECT_LT(glm::length(frames->grid().lps_from_index({1, 0, 0}) - glm::dvec3(1, 3, 3)), 1e-12);
  EXPECT_THAT(frames->times_s(), ElementsAre(0.0, 0.5, 1.0, 1.5));
}

}  // namespace
}  // namespace palpate::files
