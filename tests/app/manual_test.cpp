// The files that are installed beside the program: manual pages and completions, read by the tools
// that use them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <set>
#include <sstream>

#include "tests/app/program.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

struct ShellOutcome {
  int exit_code = -1;
  std::string text;  ///< stdout and stderr
};

ShellOutcome shell(const std::string& command) {
  ShellOutcome outcome;
  std::FILE* pipe = ::popen(("( " + command + " ) 2>&1").c_str(), "r");
  if (!pipe) return outcome;
  std::array<char, 4096> bytes{};
  while (const size_t n = std::fread(bytes.data(), 1, bytes.size(), pipe))
    outcome.text.append(bytes.data(), n);
  const int status = ::pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

bool has(const std::string& program) {
  return shell("command -v " + program).exit_code == 0;
}

/// "palpate", "palpate-motion", "palpate-chart-stability", ...
std::vector<std::string> pages() {
  std::vector<std::string> names = {"palpate"};
  for (const std::vector<std::string>& command : commands()) {
    names.push_back("palpate");
    for (const std::string& word : command) names.back() += "-" + word;
  }
  return names;
}

class Manual : public ::testing::Test {
 protected:
  void SetUp() override {
    const Outcome written = run({"write-manual", folder.path().string()});
    ASSERT_EQ(written.exit_code, 0) << written.err;
  }
  std::string at(const std::string& name) const { return (folder / name).string(); }
  std::string page(const std::string& name) const { return at("man1/" + name + ".1"); }

  TemporaryFolder folder;
};

TEST_F(Manual, HasAPageForEveryCommandAndNoOther) {
  std::set<std::string> expected, found;
  for (const std::string& name : pages()) expected.insert(name + ".1");
  for (const auto& entry : fs::directory_iterator(folder / "man1"))
    found.insert(entry.path().filename().string());
  EXPECT_EQ(found, expected);
}

TEST_F(Manual, IsReadWithoutAWarning) {
  if (!has("groff")) GTEST_SKIP() << "There is no groff here.";
  for (const std::string& name : pages()) {
    // -ww: all warnings.
    const ShellOutcome groff = shell("groff -man -Tutf8 -ww -z '" + page(name) + "'");
    EXPECT_EQ(groff.exit_code, 0) << name;
    EXPECT_THAT(groff.text, IsEmpty()) << name;
    if (!has("man")) continue;
    const ShellOutcome man =
        shell("LC_ALL=C.UTF-8 MANROFFSEQ= MANWIDTH=80 man --warnings -E UTF-8 -l '" + page(name) +
              "' >/dev/null");
    EXPECT_THAT(man.text, IsEmpty()) << name;
  }
}

TEST_F(Manual, SaysWhatHelpSays) {
  if (!has("groff")) GTEST_SKIP() << "There is no groff here.";
  const auto text = [&](const std::string& name) {
    // Without line breaks, hyphenation and bold type.
    const std::string raw =
        shell("groff -man -Tascii -P-c -P-b -P-u -rLL=400n -rHY=0 '" + page(name) + "'").text;
    std::string flat;
    for (const char c : raw)
      if (!(c == ' ' || c == '\n') || flat.empty() || flat.back() != ' ')
        flat += c == '\n' ? ' ' : c;
    return flat;
  };
  EXPECT_THAT(text("palpate-feel"),
              AllOf(HasSubstr("palpate feel [options] input ..."),
                    HasSubstr("--headset TEXT openxr: in a headset"),
                    HasSubstr("One of auto, openxr, none, off. Default: auto."),
                    HasSubstr("A number from 0.001 to 100000 frames per second."),
                    HasSubstr("EXIT STATUS"), HasSubstr("--gpu NAME Vulkan device"),
                    HasSubstr("--headless OUTPUT_DIR Write stereo")));
  EXPECT_THAT(text("palpate"),
              AllOf(HasSubstr("palpate [options] command [arguments]"), HasSubstr("XDG_STATE_HOME"),
                    HasSubstr("See palpate-motion(1)"), Not(HasSubstr("write-manual"))));
  EXPECT_THAT(text("palpate-motion"),
              AllOf(HasSubstr("-o, --output OUTPUT Pair: the field, .mha"),
                    HasSubstr("Not together with"), Not(HasSubstr("--device"))));
}

/// The completions of bash for the last of the words.
std::vector<std::string> offered(const TemporaryFolder& folder,
                                 const std::vector<std::string>& words,
                                 const std::string& in = ".") {
  std::string line;
  for (const std::string& word : words) line += " '" + word + "'";
  const ShellOutcome bash =
      shell("cd '" + in +
            "' && bash --norc --noprofile -c 'source \"$0\"; COMP_WORDS=(\"$@\"); "
            "COMP_CWORD=$(($# - 1)); _palpate; printf \"%s\\n\" \"${COMPREPLY[@]}\"' '" +
            (folder / "bash/palpate").string() + "'" + line);
  EXPECT_EQ(bash.exit_code, 0) << bash.text;
  std::vector<std::string> found;
  std::istringstream lines(bash.text);
  for (std::string one; std::getline(lines, one);)
    if (!one.empty()) found.push_back(one);
  return found;
}

TEST_F(Manual, CompletesInBash) {
  if (!has("bash")) GTEST_SKIP() << "There is no bash here.";
  EXPECT_THAT(shell("bash --norc -c 'source \"$0\"; complete -p palpate' '" +
                    (folder / "bash/palpate").string() + "'")
                  .text,
              HasSubstr("complete -F _palpate palpate"));
  const auto complete = [&](std::vector<std::string> words) { return offered(folder, words); };
  EXPECT_THAT(complete({"palpate", "mo"}), ElementsAre("motion"));
  EXPECT_THAT(complete({"palpate", "ph"}), ElementsAre("phantom"));
  EXPECT_THAT(complete({"palpate", ""}),
              AllOf(::testing::Contains("feel"), ::testing::Contains("info"),
                    Not(::testing::Contains("write-manual"))));
  EXPECT_THAT(complete({"palpate", "motion", "--pre"}), ElementsAre("--preset"));
  EXPECT_THAT(complete({"palpate", "motion", "--preset", "b"}),
              UnorderedElementsAre("balanced", "best"));
  // bash splits --preset=b into three words.
  EXPECT_THAT(complete({"palpate", "motion", "--preset", "=", "b"}),
              UnorderedElementsAre("balanced", "best"));
  EXPECT_THAT(complete({"palpate", "feel", "--device", "si"}), ElementsAre("simulated"));
  EXPECT_THAT(complete({"palpate", "motion", "--dev"}), IsEmpty()) << "the old name is not offered";
  EXPECT_THAT(complete({"palpate", "--verbose", "feel", "--head"}),
              UnorderedElementsAre("--headless", "--headset"));
  EXPECT_THAT(complete({"palpate", "feel", "--look", "CT"}),
              UnorderedElementsAre("CT\\ bone", "CT\\ heart", "CT\\ lung"));
  EXPECT_THAT(complete({"palpate", "help", "cal"}), ElementsAre("calibrate"));
  EXPECT_THAT(complete({"palpate", "feel", "--fps", ""}), IsEmpty())
      << "there are no completions of a number";
}

TEST_F(Manual, CompletesFilesAndFoldersInBash) {
  if (!has("bash")) GTEST_SKIP() << "There is no bash here.";
  const TemporaryFolder data;
  files::write_bytes(data / "one scan.mha", "x");
  files::write_bytes(data / "one.csv", "x");
  fs::create_directory(data / "one folder");
  const auto complete = [&](std::vector<std::string> words) {
    return offered(folder, words, data.path().string());
  };
  EXPECT_THAT(complete({"palpate", "motion", "one"}),
              UnorderedElementsAre("one scan.mha", "one.csv", "one folder"));
  EXPECT_THAT(complete({"palpate", "motion", "a.mha", "--mask", "one s"}),
              ElementsAre("one scan.mha"));
  EXPECT_THAT(complete({"palpate", "feel", "heart", "--headless", "one"}),
              ElementsAre("one folder"));
}

/// Types $2 and the tabulator into a zsh of its own on a pseudo-terminal, and waits until $3 is
/// there; the completions are in $1.
constexpr const char* kTyping = R"(
zmodload zsh/zpty
zpty z zsh -f -i
zpty -w z "PS1=; fpath=($1 \$fpath); autoload -Uz compinit; compinit -u -D; echo rea\"\"dy"
zpty -m -r z out '*ready*'
zpty -w -n z "$2"$'\t'
out=
for ((n = 0; n < 600; ++n)); do
  zpty -r -t z part && out+=$part
  [[ $out == *"$3"* ]] && break
  sleep 0.1
done
zpty -d z
print -r -- $out
)";

