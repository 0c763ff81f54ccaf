#include "tests/app/program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace palpate::app {

Program::Program(const std::vector<std::string>& arguments) {
  // It ends with the test, also when ctest kills that.
  std::vector<std::string> copies = {"/usr/bin/setpriv", "--pdeathsig", "KILL", "--",
                                     PALPATE_PROGRAM};
  copies.insert(copies.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& argument : copies) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string out = folder_ / "out", err = folder_ / "err";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), kFlags, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), kFlags, 0600);
  // Ctrl-C ends it, also where these tests run in the background of a shell, which ignores it
  // there.
  sigset_t defaults;
  sigemptyset(&defaults);
  for (const int number : {SIGINT, SIGQUIT, SIGHUP}) sigaddset(&defaults, number);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int failed = posix_spawnp(&pid_, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) throw std::runtime_error("could not start " + std::string(PALPATE_PROGRAM));
}

bool Program::ended() {
  if (!ended_) ended_ = ::waitpid(pid_, &status_, WNOHANG) == pid_;
  return ended_;
}

std::string Program::said() const {
  return files::read_bytes(folder_ / "out");
}

bool Program::wait_for(const std::string& text) {
  const auto printed = [&] { return said().find(text) != std::string::npos; };
  while (!printed()) {
    if (ended()) return printed();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

void Program::signal(int number) {
  if (!ended()) ::kill(pid_, number);
}

bool Program::handles(int number) const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigCgt:"))
      return std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1;
  return false;
}

Outcome Program::wait() {
  if (!ended_) ::waitpid(pid_, &status_, 0);
  ended_ = true;
  return {WIFEXITED(status_) ? WEXITSTATUS(status_) : -1, files::read_bytes(folder_ / "out"),
          files::read_bytes(folder_ / "err")};
}

namespace {

/// Adds the commands that the help of these words lists, and their subcommands.
void add_commands(const std::vector<std::string>& words,
                  std::vector<std::vector<std::string>>& all) {
  std::vector<std::string> help = words;
  help.push_back("--help");
  std::istringstream lines(run(help).out);
  bool listed = false;
  for (std::string line; std::getline(lines, line);) {
    if (listed && line.size() > 2 && line.starts_with("  ") && line[2] != ' ') {
      std::vector<std::string> command = words;
      command.push_back(line.substr(2, line.find(' ', 2) - 2));
      all.push_back(command);
      add_commands(command, all);
    }
    // CLI11 writes it in capitals since version 2.5.
    listed |= line == "Subcommands:" || line == "SUBCOMMANDS:";
  }
}

}  // namespace

std::vector<std::vector<std::string>> commands() {
  std::vector<std::vector<std::string>> all;
  add_commands({}, all);
  return all;
}

Outcome run_computed(const std::vector<std::string>& arguments) {
  ::setenv("PALPATE_COMPUTED_TIME", "1", 1);
  Program program(arguments);
  ::unsetenv("PALPATE_COMPUTED_TIME");
  return program.wait();
}

bool has_device() {
  static const bool has = run({"devices"}).exit_code == 0;
  return has;
}

bool wait_until(const std::function<bool()>& done) {
  using namespace std::chrono_literals;
  for (int k = 0; k < 6000; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(20ms);
  }
  return false;
}

}  // namespace palpate::app
