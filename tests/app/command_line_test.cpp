// Wrong command lines, and the answer of the program: one sentence that says what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <thread>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string text_of(const std::vector<std::string>& arguments) {
  std::string text = "palpate";
  for (const std::string& argument : arguments) text += " " + argument;
  return text;
}

/// The line on stderr of a command that is refused before any work.
std::string refusal(const std::vector<std::string>& arguments) {
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 2) << text_of(arguments) << "\n" << outcome.out << outcome.err;
  EXPECT_EQ(outcome.out, "") << text_of(arguments);
  EXPECT_THAT(outcome.err, AllOf(StartsWith("palpate: "), EndsWith(".\n"))) << text_of(arguments);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  return outcome.err;
}

TEST(CommandLine, NamesTheCommandThatWasMeant) {
  EXPECT_THAT(refusal({"motoin"}),
              HasSubstr("There is no command 'motoin': did you mean 'motion'?"));
  EXPECT_THAT(refusal({"fele", "heart"}), HasSubstr("did you mean 'feel'?"));
  EXPECT_THAT(refusal({"motoin", "a.mha", "b.mha", "-o", "u.mha"}),
              HasSubstr("did you mean 'motion'?"));
  EXPECT_THAT(refusal({"knead"}),
              AllOf(HasSubstr("There is no command 'knead'"), HasSubstr("motion"),
                    HasSubstr("feel"), Not(HasSubstr("write-manual"))));
  EXPECT_THAT(refusal({}), AllOf(HasSubstr("A command is missing"), HasSubstr("feel")));
}

TEST(CommandLine, NamesTheOptionThatWasMeant) {
  EXPECT_THAT(refusal({"motion", "a.mha", "b.mha", "-o", "u.mha", "--perset", "fast"}),
              HasSubstr("'palpate motion' has no option '--perset': did you mean '--preset'?"));
  EXPECT_THAT(refusal({"feel", "heart", "--frictoin=0.2"}), HasSubstr("'--friction'"));
  // Reported before a missing argument: the misspelt option may have been meant as that argument.
  EXPECT_THAT(refusal({"motion", "a.mha", "b.mha", "--ouptut", "u.mha"}),
              HasSubstr("did you mean '--output'?"));
  EXPECT_THAT(refusal({"check", "u.mha", "--something-else"}),
              AllOf(HasSubstr("'palpate check' has no option '--something-else'."),
                    HasSubstr("See 'palpate check --help'.")));
}

TEST(CommandLine, NamesTheCommandThatHasTheOption) {
  EXPECT_THAT(refusal({"motion", "a.mha", "b.mha", "-o", "u.mha", "--headset", "auto"}),
              HasSubstr("'palpate motion' has no option '--headset': 'palpate feel' and 'palpate "
                        "view' have it."));
  EXPECT_THAT(refusal({"feel", "heart", "--truth", "t.mha"}), HasSubstr("'palpate check'"));
  EXPECT_THAT(refusal({"--csv", "x.csv"}), HasSubstr("'palpate feel'"));
  EXPECT_THAT(refusal({"--csv", "x.csv", "feel", "heart"}), HasSubstr("'palpate feel'"));
}

TEST(CommandLine, SaysWhichWordIsTooMany) {
  EXPECT_THAT(refusal({"devices", "all"}),
              HasSubstr("'palpate devices' does not know what to do with 'all': leave it out."));
}

TEST(CommandLine, SaysWhatIsMissingAndWhatThatIs) {
  EXPECT_THAT(refusal({"feel"}),
              HasSubstr("'palpate feel' needs input: heart, shell, molecule, a scene"));
  EXPECT_THAT(refusal({"motion", "a.mha", "b.mha"}),
              HasSubstr("'palpate motion' needs --output: Pair: the field"));
  EXPECT_THAT(refusal({"motion", "a.mha", "b.mha", "-o"}),
              HasSubstr("--output takes a value: Pair"));
  EXPECT_THAT(refusal({"check", "u.mha", "--landmarks", "a.csv"}),
              HasSubstr("--landmarks takes 2 values: Points"));
  EXPECT_THAT(refusal({"motion", "a", "b", "-o", "u", "--within", "2s", "--preset", "fast"}),
              AllOf(HasSubstr("can not be used together with"), HasSubstr("--within"),
                    HasSubstr("--preset")));
}

