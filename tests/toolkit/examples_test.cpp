// The examples of docs/examples, built against the installed package only, and run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "compute/volume/phantom.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_volume.h"
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

/// A line of itk_demons: the time of a method and the error of its field.
struct Row {
  double seconds = 0.0, mean = 0.0, p95 = 0.0;
};

/// Rows by method, from the output of itk_demons.
std::map<std::string, Row> rows_of(const std::string& printed) {
  std::map<std::string, Row> rows;
  std::istringstream lines(printed);
  const std::regex row("(.*[^ ]) +([0-9.]+) +([0-9.]+) +([0-9.]+)");
  std::smatch parts;
  for (std::string line; std::getline(lines, line);)
    if (std::regex_match(line, parts, row))
      rows[parts[1]] = {std::stod(parts[2]), std::stod(parts[3]), std::stod(parts[4])};
  return rows;
}

const char* const kItkMethods[] = {"ITK, fast symmetric forces Demons",
                                   "ITK, diffeomorphic Demons"};

/// Mean distance between a field and the true one at the truth's samples in the mask, mm.
double mean_error_mm(const Field& found, const Field& truth, const Volume& mask) {
  double sum = 0.0;
  size_t count = 0;
  const glm::ivec3 size = truth.grid.size;
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i) {
        const glm::dvec3 at = truth.grid.lps_from_index({i, j, k});
        const glm::ivec3 n(glm::round(mask.grid.index_from_lps(at)));
        if (mask.values[mask.grid.offset(n.x, n.y, n.z)] == 0.0F) continue;
        sum += glm::length(glm::dvec3(truth.at(i, j, k)) - sample_at_lps(found, at));
        ++count;
      }
  return sum / double(count);
}

/// For the module; empty if it was not built or numpy is missing.
const std::string kPython = PALPATE_MODULE_PYTHON;

/// Installs what the examples need; once per test program.
class InstalledPackage : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<std::string> components{"palpate_library", "palpate_development",
                                        "palpate_program"};
    if (!kPython.empty()) components.emplace_back("palpate_python");
    for (const std::string& component : components) {
      // CMake's list of installed files must not replace that of a user's own installation.
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
  /// cine.py with the installed module: the motion must explain the frames.
  void follow_a_real_heart() {
    if (kPython.empty()) {
      left_out_ += "The Python module was not built, or numpy is missing. ";
      return;
    }
    const std::string heart = PALPATE_SHARED_DATA "/heart_cine/";
    if (!std::filesystem::exists(heart)) {
      left_out_ += heart + " is missing. ";
      return;
    }
    std::string frames;
    for (const char* number : {"00", "04", "08", "12", "16"})
      frames += " " + heart + "frame_" + number + ".mha";
    const Ran cine =
        run("PYTHONDONTWRITEBYTECODE=1 LD_LIBRARY_PATH=" + prefix() +
            "/lib PYTHONPATH=" + prefix() + "/lib/python3/dist-packages " + kPython + " " +
            examples_ + "/cine.py" + frames + " --preset fast --save " + at("motion.nrrd"));
    ASSERT_EQ(cine.exit_code, 0) << cine.text;
    EXPECT_THAT(cine.text, HasSubstr("verdict: ok"));
    // After they are moved back, the frames differ from the reference frame no more than before.
    const std::regex row("\\n +\\d+ [^\\n]* ([0-9.]+), ([0-9.]+)(?=\\n)");
    int rows = 0;
    for (std::sregex_iterator match(cine.text.begin(), cine.text.end(), row), end; match != end;
         ++match) {
      EXPECT_LE(std::stod((*match)[2]), std::stod((*match)[1])) << match->str();
      ++rows;
    }
    EXPECT_EQ(rows, 5) << cine.text;
    EXPECT_GT(std::filesystem::file_size(at("motion.nrrd")), 1000U);
  }

  TemporaryFolder folder_;
  const std::string examples_ = prefix() + "/share/doc/libpalpate-dev/examples";
  /// What was not tested, and why: sentences.
  std::string left_out_;
};

