#include <fmt/format.h>

#ifndef _WIN32
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#endif

#include "integration/app/commands.h"
#include "integration/app/exit_code.h"

namespace palpate::app {
namespace {

#ifdef _WIN32

int run_lab(const std::vector<std::string>&) {
  fmt::print(stderr,
             "palpate: Charts are measured by palpate-lab, which is not made for Windows.\n");
  return kExitBad;
}

#else

namespace fs = std::filesystem;

/// The path of palpate-lab beside this program; empty if it is not there.
fs::path lab_beside() {
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error);
  const fs::path lab = here.parent_path() / "palpate-lab";
  return !error && access(lab.c_str(), X_OK) == 0 ? lab : fs::path();
}

/// Replaces this process by palpate-lab (exec): the one beside this program, or else the first on
/// PATH. Returns only if there is none.
int run_lab(const std::vector<std::string>& words) {
  // Maps used to be a kind of chart: the old command still works.
  const bool maps = !words.empty() && words.front() == "stability";
  std::vector<std::string> arguments = {"palpate-lab", maps ? "maps" : "chart"};
  arguments.insert(arguments.end(), words.begin() + (maps ? 1 : 0), words.end());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const fs::path lab = lab_beside();
  if (lab.empty()) {
    execvp("palpate-lab", pointers.data());
  } else {
    execv(lab.c_str(), pointers.data());
  }
  if (errno != ENOENT) {
    fmt::print(stderr, "palpate: palpate-lab can not be started: {}.\n", std::strerror(errno));
    return kExitInternal;
  }
  fmt::print(stderr,
             "palpate: Charts are measured by palpate-lab, which is neither beside palpate nor on "
             "PATH: './run chart' in palpate's source tree builds and runs it.\n");
  return kExitBad;
}

#endif

}  // namespace

Command add_chart(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "chart",
      "Chart speed against accuracy on this machine, as one HTML file, with palpate-lab where it "
      "is installed");
  // The options, including --help, belong to palpate-lab.
  app->set_help_flag();
  app->prefix_command();
  return {app, [app] { return run_lab(app->remaining()); }, {}, {}, {}};
}

}  // namespace palpate::app
