#pragma once

#include <sys/types.h>

#include <filesystem>

#include "integration/charts/canvas.h"

namespace palpate::app {

/// Writes a film with the program ffmpeg, which must be installed: .webm (VP9), .mp4 (H.264) or
/// .gif, by the name's end. One thread.
class FilmFile {
 public:
  /// kBadInput, with the kinds that there are, for another name's end.
  static Status check_name(const std::filesystem::path& path);
  /// All pictures have this size. Errors: kBadInput without ffmpeg, kBadOutput.
  static Result<FilmFile> start(const std::filesystem::path& path, int width, int height,
                                int frames_per_second);
  FilmFile(FilmFile&& other) noexcept;
  FilmFile& operator=(FilmFile&&) = delete;
  /// Without finish(): ends ffmpeg; the file may be there in part.
  ~FilmFile();

  /// Errors: kBadOutput, with what ffmpeg says.
  Status add(const charts::Bitmap& picture);
  /// Waits for the file. Errors: as add().
  Status finish();

 private:
  FilmFile(int width, int height) : width_(width), height_(height) {}
  Error failure();

  int width_, height_;
  pid_t ffmpeg_ = -1;
  int pictures_ = -1;  ///< socket to its standard input: a write to a dead process raises no signal
  int errors_ = -1;    ///< memory that takes its standard error
};

}  // namespace palpate::app
