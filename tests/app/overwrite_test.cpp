// No output of any command may be one of its inputs. The test takes the output options from --help,
// so a new one without a row here fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "integration/files/atomic_file.h"
#include "integration/files/raster/write_volume.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;
using ::testing::HasSubstr;

/// A folder with one valid input of each kind.
struct InputFolder {
  InputFolder() {
    const Sequence heart = small_heart();
    written(heart.frames[0], folder / "a.mha");
    written(heart.frames[1], folder / "b.mha");
    EXPECT_TRUE(files::write_sequence(heart, folder / "seq.nrrd"));
    fs::create_directory(folder / "frames");
    written(heart.frames[0], folder / "frames/0.mha");
    written(heart.frames[1], folder / "frames/1.mha");
    files::write_bytes(folder / "scene.json",
                       R"({"volumes": [{"name": "h", "files": ["seq.nrrd"]}]})");
    files::write_bytes(folder / "firmware.bin", "firmware");
    files::write_bytes(folder / "path.csv", "t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,0,0\n");
  }
  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
      all[entry.path()] = entry.is_regular_file() ? files::read_bytes(entry.path()) : "";
    return all;
  }
  std::string at(const std::string& name) const { return folder / name; }

  TemporaryFolder folder;
};

/// "motion --output": every option that --help marks as an output.
std::vector<std::string> all_outputs() {
  std::vector<std::string> outputs;
  for (const auto& command : commands()) {
    std::string name;
    for (const std::string& word : command) name += word + " ";
    std::vector<std::string> arguments = command;
    arguments.push_back("--help");
    std::istringstream lines(run(arguments).out);
    for (std::string line; std::getline(lines, line);) {
      const size_t type = line.find(" OUTPUT");
      const size_t option = line.find("--");
      if (type == std::string::npos || option == std::string::npos || option > type) continue;
      outputs.push_back(name + line.substr(option, type - option));
    }
  }
  return outputs;
}

/// Command lines for each option in which the output (appended) is one of the inputs; empty if the
/// command reads no file.
std::map<std::string, std::vector<std::vector<std::string>>> rows(const InputFolder& in) {
  const std::string a = in.at("a.mha"), b = in.at("b.mha"), seq = in.at("seq.nrrd"),
                    frames = in.at("frames"), scene = in.at("scene.json");
  const auto feel = [&](const std::string& option, bool folder) {
    std::vector<std::vector<std::string>> calls;
    if (folder) {
      calls.push_back({"feel", frames, option, frames});
      calls.push_back({"feel", seq, "--fields", frames, option, frames + "/../frames"});
      return calls;
    }
    calls.push_back({"feel", seq, option, seq});
    calls.push_back({"feel", scene, option, scene});
    // A file that the scene names.
    calls.push_back({"feel", scene, option, seq});
    calls.push_back({"feel", frames, option, frames + "/1.mha"});
    calls.push_back({"feel", seq, "--path", in.at("path.csv"), option, in.at("path.csv")});
    calls.push_back({"feel", seq, "--replay", b, option, b});
    calls.push_back({"feel", seq, "--calibration", b, option, b});
    calls.push_back(
        {"feel", seq, "--falcon-firmware", in.at("firmware.bin"), option, in.at("firmware.bin")});
    return calls;
  };
  std::map<std::string, std::vector<std::vector<std::string>>> all;
  all["motion --output"] = {
      {"motion", a, b, "-o", b},
      // Another spelling of the same path.
      {"motion", a, b, "-o", in.at("frames/../b.mha")},
      {"motion", a, b, "--mask", seq, "-o", seq},
      {"motion", frames, "-o", frames},
      {"motion", frames + "/0.mha", frames + "/1.mha", "-o", frames},
  };
  all["motion --page"] = {{"motion", a, b, "-o", in.at("u.mha"), "--page", b}};
  all["feel --page"] = feel("--page", false);
  all["feel --csv"] = feel("--csv", false);
  all["feel --record"] = feel("--record", false);
  all["feel --picture"] = feel("--picture", false);
  all["feel --tubes"] = feel("--tubes", false);
  all["feel --headless"] = feel("--headless", true);
  all["feel --black-box"] = feel("--black-box", true);
  all["view --picture"] = {{"view", seq, "--picture", seq},
                           {"view", scene, "--picture", seq},
                           {"view", a, b, "--picture", b}};
  all["view --film"] = {{"view", seq, "--film", seq}};
  all["view --headless"] = {{"view", frames, "--headless", frames},
                            {"view", seq, "--fields", frames, "--headless", frames}};
  // Options of palpate-lab, which `palpate chart` starts.
  all["chart --out"] = {{"chart", a, b, "--truth", seq, "--out", b},
                        {"chart", a, b, "--truth", seq, "--out", seq}};
  all["chart --csv"] = {{"chart", a, b, "--truth", seq, "--data", frames, "--csv", frames}};
  all["calibrate --output"] = {
      {"calibrate", "--falcon-firmware", in.at("firmware.bin"), "-o", in.at("firmware.bin")}};
  all["phantom --output"] = {};
  all["phantom --truth"] = {};
  all["phantom --frame-files"] = {};
  all["phantom --dicom"] = {};
  all["demo --output"] = {};
  return all;
}

