// The examples of docs/examples, built against the installed package and nothing else, and run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include "compute/volume/phantom.h"
#include "integration/files/read_volume.h"
#include "integration/files/write_volume.h"
#include "tests/desktop/virtual_display.h"
#include "tests/files/temporary_folder.h"

namespace palpate::test {
namespace {

using files::TemporaryFolder;
using ::testing::HasSubstr;

struct Ran {
  int exit_code = -1;
  std::string text;  ///< of both streams
};

Ran run(const std::string& command) {
  Ran ran;
  std::FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> piece;
  while (pipe && std::fgets(piece.data(), int(piece.size()), pipe)) ran.text += piece.data();
  const int status = pipe ? ::pclose(pipe) : -1;
  ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

/// Installs the library and what developers need; once per test program.
class InstalledPackage : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* component : {"palpate_library", "palpate_development"}) {
      // The list of what was put in place must not replace that of a person's own installation.
      const Ran installed = run("DESTDIR= cmake -DCMAKE_INSTALL_PREFIX=" + prefix() +
                                " -DCMAKE_INSTALL_COMPONENT=" + component + " -P " + script());
      ASSERT_EQ(installed.exit_code, 0) << installed.text;
    }
  }
  std::string prefix() const { return folder_ / "prefix"; }
  std::string at(const std::string& name) const { return folder_ / name; }
  std::string script() {
    std::string text = files::read_bytes(PALPATE_BUILD_DIR "/cmake_install.cmake");
    const std::string real = "file(WRITE \"" PALPATE_BUILD_DIR "/";
    const size_t place = text.find(real);
    EXPECT_NE(place, std::string::npos);
    if (place != std::string::npos)
      text.replace(place, real.size(), "file(WRITE \"" + folder_.path().string() + "/");
    files::write_bytes(folder_ / "cmake_install.cmake", text);
    return folder_ / "cmake_install.cmake";
  }
  TemporaryFolder folder_;
};

/// How many pixels of a picture (PPM) are mostly blue, as the cube is, and mostly red, as the
/// heart.
std::pair<int, int> blue_and_red(const std::string& file) {
  const std::string bytes = files::read_bytes(file);
  const size_t begin = bytes.find("255\n") + 4;
  int blue = 0, red = 0;
  for (size_t p = begin; p + 2 < bytes.size(); p += 3) {
    const int r = static_cast<unsigned char>(bytes[p]),
              b = static_cast<unsigned char>(bytes[p + 2]);
    blue += b > r + 60;
    red += r > b + 60;
  }
  return {blue, red};
}

double mean_difference(const Volume& a, const Volume& b) {
  double sum = 0.0;
  for (size_t n = 0; n < a.values.size(); ++n)
    sum += std::abs(double(a.values[n]) - double(b.values[n]));
  return sum / double(a.values.size());
}

