#pragma once

#include <memory>
#include <string>

#include "integration/desktop/camera.h"
#include "integration/desktop/force_plot.h"
#include "integration/desktop/force_tap.h"
#include "integration/desktop/pointing.h"
#include "integration/desktop/window.h"
#include "module/haptics/servo/position_source.h"
#include "module/session/live_picture.h"
#include "module/session/live_sizes.h"
#include "module/session/live_slices.h"

namespace palpate::desktop {

/// The window in which a scene is seen while it is felt, and the mouse that may be the hand. All on
/// the program's main thread.
class DesktopLoop {
 public:
  /// Opens the window. kNoDevice, in a sentence, where there is no display.
  static Result<std::unique_ptr<DesktopLoop>> open(const std::string& scene_name,
                                                   const vulkan::ContextOptions& gpu,
                                                   const ViewChoices& view);

  /// To be given to the servo: what it hears is plotted.
  TickListener* listener() { return &tap_; }

  /// While nothing can be seen yet: says what is being waited for, and takes the window's events.
  void wait(const std::string& doing);
  /// From now on this is seen. `mouse` moves the probe; null: another device does, and the mouse
  /// turns the view. All are borrowed until end().
  void begin(Session& session, PositionSource* mouse);
  /// Takes what the person did, shows what is felt; takes as long as a frame of a display.
  /// note: a line for the person, or nothing.
  void frame(const TickOutput& tick, const std::string& note);
  /// Ends the drawing; before the session goes.
  void end() {
    live_.reset();
    slices_.reset();
  }

  /// The person closed the window or pressed Esc.
  bool closed() const { return window_->closed(); }
  /// The display has gone away.
  bool lost() const { return window_->lost(); }

 private:
  DesktopLoop(std::unique_ptr<Window> window, std::string scene_name,
              const vulkan::ContextOptions& gpu, const ViewChoices& view);
  void press(const KeyPress& press, const Input& input);
  void drag_bar(Input& input);
  void steer(const Input& input);
  void move_probe(const Input& input);
  void draw(const TickOutput& tick, const std::string& note);
  /// Draws the bar of frames and the segments' sizes as they are now; empty ones where there are
  /// none.
  void draw_time();
  /// Asks for slices and draws the newest as a panel of this height, px; none: an empty one.
  void draw_panel(int height_px);
  Eye eye() const;
  /// Of one eye's picture, px.
  PictureSize eye_size() const;

  std::unique_ptr<Window> window_;
  std::string scene_name_;
  vulkan::ContextOptions gpu_;
  ViewChoices view_;
  ForceTap tap_;
  ForcePlot plot_;
  charts::Bitmap help_, note_;
  double help_scale_ = 0.0;
  std::string note_text_;
  bool shows_help_ = true;

  Session* session_ = nullptr;
  PositionSource* mouse_ = nullptr;
  Camera first_camera_, camera_;
  Pointing pointing_{glm::dvec3(0.0)};
  double ball_m_ = 0.1;  ///< radius around all volumes, world
  std::unique_ptr<LivePicture> live_;
  std::shared_ptr<const LiveFrame> shown_;
  std::unique_ptr<LiveSlices> slices_;
  std::shared_ptr<const OrthogonalSlices> drawn_slices_;  ///< what panel_ shows
  std::vector<TubeColours> drawn_colours_;                ///< the same
  charts::Bitmap panel_;
  LiveSizes sizes_;
  charts::Bitmap bar_, chart_;  ///< of frames; of the segments' sizes
  glm::ivec2 bar_corner_{0};
  bool was_left_ = false;   ///< the left button, at the last frame
  bool drags_bar_ = false;  ///< since it was pressed there
  bool played_ = false;     ///< before
  double dragged_to_ = 0.0;
};

}  // namespace palpate::desktop
