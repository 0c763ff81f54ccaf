#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "compute/volume/result.h"
#include "integration/charts/canvas.h"
#include "integration/desktop/pointing.h"
#include "module/view/eye.h"
#include "module/view/picture.h"

struct GLFWwindow;

namespace palpate::desktop {

/// What a key asks for.
enum class KeyAction {
  kPlay,        ///< space: play or pause
  kBack,        ///< left arrow: a step back in time; comes again while it is held
  kForward,     ///< right arrow
  kClip,        ///< C: clip plane on or off
  kLook,        ///< 1 to 5: a preset
  kRecentre,    ///< R: the probe under the cursor, at the depth of what is looked at
  kReset,       ///< O: the camera as it was at first
  kNearer,      ///< +
  kFurther,     ///< -
  kTube,        ///< T: a stream tube at the proxy
  kKeepTubes,   ///< K: stream tubes stay
  kClearTubes,  ///< X: those that do not are gone
  kSlices,      ///< S: slices on or off
  kSlicesAway,  ///< arrow up: slices away from the eye; comes again while it is held
  kSlicesNear,  ///< arrow down
  kHelp,        ///< H: help on or off
  kQuit,        ///< Esc; closed() is true from then on
};

struct KeyPress {
  KeyAction key = KeyAction::kPlay;
  int number = 0;  ///< kLook: 0 to 7, or 8: what suits the data
};

/// What the person did since the last poll, and the state now.
struct Input {
  InPicture cursor{0.0};      ///< in the picture that is shown, not in the window's margins
  glm::dvec2 cursor_px{0.0};  ///< in the window, from its top left corner
  bool in_window = false;     ///< the cursor is over the window
  bool moved = false;         ///< the cursor is elsewhere than at the last poll
  glm::dvec2 dragged{0.0};    ///< how far it went, in heights of the window; y upwards
  double wheel = 0.0;         ///< notches, away from the person positive
  bool left = false, right = false, middle = false;
  std::vector<KeyPress> keys;  ///< in order
};

/// A bitmap laid over the picture, its corner at `corner_px` from the window's top left one.
struct Overlay {
  const charts::Bitmap* raster = nullptr;
  glm::ivec2 corner_px{0};
};

/// A window on a desk that shows pictures, whole and undistorted: where its shape is not theirs
/// there are dark margins. Sizes are always the present ones, in the display's own pixels, also
/// after resizing and on dense displays. All on the program's main thread, one window at a time.
class Window {
 public:
  /// kNoDevice, in a sentence, where there is no display or it can not show pictures. width and
  /// height are in the desktop's units: a dense display gives more pixels.
  static Result<std::unique_ptr<Window>> open(const std::string& title, int width, int height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Shows a picture (an empty one: dark) with overlays, the last on top. Waits for the display;
  /// does nothing if it shows all of this already.
  void show(const Picture& picture, std::span<const Overlay> overlays);
  /// Takes what has happened since the last time. Does not wait.
  Input poll();
  /// The person closed it, or pressed Esc.
  bool closed() const;
  /// The display has gone away. All other calls do nothing then; poll() and size_px() give zeros.
  bool lost() const;

  /// Its size now; 0 x 0 while it is minimised.
  PictureSize size_px() const;
  /// Pixels that a line one unit thick should have: 1, or up to 3 on dense displays.
  double scale() const;

 private:
  explicit Window(GLFWwindow* window);
  struct Texture;
  struct Heard;
  static void listen(GLFWwindow* window);
  void draw_texture(const Texture& texture) const;

  GLFWwindow* window_;
  std::unique_ptr<Heard> heard_;
  std::vector<Texture> textures_;  ///< the picture's, then one per overlay
  size_t shown_textures_ = 0;      ///< how many of them are shown
  PictureSize shown_size_;         ///< of the window when they were
  double picture_aspect_ = 0.0;    ///< of what was shown last, width by height; 0: nothing
  glm::dvec2 last_cursor_{0.0};    ///< in the desktop's units
  bool known_cursor_ = false;
};

/// Where a picture of this aspect (width by height) is shown in a window: as large as it can be, in
/// the middle. Units as the window's.
struct PicturePlace {
  glm::dvec2 corner{0.0}, size{0.0};
};
PicturePlace place_of_picture(glm::dvec2 window_size, double aspect);

}  // namespace palpate::desktop
