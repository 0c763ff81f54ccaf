#include "integration/app/chart/front_file.h"

#include <fmt/format.h>

#include "integration/app/state_folder.h"
#include "integration/files/atomic_file.h"
#include "integration/report/child.h"

namespace palpate::app {

namespace fs = std::filesystem;

fs::path front_path() {
  const fs::path folder = state_folder();
  return folder.empty() ? folder : folder / "motion_front.json";
}

Status write_front(const studies::MotionFront& front) {
  const fs::path path = front_path();
  if (path.empty())
    return Error{ErrorKind::kBadOutput,
                 "The measured front can not be kept: neither XDG_STATE_HOME nor HOME is set."};
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  return files::write_text(path, studies::front_text(front));
}

Result<studies::MotionFront> read_front(const std::string& device) {
  const fs::path path = front_path();
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) {
    return Error{ErrorKind::kBadInput,
                 "What this machine can do has not been measured yet: run 'palpate chart motion "
                 "--quick' once (a minute or two), then try again."};
  }
  auto front = studies::parse_front(report::text_of(path));
  if (!front) return front.error();
  if (front->device != device) {
    return Error{ErrorKind::kBadInput,
                 fmt::format("The measured front is of another device ({}): run 'palpate chart "
                             "motion --quick' on {} once, then try again.",
                             front->device, device)};
  }
  return front;
}

}  // namespace palpate::app
