#include "integration/app/choice/front_file.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "integration/app/choice/quantity.h"
#include "integration/files/atomic_file.h"
#include "integration/files/state_folder.h"

namespace palpate::app {

namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

}  // namespace

fs::path front_path() {
  const fs::path folder = files::state_folder();
  return folder.empty() ? folder : folder / "motion_front.json";
}

Status write_front(const MotionFront& front) {
  const fs::path path = front_path();
  if (path.empty())
    return Error{ErrorKind::kBadOutput,
                 "The measured front can not be kept: neither XDG_STATE_HOME nor HOME is set."};
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  return files::write_text(path, front_text(front));
}

Result<MotionFront> read_front(const std::string& device) {
  const fs::path path = front_path();
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) {
    return Error{ErrorKind::kBadInput,
                 "What this machine can do has not been measured yet: run 'palpate chart motion "
                 "--quick' once (a minute or two), then try again."};
  }
  auto front = parse_front(text_of(path));
  if (!front) return front.error();
  if (front->device != device) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The measured front is of another device ({}): run 'palpate chart "
                             "motion --quick' on {} once, then try again.",
                             front->device, device)};
  }
  return front;
}

Result<std::vector<Choice>> choose_settings(const std::string& within, const std::string& error,
                                            const Grid& grid, const std::string& device) {
  const auto limit = within.empty() ? parse_millimetres(error) : parse_seconds(within);
  if (!limit) return limit.error();
  const auto front = read_front(device);
  if (!front) return front.error();
  if (within.empty()) return choose_by_error(*front, *limit, grid.count(), grid.finest_mm());
  auto choice = choose_within(*front, *limit, grid.count(), grid.finest_mm());
  if (!choice) return choice.error();
  return std::vector{std::move(*choice)};
}

}  // namespace palpate::app
