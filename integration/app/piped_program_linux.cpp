#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "integration/app/piped_program.h"

extern char** environ;

namespace palpate::app {

struct PipedProgram::System {
  pid_t program = -1;
  int input = -1;   ///< socket to its standard input: a write to a dead process raises no signal
  int errors = -1;  ///< memory that takes its standard error
};

PipedProgram::PipedProgram() : system_(std::make_unique<System>()) {}
PipedProgram::PipedProgram(PipedProgram&&) noexcept = default;

PipedProgram::~PipedProgram() {
  if (!system_) return;
  if (system_->input >= 0) close(system_->input);
  if (system_->errors >= 0) close(system_->errors);
  if (system_->program < 0) return;
  kill(system_->program, SIGKILL);
  waitpid(system_->program, nullptr, 0);
}

ProgramStart PipedProgram::start(const std::vector<std::string>& words, std::string& problem) {
  std::array<int, 2> ends{-1, -1};
  system_->errors = memfd_create("errors", MFD_CLOEXEC);
  if (system_->errors < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    problem = std::strerror(errno);
    return ProgramStart::kFailed;
  }
  system_->input = ends[0];
  std::vector<std::string> copies = words;
  std::vector<char*> pointers;
  for (std::string& word : copies) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, system_->errors, STDERR_FILENO);
  const int failed = posix_spawnp(&system_->program, pointers.front(), &actions, nullptr,
                                  pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (failed == 0) return ProgramStart::kRuns;
  system_->program = -1;
  problem = std::strerror(failed);
  return failed == ENOENT ? ProgramStart::kNotThere : ProgramStart::kFailed;
}

bool PipedProgram::write(const void* bytes, size_t n) {
  const auto* from = static_cast<const char*>(bytes);
  while (n > 0) {
    const ssize_t sent = send(system_->input, from, n, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    from += sent;
    n -= size_t(sent);
  }
  return true;
}

bool PipedProgram::finish() {
  if (system_->program < 0) return false;
  close(std::exchange(system_->input, -1));
  int state = 0;
  while (waitpid(system_->program, &state, 0) < 0 && errno == EINTR) {
  }
  system_->program = -1;
  return WIFEXITED(state) && WEXITSTATUS(state) == 0;
}

std::string PipedProgram::complaints() const {
  std::array<char, 400> text{};
  const ssize_t count = pread(system_->errors, text.data(), text.size(), 0);
  return std::string(text.data(), size_t(std::max<ssize_t>(count, 0)));
}

}  // namespace palpate::app