TEST(CommandLine, HelpExplainsCommandsAndFindsOptions) {
  EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
  for (const char* command : {"motion", "feel", "info"}) {
    const Outcome help = run({"help", command});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_EQ(help.out, run({command, "--help"}).out);
  }
  const Outcome option = run({"help", "--csv"});
  EXPECT_EQ(option.exit_code, 0);
  EXPECT_THAT(option.out, AllOf(HasSubstr("palpate feel\n"), HasSubstr("Write every"),
                                Not(HasSubstr("palpate motion\n"))));
  EXPECT_EQ(run({"help", "csv"}).out, option.out);
  EXPECT_THAT(refusal({"help", "mtoion"}), HasSubstr("did you mean 'motion'"));
  EXPECT_THAT(refusal({"help", "--nowhere"}), HasSubstr("'--nowhere'"));
}

TEST(CommandLine, TheHelpOfEveryCommandIsOfOneMind) {
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"motion"}, {"demo"}, {"chart"}, {"chart", "stability"}}) {
    std::vector<std::string> arguments = command;
    arguments.push_back("--help");
    const Outcome help = run(arguments);
    EXPECT_THAT(help.out, AllOf(HasSubstr("--gpu NAME"), Not(HasSubstr("--device"))));
  }
  EXPECT_THAT(run({"feel", "--help"}).out,
              AllOf(HasSubstr("--gpu NAME"), HasSubstr("Force device")));
}

TEST(CommandLine, TheOldNameOfTheVulkanDeviceGoesOnWorkingWithAHint) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const auto motion = [&](const char* option, const char* device) {
    return run({"motion", heart, "-o", folder / "out", "--preset", "fast", option, device});
  };
  const Outcome now = motion("--gpu", "0"), before = motion("--device", "0");
  EXPECT_NE(now.exit_code, 2) << now.err;
  EXPECT_EQ(now.err, "");
  EXPECT_EQ(before.exit_code, now.exit_code) << before.err;
  EXPECT_THAT(before.err, HasSubstr("named with --gpu"));
  // A user who means the Vulkan device, where --device is the force device.
  EXPECT_THAT(refusal({"feel", "heart", "--device", "llvmpipe"}),
              AllOf(HasSubstr("'llvmpipe'"), HasSubstr("simulated"), HasSubstr("--gpu")));
}

TEST(CommandLine, VerboseSaysMoreOfTheDevice) {
  NEEDS_DEVICE();
  const TemporaryFolder folder;
  const std::string heart = written(small_heart(2), folder / "heart.seq.nrrd");
  const Outcome behind =
      run({"motion", heart, "-o", folder / "out", "--preset", "fast", "--verbose"});
  EXPECT_THAT(behind.err, AllOf(HasSubstr("Vulkan "), HasSubstr("driver "), HasSubstr("memory")));
  const Outcome before =
      run({"--verbose", "motion", heart, "-o", folder / "out", "--preset", "fast"});
  EXPECT_THAT(before.err, HasSubstr("driver "));
}

/// The first group of the first match of a pattern in a file of the source tree.
std::string found_in(const std::string& file, const std::string& pattern) {
  const std::string text = files::read_bytes(std::string(PALPATE_SOURCE_DIR) + "/" + file);
  std::smatch found;
  EXPECT_TRUE(std::regex_search(text, found, std::regex(pattern))) << pattern << " in " << file;
  return found.size() > 1 ? found[1].str() : "";
}

TEST(CommandLine, TheVersionIsThatOfTheBuildTheHeaderAndTheChangelog) {
  const std::string version =
      found_in("CMakeLists.txt", "project\\(palpate VERSION ([0-9]+\\.[0-9]+\\.[0-9]+)");
  EXPECT_EQ(run({"--version"}).out, "palpate " + version + "\n");
  std::string header;
  for (const char* part : {"MAJOR", "MINOR", "PATCH"})
    header += (header.empty() ? "" : ".") +
              found_in("integration/toolkit/palpate.h",
                       std::string("#define PAL_VERSION_") + part + " ([0-9]+)");
  EXPECT_EQ(header, version);
  // Above it may stand what is not released yet.
  EXPECT_EQ(found_in("CHANGELOG.md", "\n## ([0-9]+\\.[0-9]+\\.[0-9]+)"), version);
}

