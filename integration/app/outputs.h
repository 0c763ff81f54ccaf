#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compute/volume/result.h"

namespace palpate::app {

/// Files of one folder that appear only when all of the work has succeeded: they are written to a
/// hidden folder on the same disk and renamed into place by publish(); a name that is a link stays
/// one. Without publish() nothing is left and nothing that was there before has changed. What a
/// killed process left behind is removed by the next into(). One thread at a time.
class Outputs {
 public:
  /// `folder` need not exist yet. kBadOutput if it can not be made or written, or has no room for
  /// `bytes`.
  static Result<Outputs> into(const std::filesystem::path& folder, double bytes = 0.0);

  Outputs(Outputs&& other) noexcept;
  Outputs& operator=(Outputs&&) = delete;
  ~Outputs();

  const std::filesystem::path& folder() const { return folder_; }

  /// Where to write the file that will be folder/name. kBadOutput if the hidden folder can not be
  /// made, or name is a folder.
  Result<std::filesystem::path> stage(const std::string& name);

  /// Gives all staged files their names, replacing older ones.
  Status publish();

  /// The same error with the file's final name, which the person knows.
  Error in_place(Error error) const;

 private:
  explicit Outputs(std::filesystem::path folder);

  std::filesystem::path folder_;
  std::filesystem::path hidden_;
  int hidden_fd_ = -1;  ///< locked while this lives, see files::lock_as_alive()
  std::vector<std::string> names_;
};

/// The nearest folder above (or the path itself) that exists.
std::filesystem::path nearest_folder(const std::filesystem::path& path);

}  // namespace palpate::app
