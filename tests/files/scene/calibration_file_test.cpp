#include "integration/files/scene/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::HasSubstr;

StoredCalibration made() {
  StoredCalibration stored;
  stored.calibration.stage_from_device = {{0.31, 0.7400000000000001, -0.55},
                                          glm::normalize(glm::dquat(0.3, -0.5, 0.7, 0.1))};
  stored.calibration.rms_m = 0.00104;
  stored.calibration.used = 48;
  stored.calibration.all = 60;
  stored.calibration.delay_s = 0.031;
  stored.calibration.controller_from_tip_m = {0.01, -0.1, 0.02};
  stored.space = "local";
  stored.device = "Falcon";
  stored.headset = "made headset";
  stored.runtime = "palpate's \"test\" runtime 1.0";
  return stored;
}

/// The error message for this text as a file.
std::string calibration_refusal(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "room.json") << text;
  const auto read = read_calibration(folder / "room.json");
  return read ? "" : read.error().message;
}

const std::string kPlace =
    R"("stage_from_device": {"position_m": [1, 2, 3], "quaternion_wxyz": [1, 0, 0, 0]})";

TEST(CalibrationFile, IsReadBackAsItWasWritten) {
  const TemporaryFolder folder;
  const StoredCalibration stored = made();
  ASSERT_TRUE(write_calibration(folder / "room.json", stored));
  const auto read = read_calibration(folder / "room.json");
  ASSERT_TRUE(read) << read.error().message;
  const Calibration &a = stored.calibration, &b = read->calibration;
  EXPECT_EQ(a.stage_from_device.position_m, b.stage_from_device.position_m);
  // Normalised again, which rounds.
  EXPECT_LT(glm::length(a.stage_from_device.rotation - b.stage_from_device.rotation), 1e-15);
  EXPECT_EQ(a.rms_m, b.rms_m);
  EXPECT_EQ(a.used, b.used);
  EXPECT_EQ(a.all, b.all);
  EXPECT_EQ(a.delay_s, b.delay_s);
  EXPECT_EQ(a.controller_from_tip_m, b.controller_from_tip_m);
  EXPECT_EQ(stored.space, read->space);
  EXPECT_EQ(stored.device, read->device);
  EXPECT_EQ(stored.headset, read->headset);
  EXPECT_EQ(stored.runtime, read->runtime);
}

TEST(CalibrationFile, NeedsThePlaceAndNothingElse) {
  EXPECT_EQ(calibration_refusal("{" + kPlace + "}"), "");
  EXPECT_THAT(calibration_refusal("{}"), HasSubstr("stage_from_device"));
  EXPECT_THAT(calibration_refusal(R"({"stage_from_device": {"position_m": [1, 2, 3]}})"),
              HasSubstr("quaternion_wxyz"));
  EXPECT_THAT(calibration_refusal(R"({"stage_from_device": {"quaternion_wxyz": [1, 0, 0, 0]}})"),
              HasSubstr("position_m"));
}

TEST(CalibrationFile, RefusesWhatIsWrongAndNamesIt) {
  EXPECT_THAT(calibration_refusal(R"({"stage_from_device": {"position_m": [1, 2, 3],)"
                                  R"( "quaternion_wxyz": [1, 1, 0, 0]}})"),
              HasSubstr("unit quaternion"));
  EXPECT_THAT(calibration_refusal(R"({"stage_from_device": {"position_m": [1, 2, 3],)"
                                  R"( "quaternion_wxyz": [1, 0, 0, "x"]}})"),
              HasSubstr("unit quaternion"));
  EXPECT_THAT(calibration_refusal("{" + kPlace + R"(, "space": "stge"})"), HasSubstr("stage"));
  EXPECT_THAT(calibration_refusal("{" + kPlace + R"(, "rms_m": -1})"), HasSubstr("rms_m"));
  EXPECT_THAT(calibration_refusal("{" + kPlace + R"(, "dely_s": 1})"), HasSubstr("delay_s"));
  EXPECT_NE(calibration_refusal("no JSON"), "");
  EXPECT_NE(calibration_refusal("[]"), "");
  const TemporaryFolder folder;
  EXPECT_THAT(read_calibration(folder / "none.json").error().message,
              HasSubstr("palpate calibrate"));
  EXPECT_FALSE(write_calibration(folder / "no such folder" / "room.json", made()));
}

}  // namespace
}  // namespace palpate::files
