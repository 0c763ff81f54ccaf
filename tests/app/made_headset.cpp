#include "tests/app/made_headset.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "tests/app/program.h"

namespace palpate::app {

MadeHeadset::MadeHeadset() {
  const std::string remote = folder_ / "remote";
  mkfifo(remote.c_str(), 0600);
  // Opened for reading too: so what is written before the program reads stays in the FIFO.
  fifo_ = open(remote.c_str(), O_RDWR | O_CLOEXEC);
  setenv("XR_RUNTIME_JSON", PALPATE_FAKE_RUNTIME, 1);
  setenv("PALPATE_FAKE_XR_REAL_TIME", "1", 1);
  setenv("PALPATE_FAKE_XR_REMOTE", remote.c_str(), 1);
  setenv("PALPATE_FAKE_XR_REPORT", (folder_ / "left").c_str(), 1);
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  // A head that does not sway, so that things in the room are where the test expects them.
  say("head 0 1.6 0");
}

MadeHeadset::~MadeHeadset() {
  for (const char* name : {"XR_RUNTIME_JSON", "PALPATE_FAKE_XR_REAL_TIME", "PALPATE_FAKE_XR_REMOTE",
                           "PALPATE_FAKE_XR_REPORT"})
    unsetenv(name);
  close(fifo_);
}

void MadeHeadset::say(const std::string& command) {
  const std::string line = command + "\n";
  if (write(fifo_, line.data(), line.size()) != ssize_t(line.size())) std::abort();
}

std::map<std::string, std::string> MadeHeadset::ask() {
  const std::string file = folder_ / ("asked_" + std::to_string(asked_++));
  say("tell " + file);
  std::map<std::string, std::string> lines;
  if (!wait_until([&] { return std::filesystem::exists(file); })) return lines;
  std::ifstream stream(file);
  for (std::string word, rest; stream >> word && std::getline(stream, rest);)
    lines[word] = rest.substr(rest.empty() ? 0 : 1);
  return lines;
}

MadeHeadset::Shown MadeHeadset::shown() const {
  Shown shown;
  std::ifstream stream(folder_ / ("asked_" + std::to_string(asked_ - 1) + ".ppm"),
                       std::ios::binary);
  std::string magic;
  int most = 0;
  stream >> magic >> shown.width >> shown.height >> most;
  stream.get();
  std::stringstream rest;
  rest << stream.rdbuf();
  shown.rgb = rest.str();
  std::ifstream depths(folder_ / ("asked_" + std::to_string(asked_ - 1) + ".depth"),
                       std::ios::binary);
  for (float at_m = 0; depths.read(reinterpret_cast<char*>(&at_m), sizeof at_m);)
    shown.depth_m.push_back(at_m);
  return shown;
}

std::string MadeHeadset::left() const {
  std::ifstream stream(folder_ / "left");
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace palpate::app