TEST(AnInput, IsNeverReplacedByAnyOutputOfAnyCommand) {
  const InputFolder in;
  const auto calls = rows(in);
  const auto before = in.contents();
  std::vector<std::string> known;
  for (const auto& [option, _] : calls) known.push_back(option);
  EXPECT_THAT(all_outputs(), ::testing::UnorderedElementsAreArray(known));
  for (const auto& [option, lines] : calls)
    for (const auto& line : lines) {
      const Outcome result = run(line);
      const std::string said = ::testing::PrintToString(line) + "\n" + result.out + result.err;
      EXPECT_EQ(result.exit_code, 2) << said;
      EXPECT_EQ(result.out, "") << said;
      EXPECT_THAT(result.err, ::testing::AnyOf(HasSubstr("would be lost"), HasSubstr("would lie")))
          << said;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << said;
      EXPECT_TRUE(in.contents() == before) << said;
    }
}

TEST(AnInput, IsNotReplacedThroughLinks) {
  const InputFolder in;
  fs::create_symlink(in.at("b.mha"), in.at("soft.mha"));
  fs::create_hard_link(in.at("b.mha"), in.at("hard.mha"));
  const auto before = in.contents();
  for (const char* output : {"soft.mha", "hard.mha"}) {
    const Outcome result = run({"motion", in.at("a.mha"), in.at("b.mha"), "-o", in.at(output)});
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr("is the input '" + in.at("b.mha") + "'"));
  }
  EXPECT_TRUE(in.contents() == before);
}

TEST(AnInput, IsNotReplacedByWhatIsWrittenBesideTheField) {
  const InputFolder in;
  fs::rename(in.at("b.mha"), in.at("u_inverse.mha"));
  const auto before = in.contents();
  const Outcome result =
      run({"motion", in.at("a.mha"), in.at("u_inverse.mha"), "--inverse", "-o", in.at("u.mha")});
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_THAT(result.err, HasSubstr("would be lost"));
  EXPECT_TRUE(in.contents() == before);
}

TEST(AnInput, ThatAHeaderNamesIsNotReplaced) {
  const InputFolder in;
  files::write_bytes(in.at("c.raw"), std::string(8, '\0'));
  files::write_bytes(
      in.at("c.mhd"),
      "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = c.raw\n");
  files::write_bytes(in.at("d01.raw"), std::string(8, '\0'));
  files::write_bytes(in.at("d.nhdr"),
                     "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
                     "data file: d%02d.raw 1 1 1\n");
  const auto before = in.contents();
  for (const auto& [header, data] : {std::pair("c.mhd", "c.raw"), std::pair("d.nhdr", "d01.raw")}) {
    const Outcome result = run({"feel", in.at(header), "--csv", in.at(data)});
    EXPECT_EQ(result.exit_code, 2) << result.out << result.err;
    EXPECT_THAT(result.err, HasSubstr("would be lost"));
  }
  EXPECT_TRUE(in.contents() == before);
}

