#include "integration/app/viewers.h"

#include <fmt/format.h>

#include "integration/app/advice.h"
#include "integration/app/progress.h"
#include "integration/desktop/display.h"

namespace palpate::app {
namespace {

Result<std::unique_ptr<desktop::DesktopLoop>> open_window(const ViewerChoice& choice) {
  auto window =
      desktop::DesktopLoop::open(choice.scene_name, {.device = choice.gpu.device}, choice.view);
  if (!window) return advised_window(window.error());
  return window;
}

Result<Viewers> in_headset(const ViewerChoice& choice, Viewers viewers,
                           const headset::HeadsetLoop::Availability& found) {
  viewers.why = found.headset ? fmt::format("in the headset: {}.", found.sentence)
                              : fmt::format("in a headset, as asked, as soon as one is there: {}",
                                            found.sentence);
  if (!choice.mirror || !desktop::has_display()) return viewers;
  // The window is for other people: the headset works without it.
  auto window = open_window(choice);
  if (!window) return viewers;
  viewers.window = std::move(*window);
  viewers.why += " A window shows the same to others.";
  return viewers;
}

}  // namespace

Result<Viewers> open_viewers(const ViewerChoice& choice) {
  Viewers viewers;
  if (choice.overlay && (choice.headset == "off" || choice.headset == "none"))
    return Error{
        ErrorKind::kBadInput,
        "--overlay needs a headset, where it draws above another program: leave --headset " +
            choice.headset + " out, or --overlay"};
  if (choice.headset == "off") {
    viewers.why = "nowhere, as asked.";
    return viewers;
  }
  if (choice.headset == "none") {
    auto window = open_window(choice);
    if (!window) return window.error();
    viewers.window = std::move(*window);
    viewers.why = "in a window, as asked.";
    return viewers;
  }
  const bool asked = choice.headset == "openxr" || choice.overlay;
  if (!asked && choice.headless) {
    viewers.why = "in picture files, as asked.";
    return viewers;
  }
  viewers.headset = std::make_unique<headset::HeadsetLoop>(
      headset::HeadsetLoopOptions{choice.pass_through, choice.overlay, choice.panel,
                                  choice.refresh_hz, choice.calibrated, Console::verbose()});
  const headset::HeadsetLoop::Availability found = viewers.headset->found();
  if (asked && (!found.runtime || (choice.overlay && found.can_never)))
    return Error{ErrorKind::kNoDevice, found.sentence};
  if (asked || found.headset) return in_headset(choice, std::move(viewers), found);
  viewers.headset.reset();
  // Most people have no headset: give advice only if there is a runtime or if a headset was asked
  // for.
  const std::string reason =
      found.runtime || Console::verbose() ? " " + found.sentence : std::string();
  if (desktop::has_display()) {
    auto window = open_window(choice);
    if (window) {
      viewers.window = std::move(*window);
      viewers.why = "in a window, as no headset is there." + reason;
      return viewers;
    }
  }
  viewers.why =
      "nowhere, as there is no display and no headset: --headless FOLDER writes pictures." + reason;
  return viewers;
}

}  // namespace palpate::app
