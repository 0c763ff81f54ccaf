// README and the pages for users are correct: every command in a code block of them is listed here
// and run, or has a reason why not. The output that they show is what the program prints, up to the
// numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <regex>
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

/// How the test treats a command. It runs them as README shows them, one after the other in an
/// empty folder, as a newcomer who pastes them does.
struct Way {
  /// What is added, so that a busy machine does not matter.
  std::string more;
  /// Why it is not run; empty: it is run.
  std::string reason;
};

/// In the order in which a newcomer reads them: later pages use what the commands of earlier ones
/// made.
constexpr const char* kPages[] = {"README.md",
                                  "docs/using/feel.md",
                                  "docs/using/look.md",
                                  "docs/using/headset.md",
                                  "docs/using/motion.md",
                                  "docs/using/cohort.md",
                                  "docs/using/check.md",
                                  "docs/using/library.md",
                                  "docs/using/hosts.md",
                                  "docs/using/measure.md",
                                  "docs/using/install.md"};

/// All pages, one after the other.
std::string all_pages() {
  std::string text;
  for (const char* const page : kPages) text += files::read_bytes(fs::path(PALPATE_SOURCE) / page);
  return text;
}

constexpr const char* kInstalls = "installs: fresh_root.sh, manual_test and the tests of packages";
constexpr const char* kOfPackages = "needs the packages: examples_test, fresh_root.sh";