TEST(AnInput, ThatIsAPipeIsRefusedInsteadOfWaitedFor) {
  const InputFolder in;
  const std::string pipe = in.at("pipe.mha");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::vector<std::string>& line :
       std::vector<std::vector<std::string>>{{"motion", pipe, in.at("b.mha"), "-o", in.at("u.mha")},
                                             {"motion", pipe, "-o", in.at("fields")},
                                             {"feel", pipe},
                                             {"check", pipe}}) {
    const Outcome result = run(line);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("is a pipe or a device"));
  }
}

TEST(AnOutput, IsNotTwoThings) {
  const InputFolder in;
  const Outcome result =
      run({"feel", in.at("seq.nrrd"), "--csv", in.at("x"), "--record", in.at("frames/../x")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is named for two outputs"));
  EXPECT_FALSE(fs::exists(in.at("x")));
}

TEST(AnOutput, IsNotStandardOutput) {
  const InputFolder in;
  const Outcome result = run({"motion", in.at("a.mha"), in.at("b.mha"), "-o", "-"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("standard output"));
}

TEST(AnOutput, ThatIsALinkStaysOneAndItsTargetIsReplaced) {
  NEEDS_DEVICE();
  const InputFolder in;
  fs::create_directory(in.at("kept"));
  // Points to a file that does not exist yet.
  fs::create_symlink("kept/field.mha", in.at("u.mha"));
  files::write_bytes(in.at("kept/u.png"), "an older picture");
  fs::create_symlink("kept/u.png", in.at("u.png"));
  const Outcome result = run({"motion", in.at("a.mha"), in.at("b.mha"), "-o", in.at("u.mha"),
                              "--pictures", "--no-verdict"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::is_symlink(in.at("u.mha")));
  EXPECT_TRUE(fs::is_symlink(in.at("u.png")));
  EXPECT_GT(fs::file_size(in.at("kept/field.mha")), 1000U);
  EXPECT_EQ(files::read_bytes(in.at("kept/u.png")).substr(1, 3), "PNG");
}

TEST(AnOutput, OfAProcessThatWasKilledIsRemovedByTheNext) {
  NEEDS_DEVICE();
  const InputFolder in;
  const fs::path fields = in.at("fields");
  fs::create_directory(fields);
  Program killed({"motion", in.at("seq.nrrd"), "-o", fields});
  const auto left = [&] {
    size_t count = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(fields)) ++count;
    return count;
  };
  // Waits for the staging folder, not for the file that tests whether the folder can be written.
  const auto is_staging = [&] {
    for (const auto& entry : fs::directory_iterator(fields))
      if (entry.is_directory()) return true;
    return false;
  };
  while (!is_staging() && !killed.ended())
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  killed.signal(SIGKILL);
  killed.wait();
  ASSERT_EQ(left(), 1U) << "the hidden folder of the killed process";
  // A staging folder whose process runs must stay; a lock marks it.
  const fs::path living = fields / ".palpate-living";
  fs::create_directory(living);
  const int fd = ::open(living.c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_TRUE(files::lock_as_alive(fd));
  const auto pair = [&] {
    return run({"motion", in.at("a.mha"), in.at("b.mha"), "-o", (fields / "pair.mha").string(),
                "--no-verdict"});
  };
  EXPECT_EQ(pair().exit_code, 0);
  EXPECT_EQ(left(), 2U) << "the field and the folder of the running process";
  EXPECT_TRUE(fs::exists(living));
  ::close(fd);
  EXPECT_EQ(pair().exit_code, 0);
  EXPECT_FALSE(fs::exists(living));
}

}  // namespace
}  // namespace palpate::app
