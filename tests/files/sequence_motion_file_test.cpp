// The file of one motion for a whole sequence: read again bit by bit, with the documented layout;
// damaged files are refused with a message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "integration/files/raster/write_field.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "integration/files/sequence_motion_file.h"
#include "tests/files/expect_grid.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"
#include "tests/support/random.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

SequenceMotion some_motion(int harmonics, bool mirrored = false) {
  test::Random random(5);
  SequenceMotion motion;
  motion.reference = 2;
  motion.basis = {{0.0, 0.1, 0.30000000000000004, 0.7}, 1.0 / 0.9, harmonics};
  Grid grid = oblique_grid();
  grid.j_reversed_in_file = mirrored;
  for (size_t n = 0; n < motion.basis.terms(); ++n) {
    motion.terms.push_back(still_field(grid));
    for (glm::vec3& u : motion.terms.back().u_mm) u = glm::vec3(random.vector(5.0));
  }
  motion.terms[1].u_mm[7] = {-0.0F, 1e-41F, 3e38F};
  motion.frames_grid = straight_grid({10, 8, 5});
  motion.frames_grid->j_reversed_in_file = mirrored;
  return motion;
}

void expect_same_bits(const SequenceMotion& a, const SequenceMotion& b) {
  EXPECT_EQ(a.reference, b.reference);
  EXPECT_EQ(a.basis.times_s, b.basis.times_s);
  EXPECT_EQ(a.basis.cycle_s, b.basis.cycle_s);
  EXPECT_EQ(a.basis.harmonics, b.basis.harmonics);
  ASSERT_EQ(a.frames_grid.has_value(), b.frames_grid.has_value());
  if (a.frames_grid) {
    EXPECT_EQ(a.frames_grid->size, b.frames_grid->size);
    EXPECT_EQ(a.frames_grid->spacing_mm, b.frames_grid->spacing_mm);
    EXPECT_EQ(a.frames_grid->direction, b.frames_grid->direction);
    EXPECT_LT(glm::length(a.frames_grid->origin_mm - b.frames_grid->origin_mm), 1e-12);
    EXPECT_EQ(a.frames_grid->j_reversed_in_file, b.frames_grid->j_reversed_in_file);
  }
  EXPECT_EQ(a.basis.repeats_first, b.basis.repeats_first);
  ASSERT_EQ(a.terms.size(), b.terms.size());
  for (size_t n = 0; n < a.terms.size(); ++n) {
    EXPECT_TRUE(same_geometry(a.terms[n].grid, b.terms[n].grid));
    EXPECT_EQ(a.terms[n].grid.j_reversed_in_file, b.terms[n].grid.j_reversed_in_file);
    ASSERT_EQ(a.terms[n].u_mm.size(), b.terms[n].u_mm.size());
    EXPECT_EQ(std::memcmp(a.terms[n].u_mm.data(), b.terms[n].u_mm.data(),
                          a.terms[n].u_mm.size() * sizeof(glm::vec3)),
              0)
        << "term " << n;
  }
}

TEST(SequenceMotionFile, ComesBackBitByBit) {
  const TemporaryFolder folder;
  for (const int harmonics : {0, 1})
    for (const bool mirrored : {false, true}) {
      SequenceMotion motion = some_motion(harmonics, mirrored);
      if (harmonics == 0) motion.basis.cycle_s = 0.0;
      if (harmonics == 0 && !mirrored) motion.frames_grid.reset();  // as in older files
      motion.basis.repeats_first = harmonics > 0;
      const auto path = folder / "m.nrrd";
      const Status written = write_sequence_motion(motion, path);
      ASSERT_TRUE(written) << written.error().message;
      EXPECT_TRUE(holds_sequence_motion(path));
      const auto back = read_sequence_motion(path);
      ASSERT_TRUE(back) << back.error().message;
      expect_same_bits(motion, *back);
    }
}