// In the order of the pages: most commands use the output of earlier ones.
const std::vector<std::pair<std::string, Way>> kWays = {
    {"./run", {"", "installs packages and builds"}},
    {"./run tests", {"", "is what runs this test"}},
    {"build/palpate phantom heart --size 64 -o heart.seq.nrrd --frame-files frames --dicom series "
     "--truth truth",
     {}},
    {"build/palpate info heart.seq.nrrd", {}},
    {"build/palpate feel heart.seq.nrrd --device simulated --picture felt.png",
     {"--watchdog 1000", ""}},
    {"build/palpate motion heart.seq.nrrd -o found --cyclic", {}},
    {"build/palpate check found --sequence heart.seq.nrrd", {}},
    {"build/palpate view heart.seq.nrrd --fields found --picture moved.png", {}},
    {"build/palpate feel heart --headset openxr --device simulated",
     {"", "needs Monado: monado_test"}},
    // Feeling, looking, the headset.
    {"build/palpate feel heart --device simulated --picture heart.png",
     {"--watchdog 1000 --seconds 3", ""}},
    {"build/palpate plan heart", {}},
    {"build/palpate plan docs/examples/dichloroethane.x3d", {}},
    {"build/palpate feel heart --device simulated --path docs/examples/tubes.csv --headless felt "
     "--tubes tubes.vtk",
     {"--watchdog 1000", ""}},
    {"build/palpate feel shell --device force-dimension",
     {"", "needs a device: app_devices_test has one made"}},
    {"build/palpate serve heart --port 18944 --quiet --seconds 60 &",
     {"", "takes a port that may be in use: live_test"}},
    {"build/palpate feel igtl://127.0.0.1:18944 --image palpate_volume --device simulated "
     "--headset off --seconds 15 --follow",
     {"", "needs the server before: live_test has one"}},
    {"build/palpate view heart.seq.nrrd --cut-open --picture cut.png", {}},
    {"build/palpate feel heart --headset openxr --device simulated",
     {"", "needs Monado: monado_test"}},
    {"build/palpate feel heart --overlay 0", {"", "needs Monado and another program: monado_test"}},
    {"build/palpate calibrate -o room.json --device simulated --tip 0,0,-60",
     {"", "needs a person in a headset: calibrate_test plays one"}},
    // Motion, cohorts, checking.
    {"build/palpate motion heart.seq.nrrd -o fields --cyclic --pictures", {}},
    {"build/palpate motion frames/frame_0.mha frames/frame_1.mha -o u.mha --preset best", {}},
    {"printf 'name,sequence,cyclic\\nheart,heart.seq.nrrd,yes\\n"
     "pair,frames/frame_0.mha;frames/frame_1.mha,\\nbad,heart.png,\\n' > cohort.csv",
     {}},
    {"integration/cohort/palpate-cohort cohort.csv -o cohort --jobs 2",
     {"", "needs Snakemake, and half a minute: cohort_test.py"}},
    {"build/palpate check fields/motion_1_to_2.mha --truth truth/truth_1_to_2.mha --mask "
     "truth/wall_1.mha",
     {}},
    {"build/palpate info heart.seq.nrrd", {}},
    // Other programs.
    {"cmake --install build --component palpate_library && cmake --install build --component "
     "palpate_development",
     {"", kInstalls}},
    {"(cd build && cpack) && sudo apt install ./build/libpalpate0_*.deb "
     "./build/libpalpate-dev_*.deb",
     {"", kInstalls}},
    {"cmake -S /usr/share/doc/libpalpate-dev/examples -B examples && cmake --build examples",
     {"", kOfPackages}},
    {"examples/host_loop frames/frame_*.mha --seconds 30", {"", kOfPackages}},
    {"PYTHONPATH=build/python python3 docs/examples/cine.py frames/frame_*.mha "
     "--frames-per-second 8 --save motion.nrrd",
     {"", "needs numpy: examples_test"}},
    {"cc -std=c99 -O2 -shared -fPIC docs/examples/my_mode.c $(pkg-config --cflags palpate) -lm -o "
     "libmy_mode.so",
     {"", kOfPackages}},
    {"build/palpate feel docs/examples/my_mode.json --modes ./libmy_mode.so --device simulated "
     "--headless pictures --seconds 4",
     {"", kOfPackages}},
    {"v/bin/pip install palpate-*.whl && v/bin/palpate view pair_fixed.mha --picture first.png",
     {"", "needs a wheel: wheel_test.py makes one, wheel_roots.sh installs it"}},
    {"examples/itk_demons frames/frame_0.mha frames/frame_1.mha truth/truth_0_to_1.mha "
     "truth/wall_0.mha --field field.mha",
     {"", kOfPackages}},
    {"examples/vtk_volume --cycle 0.6 moved.vti frames/frame_*.mha", {"", kOfPackages}},
    {"cmake -S /usr/share/palpate/godot -B build && cmake --build build && cmake --install build "
     "--prefix MY_PROJECT",
     {"", "needs Godot: godot_test.py"}},
    // Measuring, installing.
    {"./run chart", {"", "takes 18 minutes: chart_test runs short ones"}},
    {"build/palpate motion frames/frame_0.mha frames/frame_1.mha -o u.mha --within 2s",
     {"", "needs a chart of this machine: chart_test"}},
    {"build/palpate-lab maps loop --quick --out maps.html", {"", "takes minutes: chart_test"}},
    {"./run", {"", "installs packages and builds"}},
    {"./run tests", {"", "is what runs this test"}},
    {"cmake --install build --prefix ~/.local --component palpate_program", {"", kInstalls}},
    {"cmake -DBUILD=build -P cmake/uninstall.cmake", {"", kInstalls}},
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
  std::istringstream lines(all_pages());
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
    const auto begins = [&](const char* with) { return line.starts_with(with); };
    const bool bare =
        !prompts && (begins("build/") || begins("./") || begins("cmake ") || begins("(cd "));
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
        << "The pages show for '" << shown.command << "':\n  " << line << "\nprinted was:\n"
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

TEST(Readme, EveryCommandOfItsBlocksIsKnownAndStandsThereInThisOrder) {
  std::vector<std::string> shown, known;
  for (const Shown& one : shown_commands()) shown.push_back(one.command);
  for (const auto& [command, way] : kWays) known.push_back(command);
  EXPECT_THAT(shown, ::testing::ElementsAreArray(known));
}

/// The shell's exit code, and what was printed.
Outcome pasted(const std::string& command, const fs::path& folder) {
  const std::string out = folder / "pasted_out", err = folder / "pasted_err";
  const int status = std::system(("{ " + command + "\n} >" + out + " 2>" + err).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, files::read_bytes(out),
          files::read_bytes(err)};
}

TEST(Readme, ItsCommandsWorkInAnEmptyFolderAndPrintWhatItShows) {
  NEEDS_DEVICE();
  const TemporaryFolder folder, outputs;
  const InAFolderOfItsOwn here(folder / ".");
  // As in the source folder, after ./run.
  fs::create_directory("build");
  fs::create_symlink(PALPATE_PROGRAM, "build/palpate");
  fs::create_directory_symlink(fs::path(PALPATE_SOURCE) / "docs", "docs");
  ::setenv("XDG_STATE_HOME", (folder / "state").c_str(), 1);
  for (const Shown& shown : shown_commands()) {
    const auto found = std::find_if(kWays.begin(), kWays.end(), [&](const auto& known) {
      return known.first == shown.command;
    });
    if (found == kWays.end()) continue;  // the test above says so
    const Way& way = found->second;
    if (!way.reason.empty()) {
      std::printf("not run: %s (%s)\n", shown.command.c_str(), way.reason.c_str());
      continue;
    }
    const Outcome outcome = pasted(shown.command + " " + way.more, outputs.path());
    EXPECT_EQ(outcome.exit_code, 0) << shown.command << "\n" << outcome.out << outcome.err;
    expect_printed(shown, outcome);
  }
  ::unsetenv("XDG_STATE_HOME");
}

/// Commands within sentences: `palpate feel ... --option`. They must exist and have these options.
TEST(Readme, CommandsInItsSentencesExistWithTheirOptions) {
  const std::string text = all_pages();
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
