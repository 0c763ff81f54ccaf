#include "integration/app/outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "integration/files/atomic_file.h"
#include "integration/files/descriptor.h"
#include "integration/files/sentences.h"

namespace palpate::app {
namespace fs = std::filesystem;

fs::path nearest_folder(const fs::path& path) {
  std::error_code error;
  fs::path nearest = fs::absolute(path, error).lexically_normal();
  while (!fs::is_directory(nearest, error) && nearest.has_relative_path())
    nearest = nearest.parent_path();
  return nearest;
}

Outputs::Outputs(fs::path folder) : folder_(std::move(folder)) {
  hidden_ =
      nearest_folder(folder_) / fmt::format("{}{}", files::kHiddenFolder, files::process_id());
}

Outputs::Outputs(Outputs&& other) noexcept
    : folder_(std::move(other.folder_)),
      hidden_(std::exchange(other.hidden_, {})),
      hidden_fd_(std::exchange(other.hidden_fd_, -1)),
      names_(std::move(other.names_)) {}

Outputs::~Outputs() {
  if (hidden_.empty()) return;
  // Closed first: not every system removes a folder that is open.
  if (hidden_fd_ >= 0) files::close_descriptor(hidden_fd_);
  std::error_code error;
  fs::remove_all(hidden_, error);
}

Result<Outputs> Outputs::into(const fs::path& folder, double bytes) {
  const fs::path wanted = folder.empty() ? fs::path(".") : folder;
  if (const Status can = files::check_can_write_folder(wanted, bytes); !can) return can.error();
  files::remove_abandoned(nearest_folder(wanted));
  return Outputs(wanted);
}

Result<fs::path> Outputs::stage(const std::string& name) {
  std::error_code error;
  if (fs::is_directory(folder_ / name, error))
    return files::bad_output(folder_ / name, "is a folder: choose another name");
  if (hidden_fd_ < 0) {
    fs::create_directory(hidden_, error);
    if (error) return files::bad_output(folder_, "can not be written: {}", error.message());
    hidden_fd_ = files::open_folder(hidden_);
    if (hidden_fd_ >= 0) files::lock_as_alive(hidden_fd_);
    // Another process may have removed it as abandoned before it was locked.
    fs::create_directory(hidden_, error);
  }
  if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
  return hidden_ / name;
}

Status Outputs::publish() {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return files::bad_output(folder_, "can not be made: {}", error.message());
  for (const std::string& name : names_) {
    const Status replaced = files::replace_file(hidden_ / name, folder_ / name);
    if (!replaced) return replaced;
  }
  names_.clear();
  return Nothing{};
}

Error Outputs::in_place(Error error) const {
  const std::string hidden = hidden_.string();
  for (size_t at = error.message.find(hidden); at != std::string::npos;
       at = error.message.find(hidden))
    error.message.replace(at, hidden.size(), folder_.string());
  return error;
}

}  // namespace palpate::app
