#include "integration/app/film_file.h"

#include <fmt/format.h>

#include <string>
#include <vector>

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
                                 double pictures_per_s) {
  if (const Status named = check_name(path); !named) return named.error();
  FilmFile film(width, height);
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
                                    fmt::format("{:.6f}", pictures_per_s),
                                    "-i",
                                    "-"};
  const auto& options = kind_of(path)->options;
  words.insert(words.end(), options.begin(), options.end());
  // A name that begins with "-" is no option.
  words.push_back("file:" + path.string());
  std::string problem;
  switch (film.ffmpeg_.start(words, problem)) {
    case ProgramStart::kRuns:
      return film;
    case ProgramStart::kNotThere:
      return Error{ErrorKind::kBadInput,
                   "A film needs the program ffmpeg, which is not here: install the package "
                   "ffmpeg, or let --headless write single pictures"};
    case ProgramStart::kFailed:
      break;
  }
  return Error{ErrorKind::kBadInput, fmt::format("ffmpeg can not be started: {}", problem)};
}

Status FilmFile::add(const charts::Bitmap& picture) {
  if (picture.width != width_ || picture.height != height_)
    return Error{ErrorKind::kBadInput, "A film's pictures have one size"};
  if (ffmpeg_.write(picture.pixels.data(), picture.pixels.size() * sizeof(uint32_t)))
    return Nothing{};
  ffmpeg_.finish();
  return failure();
}

Status FilmFile::finish() {
  if (ffmpeg_.finish()) return Nothing{};
  return failure();
}

/// The first line that ffmpeg has said.
Error FilmFile::failure() const {
  const std::string said = ffmpeg_.complaints();
  return {ErrorKind::kBadOutput,
          "ffmpeg could not write the film: " +
              (said.empty() ? "it said nothing" : said.substr(0, said.find_first_of("\r\n")))};
}

}  // namespace palpate::app