TEST(CommandLine, TheVersionWithVerboseSaysWhichCommitBuildAndDriver) {
  const Outcome long_version = run({"--version", "--verbose"});
  EXPECT_EQ(long_version.exit_code, 0);
  EXPECT_THAT(long_version.out, StartsWith(run({"--version"}).out));
  EXPECT_EQ(run({"--verbose", "-V"}).out, long_version.out);
  const auto line = [&](const std::string& name) {
    std::smatch found;
    const bool has = std::regex_search(long_version.out, found, std::regex(name + " +(.*)\n"));
    return has ? found[1].str() : "";
  };
  // A commit, a tag and the commits since, or neither where the source is no checkout.
  EXPECT_TRUE(
      std::regex_match(line("Commit"), std::regex("unknown|([^ ]+-g)?[0-9a-f]{7,40}(-dirty)?")))
      << long_version.out;
  EXPECT_TRUE(std::regex_match(line("Build"), std::regex("[A-Za-z]*, [A-Za-z]+ [0-9.]+.*")))
      << long_version.out;
  if (!has_device()) {
    EXPECT_THAT(line("Device"), StartsWith("none: "));
    return;
  }
  for (const auto& device : run({"devices", "--json"}).json()["vulkan"])
    if (device["default"].get<bool>()) {
      EXPECT_THAT(line("Device"), StartsWith(device["name"].get<std::string>()));
      EXPECT_EQ(line("Driver"), device["driver"].get<std::string>() + ", Vulkan " +
                                    device["vulkan"].get<std::string>());
    }
}

/// A command that is valid but for the value of one option.
struct Nonsense {
  std::vector<std::string> command;
  std::string option;
  std::vector<std::string> values;
  std::string range;
};

