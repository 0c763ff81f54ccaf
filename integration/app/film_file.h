#pragma once

#include <filesystem>

#include "integration/app/piped_program.h"
#include "integration/charts/canvas.h"

namespace palpate::app {

/// Writes a film with the program ffmpeg, which must be installed: .webm (VP9), .mp4 (H.264) or
/// .gif, by the name's end. Without finish() ffmpeg is ended; the file may be there in part. One
/// thread.
class FilmFile {
 public:
  /// kBadInput, with the kinds that there are, for another name's end.
  static Status check_name(const std::filesystem::path& path);
  /// All pictures have this size. Errors: kBadInput without ffmpeg, kBadOutput.
  static Result<FilmFile> start(const std::filesystem::path& path, int width, int height,
                                double pictures_per_s);
  /// Errors: kBadOutput, with what ffmpeg says.
  Status add(const charts::Bitmap& picture);
  /// Waits for the file. Errors: as add().
  Status finish();

 private:
  FilmFile(int width, int height) : width_(width), height_(height) {}
  Error failure() const;

  int width_, height_;
  PipedProgram ffmpeg_;
};

}  // namespace palpate::app
