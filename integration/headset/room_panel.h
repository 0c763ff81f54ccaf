#pragma once

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "integration/charts/canvas.h"
#include "integration/headset/button_help.h"
#include "module/session/slices.h"
#include "module/view/picture.h"
#include "module/view/things.h"

namespace palpate::headset {

/// What a person in a headset reads.
struct RoomText {
  std::string force;  ///< large, such as "1.2 N"; empty: nobody feels anything
  std::string state;  ///< what the hand does, or why there is no force
  std::vector<std::string> lines;
  std::vector<ButtonHelp> help;
  std::shared_ptr<const OrthogonalSlices> slices;  ///< beside the text; null: none
  std::vector<TubeColours> colours;                ///< of tubes, below the slices
  bool operator==(const RoomText&) const = default;
};

/// A panel of kRoomPanel_px: slices at the left, text at the right.
inline constexpr int kRoomPanelWidth_px = 640, kRoomPanelHeight_px = 768;
charts::Bitmap draw_room_panel(const RoomText& text);

/// The panel, drawn on a thread of its own when what it says has changed, at most five times a
/// second: a frame of a headset does not wait for it. One thread.
class RoomPanel {
 public:
  /// Waits for the drawing.
  ~RoomPanel() = default;
  /// Takes effect with the next drawing. now_ns: monotonic.
  void want(const RoomText& text, int64_t now_ns);
  /// Null before the first one was drawn.
  const std::shared_ptr<const Picture>& newest() const { return newest_; }

 private:
  std::shared_ptr<const Picture> newest_;
  std::future<std::shared_ptr<const Picture>> drawing_;  ///< valid while a panel is drawn
  RoomText drawn_;                                       ///< what it shows
  bool any_ = false;
  int64_t started_ns_ = 0;
};

}  // namespace palpate::headset