TEST(CommandLine, EveryNumberHasARangeAndTheSentenceSaysIt) {
  const std::vector<std::string> feel = {"feel", "heart"};
  const std::vector<std::string> view = {"view", "heart"};
  const std::vector<std::string> motion = {"motion", "a.mha", "b.mha", "-o", "u.mha"};
  const std::vector<std::string> phantom = {"phantom", "heart", "-o", "h.seq.nrrd"};
  const std::vector<std::string> calibrate = {"calibrate", "-o", "room.json"};
  const std::vector<Nonsense> all = {
      {feel, "--fps", {"-3", "0", "nan", "inf", "1e9", "ten", "3fps"}, "from 0.001 to 100000"},
      {feel, "--strength", {"-1", "0", "1e9", "nan"}, "from 0.01 to 1000"},
      {feel, "--friction", {"-1", "11", "nan"}, "from 0 to 10"},
      {feel, "--width", {"0", "-1", "nan", "inf"}, "a number above 0"},
      {feel, "--look-level", {"nan", "inf", "1e13"}, "from -1000000000 to 1000000000"},
      {feel, "--look-width", {"0", "-1", "nan", "inf"}, "a number above 0"},
      {feel, "--tool-radius", {"-1", "nan", "1e9"}, "from 0 to"},
      {feel, "--tool-points", {"0", "6", "2.5", "nan"}, "from 1 to 5"},
      {feel, "--iso-value", {"nan", "inf", "high"}, "a number is expected"},
      {feel, "--max-force", {"0", "-1", "1e9", "nan"}, "from 0.01 to 100"},
      {feel, "--stiffness", {"0", "-1", "1e9", "nan"}, "from 1 to 100000"},
      {feel, "--lets-go", {"-1", "nan"}, "from 0 to 1000000"},
      {feel, "--seconds", {"0", "-1", "nan"}, "from 0.1 to 1000000"},
      {feel, "--watchdog", {"0", "-1", "nan"}, "from 1 to 1000"},
      {feel, "--scale", {"0", "-1", "nan", "fitting"}, "'fit' or a number from 0.0001 to 10000"},
      {feel, "--picture-size", {"0", "-1", "1e9", "100.5"}, "from 64 to 2048"},
      {feel, "--refresh-rate", {"0", "-90", "nan", "1e9", "fast"}, "from 30 to 500 Hz"},
      {feel, "--azimuth", {"-361", "nan", "left"}, "from -360 to 360"},
      {feel, "--elevation", {"-90", "90", "nan"}, "from -85 to 85"},
      {feel, "--zoom", {"0", "-1", "nan", "21"}, "from 0.1 to 20"},
      {feel, "--shadows", {"-0.1", "1.1", "nan"}, "from 0 to 1"},
      {view, "--turn", {"nan", "inf", "1e9"}, "from -3600 to 3600"},
      {view, "--average", {"0", "-1", "1.5", "65"}, "from 1 to 64"},
      {feel, "--core", {"9999", "-1", "one"}, "cores for palpate: give one of 0"},
      {motion, "--iterations", {"0", "-1", "1.5"}, "from 1 to 10000"},
      {motion, "--levels", {"0", "-1", "13"}, "from 1 to 12"},
      {motion, "--memory-cap", {"0", "-1", "nan"}, "from 0.01 to 1000000000"},
      {motion, "--within", {"0", "-1s", "nan", "soon"}, "above zero"},
      {motion, "--error", {"0", "-1mm", "nan", "little"}, "above zero"},
      {phantom, "--size", {"0", "-1", "1e9"}, "from 16 to 1024"},
      {phantom, "--frames", {"0", "1", "-1"}, "from 2 to 1000"},
      {phantom, "--seed", {"-1", "99999999999", "x"}, "from 0 to 4294967295"},
      {phantom, "--noise", {"-0.1", "1.1", "nan"}, "from 0 to 1"},
      {phantom, "--shift", {"-1000", "nan"}, "from -341 to 341"},
      {{"demo", "-o", "d"}, "--size", {"0", "31", "513"}, "from 32 to 512"},
      {{"demo", "-o", "d"}, "--frames", {"0", "2", "10"}, "from 3 to 9"},
      {calibrate, "--points", {"0", "4", "201"}, "from 5 to 200"},
      {calibrate, "--seconds", {"0", "nan", "601"}, "from 5 to 600"},
      {calibrate, "--tip", {"0,0", "1e9,0,0", "nan,0,0", "x"}, "from -1000 to 1000"},
      {calibrate, "--wait", {"-1", "nan"}, "from 0 to 1000000"},
  };
  for (const Nonsense& one : all) {
    for (const std::string& value : one.values) {
      std::vector<std::string> arguments = one.command;
      arguments.push_back(one.option + "=" + value);
      EXPECT_THAT(refusal(arguments), HasSubstr(one.range)) << text_of(arguments);
    }
  }
}

TEST(CommandLine, FramesOfPointsHaveARangeToo) {
  EXPECT_THAT(refusal({"check", "u.mha", "--points", "p.csv", "--frames", "0", "-1"}),
              HasSubstr("from 0 to 1000000"));
}

/// The test above has a row for each number: a new option needs a range and a row there.
TEST(CommandLine, NoNumberIsWithoutARange) {
  const auto all = commands();
  EXPECT_GE(all.size(), 12U);
  for (const std::vector<std::string>& command : all) {
    std::vector<std::string> arguments = command;
    arguments.push_back("--help");
    std::istringstream lines(run(arguments).out);
    for (std::string line; std::getline(lines, line);) {
      const bool number = line.find(" INT") != std::string::npos ||
                          line.find(" UINT") != std::string::npos ||
                          line.find(" FLOAT") != std::string::npos;
      // Options without a short name stand further right since CLI11 2.5.
      const size_t first = line.find_first_not_of(' ');
      if (!number || first < 2 || line[first] != '-') continue;
      EXPECT_THAT(line, AnyOf(HasSubstr(":from "), HasSubstr(":above "), HasSubstr("--iso-value"),
                              HasSubstr("--core")))
          << text_of(command);
    }
  }
}

