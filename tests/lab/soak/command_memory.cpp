#include "tests/lab/soak/command_memory.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <vector>

namespace palpate::soak {

CommandMemory::CommandMemory(const std::string& program, double seconds) {
  std::vector<std::string> words = {program,
                                    "feel",
                                    "heart",
                                    "--device",
                                    "simulated",
                                    "--headset",
                                    "off",
                                    "--csv",
                                    "/dev/null",
                                    "--seconds",
                                    std::to_string(seconds)};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_WRONLY, 0);
  if (posix_spawn(&pid_, program.c_str(), &files, nullptr, arguments.data(), environ) != 0)
    pid_ = -1;
  posix_spawn_file_actions_destroy(&files);
}

CommandMemory::~CommandMemory() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  ::waitpid(pid_, nullptr, 0);
}

size_t CommandMemory::resident_bytes() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/statm");
  size_t all_pages = 0, resident_pages = 0;
  file >> all_pages >> resident_pages;
  return resident_pages * size_t(::sysconf(_SC_PAGESIZE));
}

}  // namespace palpate::soak
