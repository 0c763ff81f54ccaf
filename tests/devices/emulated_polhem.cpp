#include "tests/devices/emulated_polhem.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace palpate::devices::test {

EmulatedPolhem::EmulatedPolhem() {
  std::string folder = (std::filesystem::temp_directory_path() / "polhem-XXXXXX").string();
  if (!mkdtemp(folder.data())) throw std::runtime_error("no folder for a port");
  folder_ = folder;
  link_ = folder_ + "/ttyACM0";
  plug();
}

EmulatedPolhem::~EmulatedPolhem() {
  if (thread_.joinable()) unplug();
  std::filesystem::remove_all(folder_);
}

void EmulatedPolhem::plug() {
  master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0)
    throw std::runtime_error("no pseudo-terminal");
  const std::string name = ptsname(master_);
  // One end is kept open; else the other end would read the end of file before a program opens it.
  kept_ = open(name.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  tcgetattr(kept_, &settings);
  cfmakeraw(&settings);
  tcsetattr(kept_, TCSANOW, &settings);
  std::filesystem::remove(link_);
  std::filesystem::create_symlink(name, link_);
  stop_ = false;
  thread_ = std::thread([this] { serve(); });
}

void EmulatedPolhem::unplug() {
  stop_ = true;
  thread_.join();
  std::filesystem::remove(link_);
  close(kept_);
  close(master_);
}

void EmulatedPolhem::place(glm::dvec3 position_m) {
  const std::lock_guard lock(mutex_);
  place_m_ = position_m;
}

size_t EmulatedPolhem::received_count() const {
  const std::lock_guard lock(mutex_);
  return received_.size();
}

bool EmulatedPolhem::pushed(size_t command) const {
  const std::lock_guard lock(mutex_);
  return received_.at(command) != glm::dvec3(0.0);
}

glm::dvec3 EmulatedPolhem::force_n() const {
  const std::lock_guard lock(mutex_);
  return received_.empty() ? glm::dvec3(0.0) : received_.back();
}

size_t EmulatedPolhem::malformed() const {
  const std::lock_guard lock(mutex_);
  return malformed_;
}

void EmulatedPolhem::change_faults(const std::function<void(Faults&)>& change) {
  const std::lock_guard lock(mutex_);
  change(faults_);
}

void EmulatedPolhem::serve() {
  std::string in;
  while (!stop_) {
    pollfd file{master_, POLLIN, 0};
    if (poll(&file, 1, 5) <= 0) continue;
    char bytes[256];
    const ssize_t got = read(master_, bytes, sizeof bytes);
    if (got <= 0) continue;
    in.append(bytes, size_t(got));
    for (size_t end; (end = in.find('\n')) != std::string::npos;) {
      obey(in.substr(0, end));
      in.erase(0, end + 1);
    }
  }
}

void EmulatedPolhem::obey(const std::string& line) {
  std::string text;
  Faults faults;
  {
    const std::lock_guard lock(mutex_);
    int n[7] = {};
    const int count = std::sscanf(line.c_str(), "%d %d %d %d %d %d %d", &n[0], &n[1], &n[2], &n[3],
                                  &n[4], &n[5], &n[6]);
    if (count != 7 || n[3] != 2 || line.size() != 63) {
      ++malformed_;
      return;
    }
    // mN; x towards the user, y right, z up.
    received_.push_back(1e-3 * glm::dvec3(n[1], n[2], n[0]));
    faults = faults_;
    text = answer();
    // Called on the stored function, so that its state is kept between calls.
    if (faults_.mangle) text = faults_.mangle(std::move(text));
  }
  if (faults.silent) return;
  std::this_thread::sleep_for(std::chrono::nanoseconds(faults.delay_ns));
  write_bytes(text, faults.torn);
}

std::string EmulatedPolhem::answer() const {
  const glm::dvec3 mm = 1e3 * place_m_;
  char text[128];
  const int length =
      std::snprintf(text, sizeof text, "% 8.3f % 8.3f % 8.3f % 7.4f % 7.4f % 7.4f % 7.4f %d", mm.z,
                    mm.x, mm.y, 0.0919, -1.8483, 1.037, -1.9512, faults_.info);
  std::string line(text, size_t(length));
  line.resize(faults_.line_bytes - 1, ' ');
  return line + '\n';
}

void EmulatedPolhem::write_bytes(const std::string& bytes, size_t torn) const {
  const size_t piece = torn > 0 ? torn : bytes.size();
  for (size_t at = 0; at < bytes.size() && !stop_;) {
    pollfd file{master_, POLLOUT, 0};
    if (poll(&file, 1, 5) <= 0) continue;
    const ssize_t sent = write(master_, bytes.data() + at, std::min(piece, bytes.size() - at));
    if (sent < 0) return;
    at += size_t(sent);
    if (torn > 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
}

}  // namespace palpate::devices::test
