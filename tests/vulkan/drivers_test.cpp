// The same work on other Vulkan drivers: SwiftShader, which Debian's package chromium brings, and
// the lavapipe of Debian trixie, from the folder that tests/xr/monado_root.sh makes. A driver that
// rounds, schedules and checks limits in its own way finds what one driver forgives. Skipped, and
// said, where a driver is not there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "compute/vulkan/context.h"
#include "integration/files/read_volume.h"
#include "tests/lab/report/child.h"

namespace palpate::test {
namespace {

namespace fs = std::filesystem;

// Mean difference of fields from two drivers, voxels of the finest axis: a seventh of what either
// misses the true motion by.
constexpr double kAlike_voxels = 0.02;

/// How programs are started so that they use one driver and no other.
struct Driver {
  std::vector<std::string> start;  ///< what stands before the program's name
  std::string why_not;             ///< what is missing; empty: it is there
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

/// Through the folder's own ld.so, since the driver needs a newer C library than this machine's.
Driver newer_lavapipe(const fs::path& scratch) {
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

  /// What the program said; the test fails if it did not end well.
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

// Against the oracles, and under the validation layers, which know what each driver promises.
// SwiftShader stores fp16 numbers one step too far from zero even where they are fp16 numbers
// already, and infinity as NaN, which marks a voxel outside the mask as well: no comparison lets
// either pass. The one test that asks for the very bits is left out there.
TEST_P(OtherDriver, PassesTheTestsOfTheMotionKernels) {
  const bool swift = GetParam() == std::string("SwiftShader");
  run(driver_,
      {PALPATE_KERNELS_TEST, "--gtest_brief=1",
       swift ? "--gtest_filter=-PackKernel.MarksTheGradientOutsideTheMaskAndKeepsTheIntensity"
             : "--gtest_filter=*"});
}

// 48 dB from lavapipe's pictures that a person has looked at.
TEST_P(OtherDriver, DrawsTheGoldenPictures) {
  run(driver_, {PALPATE_VIEW_TEST, "--gtest_brief=1", "--gtest_filter=GoldenTest.*"});
}

INSTANTIATE_TEST_SUITE_P(, OtherDriver, ::testing::Values("SwiftShader", "llvmpipe (LLVM 19"),
                         [](const auto& parameter) {
                           return std::string(parameter.index ? "NewerLavapipe" : "SwiftShader");
                         });

}  // namespace
}  // namespace palpate::test
