// The same work on other Vulkan drivers: SwiftShader, which is in Debian's package chromium, and
// the lavapipe of Debian trixie, from the folder that tests/xr/monado_root.sh makes. Another driver
// rounds and schedules differently and has other limits, so it shows errors that one driver
// tolerates. Skipped, with a message, if a driver is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "compute/vulkan/context.h"
#include "integration/files/read_volume.h"
#include "tests/lab/report/child.h"

namespace palpate::test {
namespace {

namespace fs = std::filesystem;

// Mean difference of fields from two drivers, voxels of the finest axis: a seventh of the error of
// either relative to the true motion.
constexpr double kAlike_voxels = 0.02;

/// How to start programs so that they use one driver only.
struct Driver {
  /// The words before the program's name.
  std::vector<std::string> start;
  /// The missing parts; empty: none.
  std::string why_not;
};

Driver own() {
  return {};
}

Driver swiftshader() {
  const fs::path manifest = "/usr/lib/chromium/vk_swiftshader_icd.json";
  if (!fs::exists(manifest))
    return {{}, "there is no " + manifest.string() + " (Debian: chromium)"};
  return {{"env", "VK_DRIVER_FILES=" + manifest.string()}, {}};
}

/// The start of the name of Debian 13's lavapipe.
constexpr const char* kNewer = "llvmpipe (LLVM 19";

/// With the folder's own ld.so, because the driver needs a newer C library than this machine's.
Driver newer_lavapipe(const fs::path& scratch) {
  for (const vulkan::GpuInfo& device : vulkan::list_devices())
    if (device.name.starts_with("llvmpipe (LLVM 2"))
      return {{}, "this machine's own lavapipe is newer: " + device.name};
  const fs::path said = scratch / "root.txt", why = scratch / "why.txt";
  if (report::call_program({"bash", PALPATE_MONADO_SCRIPT}, said, why) != 0)
    return {{}, report::text_of(why)};
  std::string root = report::text_of(said);
  root = root.substr(0, root.find('\n'));
  const std::string library = root + "/usr/lib/x86_64-linux-gnu";
  return {{"env", "VK_DRIVER_FILES=" + root + "/lavapipe.json", library + "/ld-linux-x86-64.so.2",
           "--library-path",
           library + ":" + root + "/usr/lib:" + library + "/blas:" + library +
               "/lapack:" + library + "/pulseaudio"},
          {}};
}

class OtherDriver : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (vulkan::list_devices().empty()) GTEST_SKIP() << "there is no Vulkan driver to compare with";
    driver_ =
        GetParam() == std::string("SwiftShader") ? swiftshader() : newer_lavapipe(scratch_.path());
    if (!driver_.why_not.empty()) GTEST_SKIP() << driver_.why_not;
  }

  /// The program's output; the test fails if its exit status is not 0.
  std::string run(const Driver& driver, const std::vector<std::string>& arguments) {
    std::vector<std::string> command = driver.start;
    command.insert(command.end(), arguments.begin(), arguments.end());
    const fs::path output = scratch_.path() / "output.txt";
    const int status = report::call_program(command, output, output);
    const std::string said = report::text_of(output);
    EXPECT_EQ(status, 0) << said;
    return said;
  }

  report::ScratchFolder scratch_;
  Driver driver_;
};

TEST_P(OtherDriver, IsTheOneThatIsUsed) {
  const std::string said = run(driver_, {PALPATE_PROGRAM, "devices"});
  EXPECT_THAT(said, ::testing::HasSubstr(GetParam()));
}

TEST_P(OtherDriver, GivesTheSameFieldOfTheLungPair) {
  const fs::path data = fs::path(PALPATE_SHARED_DATA) / "lung";
  if (!fs::exists(data)) GTEST_SKIP() << "there is no " << data;
  std::vector<Field> fields;
  for (const Driver& driver : {own(), driver_}) {
    const fs::path file = scratch_.path() / ("u" + std::to_string(fields.size()) + ".mha");
    run(driver, {PALPATE_PROGRAM, "motion", (data / "pair_fixed.mha").string(),
                 (data / "pair_moving.mha").string(), "-o", file.string(), "--preset", "fast",
                 "--no-verdict", "--quiet"});
    auto field = files::read_field(file);
    ASSERT_TRUE(field) << field.error().message;
    fields.push_back(std::move(*field));
  }
  ASSERT_EQ(fields[0].u_mm.size(), fields[1].u_mm.size());
  double sum_mm = 0.0, moved_mm = 0.0;
  for (size_t i = 0; i < fields[0].u_mm.size(); ++i) {
    sum_mm += glm::length(fields[0].u_mm[i] - fields[1].u_mm[i]);
    moved_mm += glm::length(fields[0].u_mm[i]);
  }
  const double voxel_mm = fields[0].grid.finest_mm(), count = double(fields[0].u_mm.size());
  EXPECT_GT(moved_mm / count, voxel_mm) << "there is no motion in which drivers could differ";
  EXPECT_LT(sum_mm / count, kAlike_voxels * voxel_mm);
}

// Compared with the oracles, and with the validation layers, which check the limits of each driver.
// SwiftShader stores fp16 numbers one step too far from zero even if they are exact fp16 numbers,
// and infinity as NaN, which also marks a voxel outside the mask: no comparison depends on either.
// The one test that requires equal bits is left out there.
TEST_P(OtherDriver, PassesTheTestsOfTheMotionKernels) {
  const bool swift = GetParam() == std::string("SwiftShader");
  run(driver_,
      {PALPATE_KERNELS_TEST, "--gtest_brief=1",
       swift ? "--gtest_filter=-PackKernel.MarksTheGradientOutsideTheMaskAndKeepsTheIntensity"
             : "--gtest_filter=*"});
}

// Within 48 dB of lavapipe's pictures, which were inspected.
TEST_P(OtherDriver, DrawsTheGoldenPictures) {
  run(driver_, {PALPATE_VIEW_TEST, "--gtest_brief=1", "--gtest_filter=GoldenTest.*"});
}

INSTANTIATE_TEST_SUITE_P(, OtherDriver, ::testing::Values("SwiftShader", kNewer),
                         [](const auto& parameter) {
                           return std::string(parameter.index ? "NewerLavapipe" : "SwiftShader");
                         });

}  // namespace
}  // namespace palpate::test