TEST(CommandLine, WordsThatAreNotOfferedNameTheNearest) {
  EXPECT_THAT(refusal({"feel", "heart", "--headset", "opnexr"}),
              AllOf(HasSubstr("did you mean 'openxr'?"), HasSubstr("auto, openxr, none, off")));
  EXPECT_THAT(refusal({"feel", "heart", "--look", "CT bnoe"}),
              HasSubstr("did you mean 'CT bone'?"));
  for (const char* command : {"motion", "feel", "demo"})
    EXPECT_THAT(refusal({command, "x", "-o", "y", "--preset", "blanced"}),
                AnyOf(HasSubstr("did you mean 'balanced'?"), HasSubstr("has no option '-o'"),
                      HasSubstr("does not know what to do with 'x'")));
  EXPECT_THAT(refusal({"feel", "heart", "--preset", "blanced"}),
              HasSubstr("did you mean 'balanced'?"));
}

TEST(Feel, RefusesDataInWhichNothingCanBeFelt) {
  const TemporaryFolder folder;
  Volume constant = small_heart(1).frames[0];
  std::fill(constant.values.begin(), constant.values.end(), 7.0F);
  written(constant, folder / "constant.mha");
  written(still_field(constant.grid), folder / "still.mha");
  std::ofstream(folder / "scene.json") << R"({"volumes": [{"name": "a", "files": "constant.mha"}],
                                              "modes": [{"strength": 2}]})";
  EXPECT_THAT(refusal({"feel", folder / "constant.mha", "--headset", "off"}),
              HasSubstr("holds the value 7 everywhere: there is nothing to feel"));
  EXPECT_THAT(refusal({"plan", folder / "constant.mha"}), HasSubstr("nothing to feel"));
  EXPECT_THAT(refusal({"plan", folder / "scene.json"}), HasSubstr("nothing to feel"));
  EXPECT_THAT(refusal({"plan", folder / "still.mha"}), HasSubstr("nothing to feel"));
  const std::string heart = written(small_heart(1).frames[0], folder / "heart.mha");
  EXPECT_THAT(refusal({"feel", heart, "--headset", "off", "--level", "99999"}),
              AllOf(HasSubstr("has values from"), HasSubstr("at the iso-value 99999")));
}

TEST(Feel, RefusesColourPicturesAsFlows) {
  const TemporaryFolder folder;
  for (const int components : {3, 4}) {
    const std::string file = folder / ("colours" + std::to_string(components) + ".mha");
    std::string bytes =
        "ObjectType = Image\nNDims = 3\nDimSize = 8 8 8\nElementSpacing = 1 1 1\n"
        "ElementNumberOfChannels = " +
        std::to_string(components) + "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    for (int n = 0; n < 512 * components; ++n) bytes += char(n % 97);
    files::write_bytes(file, bytes);
    EXPECT_THAT(refusal({"feel", file, "--headset", "off"}), HasSubstr("is a colour picture"));
    EXPECT_THAT(refusal({"check", file}), HasSubstr("colour"));
    EXPECT_THAT(refusal({"motion", file, file, "-o", folder / "u.mha"}), HasSubstr("colour"));
  }
}

TEST(Feel, MakesTheFolderOfTheBlackBox) {
  const TemporaryFolder folder;
  const std::filesystem::path box = folder / "new/box";
  Program program({"feel", "molecule", "--device", "simulated", "--seconds", "600", "--headset",
                   "off", "--watchdog", "1000", "--black-box", box.string()});
  ASSERT_TRUE(program.wait_for(" Hz ")) << program.wait().err;
  // Stopped for longer than the watchdog waits: this is a fault that writes a file.
  program.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  program.signal(SIGCONT);
  std::error_code error;
  for (int n = 0; n < 6000 && !program.ended(); ++n) {
    if (std::filesystem::is_directory(box, error) && !std::filesystem::is_empty(box, error)) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  program.signal(SIGINT);
  EXPECT_EQ(program.wait().exit_code, 0);
  EXPECT_FALSE(std::filesystem::is_empty(box, error));
  // If the folder can not be made, the program reports it before the scene is felt.
  files::write_bytes(folder / "file", "not a folder");
  const Outcome refused = run({"feel", "molecule", "--device", "simulated", "--headset", "off",
                               "--black-box", folder / "file/box"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("file"));
}

}  // namespace
}  // namespace palpate::app