/// The number of pixels of a picture (PPM) that are mostly blue, as the cube, and mostly red, as
/// the heart.
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
  // Most of the time goes to compiling against ITK and VTK. With paths relative to this folder,
  // whose name is another one each time, what was compiled before is found.
  const std::string cached = run("command -v ccache").exit_code == 0
                                 ? " -DCMAKE_C_COMPILER_LAUNCHER=ccache"
                                   " -DCMAKE_CXX_COMPILER_LAUNCHER=ccache"
                                 : "";
  const Ran configured = run("cmake -S " + examples_ + " -B " + at("build") + cached +
                             " -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=" + prefix());
  ASSERT_EQ(configured.exit_code, 0) << configured.text;
  const Ran built = run("env CCACHE_BASEDIR=" + folder_.path().string() +
                        " CCACHE_NOHASHDIR=1 cmake --build " + at("build"));
  ASSERT_EQ(built.exit_code, 0) << built.text;

  // The built-in heart in a host's loop: contact, no jumps, and a ramp at the end.
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

  // A program for ITK's Demons filter, with palpate instead: the warped image must be similar to
  // the fixed one.
  const Sequence shell = shell_phantom(40);
  ASSERT_TRUE(files::write_volume(shell.frames[0], at("fixed.nii.gz")));
  ASSERT_TRUE(files::write_volume(shell.frames[1], at("moving.nii.gz")));
  const std::string demons = at("build/itk_demons") + " ";
  const Ran registered = run(demons + at("fixed.nii.gz") + " " + at("moving.nii.gz") +
                             " --warped " + at("warped.mha") + " --field " + at("field.mha"));
  ASSERT_EQ(registered.exit_code, 0) << registered.text;
  EXPECT_THAT(registered.text, HasSubstr("The field is ok"));
  EXPECT_THAT(registered.text, HasSubstr("Difference of the images"));
  const auto warped = files::read_volume(at("warped.mha"));
  ASSERT_TRUE(warped) << warped.error().message;
  const auto found = files::read_field(at("field.mha"));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(same_geometry(found->grid, shell.frames[0].grid));
  const double still = mean_difference(shell.frames[1], shell.frames[0]),
               carried = mean_difference(*warped, shell.frames[0]);
  EXPECT_LT(carried, 0.6 * still);
  // Its table has the same numbers (with three decimals), and ITK's own filters find the motion
  // too.
  auto rows = rows_of(registered.text);
  EXPECT_NEAR(rows["no motion"].mean, still, 0.001);
  EXPECT_NEAR(rows["palpate"].mean, carried, 0.001);
  for (const char* method : kItkMethods) EXPECT_LT(rows[method].mean, 0.6 * still) << method;
  const Ran missing = run(demons + at("fixed.nii.gz") + " " + at("none.mha"));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.text, HasSubstr("none.mha"));

  // The same on a real thorax (MR) with known motion: time and error of palpate and of ITK.
  const std::string thorax = PALPATE_SHARED_DATA "/kit/thoraxmr_bspline/";
  if (std::filesystem::exists(thorax)) {
    const Ran compared = run(demons + thorax + "fixed.mha " + thorax + "moving.mha " + thorax +
                             "truth.mha " + thorax + "mask.mha --field " + at("thorax.mha"));
    ASSERT_EQ(compared.exit_code, 0) << compared.text;
    EXPECT_THAT(compared.text, HasSubstr("Distance to the true field, mm"));
    const auto found_there = files::read_field(at("thorax.mha")),
               truth = files::read_field(thorax + "truth.mha");
    const auto mask = files::read_volume(thorax + "mask.mha");
    ASSERT_TRUE(found_there && truth && mask);
    rows = rows_of(compared.text);
    const Row none = rows["no motion"], ours = rows["palpate"];
    EXPECT_NEAR(none.mean, mean_error_mm(still_field(truth->grid), *truth, *mask), 0.001);
    EXPECT_NEAR(ours.mean, mean_error_mm(*found_there, *truth, *mask), 0.001);
    EXPECT_GT(ours.seconds, 0.0);
    EXPECT_GT(ours.p95, ours.mean);
    for (const char* method : kItkMethods) {
      const Row theirs = rows[method];
      EXPECT_GT(theirs.seconds, 0.0) << method;
      EXPECT_LT(theirs.mean, 0.5 * none.mean) << method << " did not find the motion";
      EXPECT_LT(ours.mean, theirs.mean) << method;
      EXPECT_LT(ours.p95, theirs.p95) << method;
    }
  } else {
    left_out_ += thorax + " is missing. ";
  }

  // A haptic mode in C, loaded by the installed program: the hand presses into its ball.
  const std::string feel = at("prefix/bin/palpate") + " feel " + examples_ + "/my_mode.json";
  const Ran snapped = run(feel + " --modes " + at("build/libmy_mode.so") +
                          " --device simulated --path press --seconds 3 --headset off");
  ASSERT_EQ(snapped.exit_code, 0) << snapped.text;
  std::smatch force;
  ASSERT_TRUE(std::regex_search(snapped.text, force, std::regex("([0-9.]+) N at most")))
      << snapped.text;
  EXPECT_GT(std::stod(force[1]), 0.2);
  const Ran without = run(feel + " --device simulated --seconds 3 --headset off");
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.text, HasSubstr("snap-c"));

  follow_a_real_heart();

  // A volume that moves in a VTK pipeline, if VTK is installed: it must be more similar to the real
  // frames than a still one.
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

  // The cube in the heart: both are visible.
  std::string why_not;
  auto display = VirtualDisplay::start(1280, 800, why_not);
  if (!display) GTEST_SKIP() << left_out_ << "The pictures are not tested: " << why_not;
  const Ran drawn = run(at("build/host_vulkan") + " --frames 2 --screenshot " + at("picture.ppm"));
  ASSERT_EQ(drawn.exit_code, 0) << drawn.text;
  const auto [blue, red] = blue_and_red(at("picture.ppm"));
  EXPECT_GT(blue, 4000);
  EXPECT_GT(red, 10000);
  if (!left_out_.empty()) GTEST_SKIP() << left_out_;
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