TEST_F(Manual, CompletesInZsh) {
  if (!has("zsh")) GTEST_SKIP() << "There is no zsh here.";
  EXPECT_EQ(shell("zsh -n '" + at("zsh/_palpate") + "'").text, "");
  files::write_bytes(folder / "typing", kTyping);
  const auto expect = [&](const std::string& line, const std::string& completed) {
    const ShellOutcome zsh = shell("zsh -f '" + at("typing") + "' '" + at("zsh") + "' '" + line +
                                   "' '" + completed + "'");
    EXPECT_THAT(zsh.text, HasSubstr(completed)) << line;
  };
  expect("palpate phan", "palpate phantom");
  expect("palpate motion --preset bal", "--preset balanced");
  expect("palpate feel --headl", "--headless");
  expect("palpate feel --look MR --look CT\\ b", "CT\\ bone");
}

TEST(Install, PutsProgramPagesAndCompletionsInPlaceAndTakesThemAway) {
  if (!has("cmake")) GTEST_SKIP() << "There is no cmake here.";
  const TemporaryFolder prefix, build;
  // CMake's list of installed files must not replace that of a user's own installation.
  std::string script = files::read_bytes(PALPATE_BUILD_DIR "/cmake_install.cmake");
  // From CMake 3.31 on there are two of them.
  const std::string real = "file(WRITE \"" PALPATE_BUILD_DIR "/";
  const std::string ours = "file(WRITE \"" + build.path().string() + "/";
  size_t at = script.find(real);
  ASSERT_NE(at, std::string::npos) << "this CMake writes its list in another way";
  for (; at != std::string::npos; at = script.find(real)) script.replace(at, real.size(), ours);
  files::write_bytes(build / "cmake_install.cmake", script);
  const ShellOutcome installed = shell("cmake -DCMAKE_INSTALL_PREFIX='" + prefix.path().string() +
                                       "' -DCMAKE_INSTALL_COMPONENT=palpate_program -P '" +
                                       (build / "cmake_install.cmake").string() + "'");
  ASSERT_EQ(installed.exit_code, 0) << installed.text;
  for (const char* file :
       {"bin/palpate", "share/man/man1/palpate.1.gz", "share/man/man1/palpate-feel.1.gz",
        "share/bash-completion/completions/palpate", "share/zsh/vendor-completions/_palpate"})
    EXPECT_TRUE(fs::is_regular_file(prefix / file)) << file;
  const ShellOutcome version = shell("'" + (prefix / "bin/palpate").string() + "' --version");
  EXPECT_THAT(version.text, HasSubstr("palpate "));
  files::write_bytes(prefix / "share/man/man1/other.1", "another program's");
  const std::string uninstall = "cmake -DBUILD='" + build.path().string() +
                                "' -P '" PALPATE_SOURCE_DIR "/cmake/uninstall.cmake'";
  const ShellOutcome removed = shell(uninstall);
  EXPECT_EQ(removed.exit_code, 0) << removed.text;
  std::vector<std::string> left;
  for (const auto& entry : fs::recursive_directory_iterator(prefix.path()))
    if (entry.is_regular_file()) left.push_back(entry.path().filename().string());
  EXPECT_THAT(left, ElementsAre("other.1"));
  const ShellOutcome again = shell(uninstall);
  EXPECT_NE(again.exit_code, 0);
  EXPECT_THAT(again.text, HasSubstr("Nothing was installed from"));
}

}  // namespace
}  // namespace palpate::app