TEST_F(InstalledPackage, BuildsAndRunsTheExamples) {
  const Ran configured =
      run("cmake -S " + prefix() + "/share/doc/libpalpate-dev/examples -B " + at("build") +
          " -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=" + prefix());
  ASSERT_EQ(configured.exit_code, 0) << configured.text;
  const Ran built = run("cmake --build " + at("build"));
  ASSERT_EQ(built.exit_code, 0) << built.text;

  // The built-in heart in a host's loop: touched, smooth, and let go of by a ramp.
  const Ran loop = run(at("build/host_loop") + " --seconds 4");
  EXPECT_EQ(loop.exit_code, 0) << loop.text;
  std::smatch felt;
  ASSERT_TRUE(std::regex_search(loop.text, felt,
                                std::regex("felt (\\d+) ms of \\d+, at most ([0-9.]+) N, at most "
                                           "([0-9.]+) N more .*; 0.00 N at the end")))
      << loop.text;
  EXPECT_GT(std::stod(felt[1]), 500);
  EXPECT_GT(std::stod(felt[2]), 0.2);
  EXPECT_LE(std::stod(felt[3]), 0.25);
  const Ran wrong = run(at("build/host_loop") + " /nowhere.mha");
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.text, HasSubstr("/nowhere.mha"));

  // A program for ITK's Demons, with palpate in its place: what it warps looks like what is fixed.
  const Sequence shell = shell_phantom(40);
  ASSERT_TRUE(files::write_volume(shell.frames[0], at("fixed.nii.gz")));
  ASSERT_TRUE(files::write_volume(shell.frames[1], at("moving.nii.gz")));
  const std::string demons = at("build/itk_demons") + " " + at("fixed.nii.gz") + " ";
  const Ran registered =
      run(demons + at("moving.nii.gz") + " " + at("warped.mha") + " " + at("field.mha"));
  ASSERT_EQ(registered.exit_code, 0) << registered.text;
  EXPECT_THAT(registered.text, HasSubstr("The field is ok"));
  const auto warped = files::read_volume(at("warped.mha"));
  ASSERT_TRUE(warped) << warped.error().message;
  const auto found = files::read_field(at("field.mha"));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(same_geometry(found->grid, shell.frames[0].grid));
  EXPECT_LT(mean_difference(*warped, shell.frames[0]),
            0.6 * mean_difference(shell.frames[1], shell.frames[0]));
  const Ran missing = run(demons + at("none.mha") + " " + at("warped.mha"));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.text, HasSubstr("none.mha"));

  // A volume that moves in a VTK pipeline, where VTK is there: like the real frames, more than one
  // that stands still.
  if (std::filesystem::exists(at("build/vtk_volume"))) {
    std::string frames;
    for (size_t k = 0; k < shell.frames.size(); ++k) {
      const std::string frame = at("frame_" + std::to_string(k) + ".mha");
      ASSERT_TRUE(files::write_volume(shell.frames[k], frame));
      frames += " " + frame;
    }
    const std::string volume = at("build/vtk_volume") + " --preset fast " + at("moved.vti");
    const Ran moved = run(volume + frames);
    ASSERT_EQ(moved.exit_code, 0) << moved.text;
    std::smatch means;
    ASSERT_TRUE(
        std::regex_search(moved.text, means, std::regex("All: moved ([0-9.]+), still ([0-9.]+);")))
        << moved.text;
    EXPECT_LT(std::stod(means[1]), 0.6 * std::stod(means[2]));
    EXPECT_THAT(files::read_bytes(at("moved.vti")), HasSubstr("Direction=\"1 0 0 0 1 0 0 0 1\""));
    const Ran no_frame = run(volume + frames + " " + at("none.mha"));
    EXPECT_EQ(no_frame.exit_code, 1);
    EXPECT_THAT(no_frame.text, HasSubstr("none.mha"));
  }

  // The cube in the heart: both are seen.
  std::string why_not;
  auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << "The pictures are not looked at: " << why_not;
  const Ran drawn = run(at("build/host_vulkan") + " --frames 2 --screenshot " + at("picture.ppm"));
  ASSERT_EQ(drawn.exit_code, 0) << drawn.text;
  const auto [blue, red] = blue_and_red(at("picture.ppm"));
  EXPECT_GT(blue, 4000);
  EXPECT_GT(red, 10000);
}

TEST_F(InstalledPackage, IsFoundByPkgConfigInCAndCpp) {
  if (run("pkg-config --version").exit_code != 0) GTEST_SKIP() << "There is no pkg-config here.";
  files::write_bytes(folder_ / "least.c",
                     "#include <palpate.h>\n#include <palpate_mode.h>\n"
                     "int main(void) { return pal_version() == PAL_VERSION ? 0 : 1; }\n");
  const std::string flags = "$(PKG_CONFIG_PATH=" + prefix() +
                            "/lib/pkgconfig pkg-config --cflags --libs palpate) -Wl,-rpath," +
                            prefix() + "/lib";
  for (const char* compiler : {"cc -std=c99 -pedantic -Wall -Wextra -Werror", "c++ -x c++"}) {
    const Ran built = run(std::string(compiler) + " " + at("least.c") + " -x none " + flags +
                          " -o " + at("least"));
    ASSERT_EQ(built.exit_code, 0) << built.text;
    EXPECT_EQ(run(at("least")).exit_code, 0);
  }
}

}  // namespace
}  // namespace palpate::test
