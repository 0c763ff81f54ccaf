// README is correct: every command in a code block of it is listed here and run, or has a reason
// why not. The output that it shows is what the program prints, up to the numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/app/program.h"
#include "tests/files/temporary_folder.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;

/// A command as README shows it, without prompt and comment, on one line; and the lines below it.
struct Shown {
  std::string command;
  std::vector<std::string> output;
};

/// How the test treats a command. Data of the shared folder are in the working folder, under the
/// names that README uses.
struct Way {
  /// The same command, or with synopsis brackets resolved; empty: not run.
  std::string run;
  /// Why it is not run.
  std::string reason;
};

const fs::path kReadme = fs::path(PALPATE_SOURCE) / "README.md";

// In README's order: some commands use the output of earlier ones.
const std::vector<std::pair<std::string, Way>> kWays = {
    {"./run", {"", "installs packages and builds"}},
    {"./run tests", {"", "is what runs this test"}},
    {"build/palpate feel heart --device simulated --picture heart.png",
     {"palpate feel heart --device simulated --picture heart.png --watchdog 1000", ""}},
    {"build/palpate feel heart --device simulated --path docs/examples/tubes.csv --headless felt "
     "--tubes tubes.vtk",
     {"palpate feel heart --device simulated --path " PALPATE_SOURCE
      "/docs/examples/tubes.csv --headless felt --tubes tubes.vtk --watchdog 1000",
      ""}},
    {"build/palpate feel shell --device force-dimension",
     {"", "needs a device: app_devices_test has one made"}},
    {"build/palpate plan heart", {"palpate plan heart", ""}},
    {"build/palpate plan docs/examples/dichloroethane.x3d",
     {"palpate plan " PALPATE_SOURCE "/docs/examples/dichloroethane.x3d", ""}},
    {"build/palpate feel igtl://127.0.0.1:18944 --device simulated --headset off --seconds 30 "
     "--follow",
     {"", "needs a live source: live_test has one"}},
    {"build/palpate info breathing.seq.nrrd", {"palpate info breathing.seq.nrrd", ""}},
    {"build/palpate view breathing.seq.nrrd --cut-open --picture chest.png",
     {"palpate view breathing.seq.nrrd --cut-open --picture chest.png", ""}},
    {"build/palpate feel heart --headset openxr --device simulated",
     {"", "needs Monado: monado_test"}},
    {"build/palpate feel heart --overlay 0", {"", "needs Monado and another program: monado_test"}},
    {"build/palpate calibrate -o room.json --device simulated --tip 0,0,-60",
     {"", "needs a person in a headset: calibrate_test plays one"}},
    {"build/palpate motion breathing.seq.nrrd -o fields --cyclic --pictures",
     {"palpate motion breathing.seq.nrrd -o fields --cyclic --pictures", ""}},
    {"build/palpate motion fixed.mha moving.mha -o u.mha [--preset fast|balanced|best|classic] "
     "[--mask body.mha]",
     {"palpate motion fixed.mha moving.mha -o u.mha --preset fast --mask body.mha", ""}},
    {"integration/cohort/palpate-cohort cohort.csv -o cohort --jobs 2",
     {"", "needs a table of its own: cohort_test.py"}},
    {"build/palpate check fields/motion_1_to_2.mha --truth breathing_truth_1_to_2.mha --mask "
     "breathing_body_1.mha --points breathing_points.csv --frames 1 2",
     {"palpate check fields/motion_1_to_2.mha --truth breathing_truth_1_to_2.mha --mask "
      "breathing_body_1.mha --points breathing_points.csv --frames 1 2",
      ""}},
    {"./run chart", {"", "takes 18 minutes: chart_test runs short ones"}},
    {"build/palpate motion pair_fixed.mha pair_moving.mha -o u.mha --within 2s",
     {"", "needs a chart of this machine: chart_test"}},
    {"build/palpate-lab maps [motion|back-tracking|loop] [--quick] [--out FILE.html] [--csv "
     "FOLDER]",
     {"", "takes minutes: chart_test"}},
    {"./host_loop frame_*.mha --seconds 30",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
    {"cc -std=c99 -O2 -shared -fPIC my_mode.c $(pkg-config --cflags palpate) -lm -o libmy_mode.so",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
    {"examples/itk_demons pair_fixed.mha pair_moving.mha pair_truth.mha pair_body.mha --field "
     "field.mha",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
    {"examples/vtk_volume --cycle 0.6 moved.vti frame_*.mha",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
    {"palpate feel my_mode.json --modes ./libmy_mode.so --device simulated --headless pictures "
     "--seconds 4",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
    {"python3 cine.py frame_*.mha --frames-per-second 33.3 --save motion.nrrd",
     {"", "needs the packages: examples_test, fresh_root.sh"}},
};

std::string trimmed(std::string text) {
  text.erase(0, text.find_first_not_of(" \t"));
  text.erase(text.find_last_not_of(" \t") + 1);
  return text;
}

/// Commands of the blocks without a language: lines after "$ ", and lines that begin as a command
/// does.
std::vector<Shown> shown_commands() {
  std::vector<Shown> found;
  std::istringstream lines(files::read_bytes(kReadme));
  std::string line;
  bool inside = false, plain = false, goes_on = false, prompts = false, has_command = false;
  while (std::getline(lines, line)) {
    if (line.starts_with("```")) {
      inside = !inside;
      plain = inside && trimmed(line) == "```";
      goes_on = prompts = has_command = false;
      continue;
    }
    if (!plain) continue;
    const bool prompt = line.starts_with("$ ");
    const bool bare = !prompts && (line.starts_with("build/") || line.starts_with("./"));
    if (!prompt && !bare && !goes_on) {
      if (has_command) found.back().output.push_back(line);
      continue;
    }
    prompts |= prompt;
    has_command = true;
    std::string part = line.substr(prompt ? 2 : 0, line.find(" #") - (prompt ? 2 : 0));
    part = trimmed(part);
    const bool more = part.ends_with("\\");
    if (more) part = trimmed(part.substr(0, part.size() - 1));
    if (goes_on)
      found.back().command += " " + part;
    else
      found.push_back({part, {}});
    goes_on = more;
  }
  return found;
}

/// Replaces numbers and the width of gaps, which may differ.
std::string shape(const std::string& line) {
  std::string result =
      std::regex_replace(line, std::regex("-?[0-9]+([.,][0-9]+)*(e-?[0-9]+)?"), "#");
  return trimmed(std::regex_replace(result, std::regex("\\s+"), " "));
}

/// Lines that may differ between machines or runs.
bool is_of_the_machine(const std::string& shape) {
  for (const char* start :
       {"Device # ", "Device llvmpipe", "System", "Memory", "#) because", "# because"})
    if (shape.starts_with(start)) return true;
  return shape.empty() || shape == "..." || shape.find("Hz") != std::string::npos;
}

/// The shown lines must be printed in their order; other lines may be between them.
void expect_printed(const Shown& shown, const Outcome& outcome) {
  std::vector<std::string> printed;
  std::istringstream lines(outcome.out + outcome.err);
  for (std::string line; std::getline(lines, line);) printed.push_back(shape(line));
  size_t at = 0;
  for (const std::string& line : shown.output) {
    const std::string wanted = shape(line);
    if (is_of_the_machine(wanted)) continue;
    size_t found = at;
    while (found < printed.size() && printed[found] != wanted) ++found;
    EXPECT_LT(found, printed.size())
        << "README shows for '" << shown.command << "':\n  " << line << "\nprinted was:\n"
        << outcome.out << outcome.err;
    if (found < printed.size()) at = found + 1;
  }
}

class InAFolderOfItsOwn {
 public:
  explicit InAFolderOfItsOwn(const fs::path& folder) : before_(fs::current_path()) {
    fs::current_path(folder);
  }
  ~InAFolderOfItsOwn() { fs::current_path(before_); }

 private:
  fs::path before_;
};

TEST(Readme, EveryCommandOfItsBlocksIsKnownAndStandsThere) {
  std::set<std::string> shown, known;
  for (const Shown& one : shown_commands()) shown.insert(one.command);
  for (const auto& [command, way] : kWays) {
    known.insert(command);
    EXPECT_NE(way.run.empty(), way.reason.empty()) << command;
  }
  for (const std::string& command : shown)
    EXPECT_TRUE(known.contains(command)) << "not listed in this test: " << command;
  for (const std::string& command : known)
    EXPECT_TRUE(shown.contains(command)) << "README does not show it any more: " << command;
}

TEST(Readme, ItsCommandsPrintWhatItShows) {
  NEEDS_DEVICE();
  const fs::path lung = fs::path(PALPATE_SHARED_DATA) / "lung";
  if (!fs::exists(lung)) GTEST_SKIP() << lung << " is missing";
  const TemporaryFolder folder;
  const InAFolderOfItsOwn here(folder / ".");
  for (const auto& entry : fs::directory_iterator(lung))
    fs::create_symlink(fs::absolute(entry.path()), entry.path().filename());
  for (const auto& [name, file] :
       {std::pair("fixed.mha", "pair_fixed.mha"), std::pair("moving.mha", "pair_moving.mha"),
        std::pair("body.mha", "pair_body.mha")})
    fs::create_symlink(fs::absolute(lung / file), name);
  ::setenv("XDG_STATE_HOME", (folder / "state").c_str(), 1);
  std::map<std::string, Shown> shown;
  for (const Shown& one : shown_commands()) shown[one.command] = one;
  for (const auto& [command, way] : kWays) {
    if (way.run.empty()) {
      std::printf("not run: %s (%s)\n", command.c_str(), way.reason.c_str());
      continue;
    }
    std::vector<std::string> words;
    std::istringstream text(way.run);
    for (std::string word; text >> word;) words.push_back(word);
    words.erase(words.begin());  // palpate
    const Outcome outcome = run(words);
    // 3: suspect, which a user would also get.
    EXPECT_EQ(outcome.exit_code, 0) << way.run << "\n" << outcome.out << outcome.err;
    expect_printed(shown[command], outcome);
  }
  ::unsetenv("XDG_STATE_HOME");
}

/// Commands within sentences: `palpate feel ... --option`. They must exist and have these options.
TEST(Readme, CommandsInItsSentencesExistWithTheirOptions) {
  const std::string text = files::read_bytes(kReadme);
  const std::regex span("`(build/)?palpate ([a-z]+)([^`]*)`");
  const std::regex option("(--[a-z][a-z-]*)");
  std::map<std::string, std::string> helps;
  int checked = 0;
  for (std::sregex_iterator found(text.begin(), text.end(), span), last; found != last; ++found) {
    const std::string name = (*found)[2], rest = (*found)[3];
    if (!helps.contains(name)) {
      const Outcome help = run({name, "--help"});
      EXPECT_EQ(help.exit_code, 0) << found->str() << "\n" << help.err;
      helps[name] = help.out;
    }
    for (std::sregex_iterator one(rest.begin(), rest.end(), option); one != last; ++one, ++checked)
      EXPECT_THAT(helps[name], ::testing::HasSubstr((*one)[1].str())) << found->str();
  }
  EXPECT_GT(helps.size(), 5U);
  EXPECT_GT(checked, 3);
}

}  // namespace
}  // namespace palpate::app