TEST(SequenceMotionFile, LiesAsDocumented) {
  const TemporaryFolder folder;
  const SequenceMotion motion = some_motion(1);
  const auto path = folder / kSequenceMotionName;
  ASSERT_TRUE(write_sequence_motion(motion, path));
  const std::string bytes = read_bytes(path);
  const size_t end = bytes.find("\n\n") + 2;
  const std::string header = bytes.substr(0, end);
  for (const char* line :
       {"NRRD0005\n", "type: float\n", "dimension: 5\n", "sizes: 3 5 4 3 3\n", "endian: little\n",
        "kinds: vector domain domain domain list\n", "encoding: raw\n",
        "space: left-posterior-superior\n", "SequenceMotion.Version:=1\n",
        "SequenceMotion.ReferenceFrame:=2\n", "SequenceMotion.Harmonics:=1\n",
        "SequenceMotion.FramesSize:=10 8 5\n", "SequenceMotion.FramesSpacing_mm:=0.75 1.25 2.5\n",
        "SequenceMotion.FramesOrigin_mm:=-31.5 12.25 170.125\n",
        "SequenceMotion.FramesDirections:=1 0 0 0 1 0 0 0 1\n",
        "SequenceMotion.FrameTimes_s:=0 0.1 0.30000000000000004 0.7\n",
        "SequenceMotion.Clock:=frames\n", "SequenceMotion.RepeatsFirst:=0\n"})
    EXPECT_THAT(header, HasSubstr(line));
  ASSERT_EQ(bytes.size() - end, 3U * 3 * 60 * sizeof(float));
  // Component fastest, then x, y, z, then the term.
  float value = 0.0F;
  std::memcpy(&value, bytes.data() + end + sizeof(float) * (3 * (60 * 2 + 5 * (4 * 1 + 3) + 4) + 1),
              sizeof(float));
  EXPECT_EQ(value, motion.terms[2].at(4, 3, 1).y);
}

TEST(SequenceMotionFile, RefusesWhatIsDamaged) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_sequence_motion(some_motion(1), folder / "good.nrrd"));
  const std::string good = read_bytes(folder / "good.nrrd");
  const auto expect_refused = [&](const std::string& from, const std::string& to,
                                  const char* sentence) {
    std::string bytes = good;
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    bytes.replace(at, from.size(), to);
    write_bytes(folder / "bad.nrrd", bytes);
    const auto read = read_sequence_motion(folder / "bad.nrrd");
    ASSERT_FALSE(read) << to;
    EXPECT_EQ(read.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(read.error().message, HasSubstr(sentence));
    EXPECT_THAT(read.error().message, HasSubstr(": "));
  };
  expect_refused("FramesSize:=10 8 5", "FramesSize:=10 8", "the grid of its frames makes no sense");
  expect_refused("Frame:=2", "Frame:=4", "reference frame");
  expect_refused("Frame:=2", "Frame:=-1", "reference frame");
  expect_refused("0 0.1", "0 0.8", "times do not rise");
  expect_refused("0 0.1", "1 0.1", "times do not rise");
  expect_refused("Cycle_s:=1", "Cycle_s:=0", "cycle ends before");
  expect_refused("Cycle_s:=1.11", "Cycle_s:=nan ", "cycle ends before");
  expect_refused("Harmonics:=1", "Harmonics:=2", "terms");
  expect_refused("Harmonics:=1", "Harmonics:=99", "harmonics");
  expect_refused("Version:=1", "Version:=2", "version 2");
  expect_refused("Clock:=frames", "Clock:=time", "uneven times");
  expect_refused("SequenceMotion.Clock:=frames\n", "", "uneven times");
  expect_refused("sizes: 3 5 4 3 3", "sizes: 3 5 4 9 3", "too short");
  expect_refused("sizes: 3 5 4 3 3", "sizes: 3 99999 99999 9 3", "too short");
  expect_refused("sizes: 3 5 4 3 3", "sizes: 2 5 4 3 3", "axes");
  expect_refused("vector domain", "domain domain", "axes");
  write_bytes(folder / "bad.nrrd", good.substr(0, good.size() - 4));
  EXPECT_FALSE(read_sequence_motion(folder / "bad.nrrd"));
  std::string infinite = good;
  const float infinity = INFINITY;
  std::memcpy(infinite.data() + infinite.size() - 4, &infinity, 4);
  write_bytes(folder / "bad.nrrd", infinite);
  EXPECT_FALSE(read_sequence_motion(folder / "bad.nrrd"));
  EXPECT_FALSE(write_sequence_motion(some_motion(1), folder / "m.mha"));
}

TEST(SequenceMotionFile, IsNoImageAndNoField) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_sequence_motion(some_motion(1), folder / "m.nrrd"));
  ASSERT_TRUE(write_field(known_field(oblique_grid()), folder / "u.nrrd"));
  for (const auto& error :
       {read_field(folder / "m.nrrd").error(), read_sequence({folder / "m.nrrd"}).error()})
    EXPECT_THAT(error.message, HasSubstr("motion of a whole sequence"));
  EXPECT_FALSE(holds_sequence_motion(folder / "u.nrrd"));
  EXPECT_FALSE(holds_sequence_motion(folder / "none.nrrd"));
  EXPECT_THAT(read_sequence_motion(folder / "u.nrrd").error().message, HasSubstr("lacks the key"));
}

}  // namespace
}  // namespace palpate::files
