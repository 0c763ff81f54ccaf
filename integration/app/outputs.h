#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::app {

/// Output files that appear only when all work has succeeded: they are written to a hidden folder
/// on the same disk, and publish() renames them into place; a name that is a link stays one.
/// Without publish() nothing is left and no old file has changed. The next into() removes what a
/// killed process has left behind. One thread at a time.
class Outputs {
 public:
  /// `folder` need not exist. Errors: kBadOutput if it can not be created or written, or has no
  /// room for `bytes`.
  static Result<Outputs> into(const std::filesystem::path& folder, double bytes = 0.0);

  Outputs(Outputs&& other) noexcept;
  Outputs& operator=(Outputs&&) = delete;
  ~Outputs();

  const std::filesystem::path& folder() const { return folder_; }

  /// The path to which to write the file that will become folder/name. Errors: kBadOutput if the
  /// hidden folder can not be created, or if name is a folder.
  Result<std::filesystem::path> stage(const std::string& name);

  /// Gives all staged files their names, replacing older ones.
  Status publish();

  /// The same error with the file's final name, which the user knows.
  Error in_place(Error error) const;

 private:
  explicit Outputs(std::filesystem::path folder);

  std::filesystem::path folder_;
  std::filesystem::path hidden_;
  int hidden_fd_ = -1;  ///< locked while this lives, see files::lock_as_alive()
  std::vector<std::string> names_;
};

/// The nearest existing folder above, or the path itself.
std::filesystem::path nearest_folder(const std::filesystem::path& path);

}  // namespace palpate::app
