#include "integration/app/film_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

extern char** environ;

namespace palpate::app {
namespace {

/// What makes films of one kind: ffmpeg's options for the output.
struct FilmKind {
  const char* ending;
  std::vector<std::string> options;
};

/// Players take one sample of colour for four pixels, so an odd width or height gets one pixel
/// more.
constexpr const char* kEven = "pad=ceil(iw/2)*2:ceil(ih/2)*2";

const std::vector<FilmKind>& kinds() {
  static const std::vector<FilmKind> all = {
      {".webm",
       {"-vf", kEven, "-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-row-mt", "1", "-deadline",
        "good", "-cpu-used", "4", "-pix_fmt", "yuv420p"}},
      {".mp4", {"-vf", kEven, "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p"}},
      // One table of colours for the whole film; it starts again at its end.
      {".gif",
       {"-filter_complex", "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=sierra2_4a",
        "-loop", "0"}}};
  return all;
}

const FilmKind* kind_of(const std::filesystem::path& path) {
  for (const FilmKind& kind : kinds())
    if (path.extension() == kind.ending) return &kind;
  return nullptr;
}

}  // namespace

Status FilmFile::check_name(const std::filesystem::path& path) {
  if (kind_of(path)) return Nothing{};
  return Error{
      ErrorKind::kBadInput,
      fmt::format("'{}' is no name of a film: it ends in .webm, .mp4 or .gif", path.string())};
}

Result<FilmFile> FilmFile::start(const std::filesystem::path& path, int width, int height,
                                 int frames_per_second) {
  if (const Status named = check_name(path); !named) return named.error();
  FilmFile film(width, height);
  std::array<int, 2> ends{-1, -1};
  film.errors_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  if (film.errors_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return Error{ErrorKind::kBadOutput,
                 fmt::format("A film can not be started: {}", std::strerror(errno))};
  film.pictures_ = ends[0];
  std::vector<std::string> words = {"ffmpeg",
                                    "-hide_banner",
                                    "-loglevel",
                                    "error",
                                    "-y",
                                    "-f",
                                    "rawvideo",
                                    "-pix_fmt",
                                    "bgra",
                                    "-s",
                                    fmt::format("{}x{}", width, height),
                                    "-r",
                                    std::to_string(frames_per_second),
                                    "-i",
                                    "-"};
  const auto& options = kind_of(path)->options;
  words.insert(words.end(), options.begin(), options.end());
  // A name that begins with "-" is no option.
  words.push_back("file:" + path.string());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, film.errors_, STDERR_FILENO);
  const int failed =
      posix_spawnp(&film.ffmpeg_, "ffmpeg", &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (failed == 0) return film;
  film.ffmpeg_ = -1;
  return Error{ErrorKind::kBadInput,
               failed == ENOENT
                   ? "A film needs the program ffmpeg, which is not here: install the package "
                     "ffmpeg, or let --headless write single pictures"
                   : fmt::format("ffmpeg can not be started: {}", std::strerror(failed))};
}

FilmFile::FilmFile(FilmFile&& other) noexcept
    : width_(other.width_),
      height_(other.height_),
      ffmpeg_(std::exchange(other.ffmpeg_, -1)),
      pictures_(std::exchange(other.pictures_, -1)),
      errors_(std::exchange(other.errors_, -1)) {}

FilmFile::~FilmFile() {
  if (pictures_ >= 0) close(pictures_);
  if (errors_ >= 0) close(errors_);
  if (ffmpeg_ < 0) return;
  kill(ffmpeg_, SIGKILL);
  waitpid(ffmpeg_, nullptr, 0);
}

Status FilmFile::add(const charts::Bitmap& picture) {
  if (picture.width != width_ || picture.height != height_)
    return Error{ErrorKind::kBadInput, "A film's pictures have one size"};
  const auto* bytes = reinterpret_cast<const char*>(picture.pixels.data());
  size_t left = picture.pixels.size() * sizeof(uint32_t);
  while (left > 0) {
    const ssize_t sent = send(pictures_, bytes, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return failure();
    bytes += sent;
    left -= size_t(sent);
  }
  return Nothing{};
}

Status FilmFile::finish() {
  close(std::exchange(pictures_, -1));
  int state = 0;
  while (waitpid(ffmpeg_, &state, 0) < 0 && errno == EINTR) {
  }
  ffmpeg_ = -1;
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) return Nothing{};
  return failure();
}

/// The first line that ffmpeg has said.
Error FilmFile::failure() {
  if (ffmpeg_ >= 0) {
    shutdown(pictures_, SHUT_WR);
    waitpid(std::exchange(ffmpeg_, -1), nullptr, 0);
  }
  std::array<char, 400> text{};
  const ssize_t count = pread(errors_, text.data(), text.size() - 1, 0);
  const std::string said(text.data(), size_t(std::max<ssize_t>(count, 0)));
  return {ErrorKind::kBadOutput,
          "ffmpeg could not write the film: " +
              (said.empty() ? "it said nothing" : said.substr(0, said.find('\n')))};
}

}  // namespace palpate::app
