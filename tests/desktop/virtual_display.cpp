#include "tests/desktop/virtual_display.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace palpate::test {
namespace {

// A limit for busy machines.
constexpr int kPatience_ms = 30'000;

bool is_there(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null").c_str()) == 0;
}

/// The display number, which Xvfb writes when it is ready. Empty if it does not start.
std::string number_from(int pipe) {
  std::string number;
  pollfd ready{pipe, POLLIN, 0};
  char c = 0;
  while (poll(&ready, 1, kPatience_ms) > 0 && read(pipe, &c, 1) == 1 && c != '\n') number += c;
  return c == '\n' ? number : std::string();
}

}  // namespace

std::unique_ptr<VirtualDisplay> VirtualDisplay::start(int width, int height, std::string& why_not) {
  for (const char* program : {"Xvfb", "xdotool"}) {
    if (is_there(program)) continue;
    why_not = std::string(program) + " is not installed, so there is no screen to test on.";
    return nullptr;
  }
  auto display = std::unique_ptr<VirtualDisplay>(new VirtualDisplay());
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return nullptr;
  const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
  const std::string pipe = std::to_string(ends[1]);
  const std::string folder = display->folder_.path().string();
  display->pid_ = fork();
  if (display->pid_ == 0) {
    fcntl(ends[1], F_SETFD, 0);
    dup2(open("/dev/null", O_RDWR), 2);
    // Keys do not repeat: on a busy machine time may pass between a press and its release.
    execlp("Xvfb", "Xvfb", "-displayfd", pipe.c_str(), "-screen", "0", screen.c_str(), "-fbdir",
           folder.c_str(), "-nolisten", "tcp", "-r", nullptr);
    _exit(127);
  }
  close(ends[1]);
  const std::string number = number_from(ends[0]);
  close(ends[0]);
  if (number.empty()) {
    why_not = "Xvfb does not start here, so there is no screen to test on.";
    return nullptr;
  }
  setenv("DISPLAY", (":" + number).c_str(), 1);
  unsetenv("WAYLAND_DISPLAY");
  return display;
}

VirtualDisplay::~VirtualDisplay() {
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);
  waitpid(pid_, nullptr, 0);
}

Screenshot VirtualDisplay::screenshot() const {
  std::ifstream file(folder_.path() / "Xvfb_screen0", std::ios::binary);
  const std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(file), {}};
  // XWD: 25 words, most significant byte first; then the name, the colours (12 bytes each), rows.
  const auto word = [&](size_t index) {
    const unsigned char* b = bytes.data() + 4 * index;
    return uint32_t(b[0]) << 24 | uint32_t(b[1]) << 16 | uint32_t(b[2]) << 8 | uint32_t(b[3]);
  };
  Screenshot shot;
  if (bytes.size() < 100) return shot;
  const size_t rows_at = word(0) + 12 * size_t(word(19)), bytes_per_row = word(12);
  const bool lowest_first = word(7) == 0;
  if (word(11) != 32 || bytes.size() < rows_at + bytes_per_row * word(5)) return shot;
  shot.width = int(word(4));
  shot.height = int(word(5));
  for (size_t y = 0; y < size_t(shot.height); ++y)
    for (size_t x = 0; x < size_t(shot.width); ++x) {
      const unsigned char* b = bytes.data() + rows_at + y * bytes_per_row + 4 * x;
      shot.pixels.push_back(lowest_first
                                ? uint32_t(b[2]) << 16 | uint32_t(b[1]) << 8 | uint32_t(b[0])
                                : uint32_t(b[1]) << 16 | uint32_t(b[2]) << 8 | uint32_t(b[3]));
    }
  return shot;
}

bool VirtualDisplay::act(const std::string& arguments) const {
  return std::system(("xdotool " + arguments).c_str()) == 0;
}

void Screenshot::save(const std::string& path) const {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << width << ' ' << height << "\n255\n";
  for (const uint32_t pixel : pixels)
    file << char(pixel >> 16 & 255) << char(pixel >> 8 & 255) << char(pixel & 255);
}

}  // namespace palpate::test
