#include "integration/desktop/window.h"

#include <fmt/format.h>

// After the macros that tell GLFW what to include: only OpenGL 1.1 with a few constants of 1.2 is
// used.
#include <GLFW/glfw3.h>
#ifdef _WIN32
#include <GL/glext.h>  // what its gl.h lacks
#endif

#include <algorithm>
#include <optional>
#include <utility>

#include "integration/desktop/display.h"

namespace palpate::desktop {
namespace {

constexpr float kMargin[3] = {0.03F, 0.035F, 0.05F};  // as the renderer's own background

std::string glfw_reason() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "no reason was given";
}

Error no_window(const std::string& reason) {
  return {ErrorKind::kNoDevice,
          fmt::format("No window could be opened ({}): start palpate within a desktop session",
                      reason)};
}

std::optional<KeyPress> meaning_of(int key) {
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_8) return KeyPress{KeyAction::kLook, key - GLFW_KEY_1};
  if (key >= GLFW_KEY_KP_1 && key <= GLFW_KEY_KP_8)
    return KeyPress{KeyAction::kLook, key - GLFW_KEY_KP_1};
  switch (key) {
    case GLFW_KEY_0:
    case GLFW_KEY_KP_0:
      return KeyPress{KeyAction::kLook, 8};
    case GLFW_KEY_SPACE:
      return KeyPress{KeyAction::kPlay};
    case GLFW_KEY_LEFT:
      return KeyPress{KeyAction::kBack};
    case GLFW_KEY_RIGHT:
      return KeyPress{KeyAction::kForward};
    case GLFW_KEY_C:
      return KeyPress{KeyAction::kClip};
    case GLFW_KEY_R:
      return KeyPress{KeyAction::kRecentre};
    case GLFW_KEY_O:
      return KeyPress{KeyAction::kReset};
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      return KeyPress{KeyAction::kNearer};
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return KeyPress{KeyAction::kFurther};
    case GLFW_KEY_T:
      return KeyPress{KeyAction::kTube};
    case GLFW_KEY_K:
      return KeyPress{KeyAction::kKeepTubes};
    case GLFW_KEY_X:
      return KeyPress{KeyAction::kClearTubes};
    case GLFW_KEY_S:
      return KeyPress{KeyAction::kSlices};
    case GLFW_KEY_UP:
      return KeyPress{KeyAction::kSlicesAway};
    case GLFW_KEY_DOWN:
      return KeyPress{KeyAction::kSlicesNear};
    case GLFW_KEY_H:
      return KeyPress{KeyAction::kHelp};
    case GLFW_KEY_ESCAPE:
      return KeyPress{KeyAction::kQuit};
    default:
      return std::nullopt;
  }
}

/// Those that go on while they are held.
bool repeats(KeyAction key) {
  return key == KeyAction::kBack || key == KeyAction::kForward || key == KeyAction::kNearer ||
         key == KeyAction::kFurther || key == KeyAction::kSlicesAway ||
         key == KeyAction::kSlicesNear;
}

glm::dvec2 size_in_units(GLFWwindow* window) {
  int width = 0, height = 0;
  glfwGetWindowSize(window, &width, &height);
  return {std::max(width, 1), std::max(height, 1)};
}

}  // namespace

/// An OpenGL texture and where it is, remade when its size changes.
struct Window::Texture {
  GLuint name = 0;
  int width = 0, height = 0;
  glm::dvec2 corner_px{0.0}, size_px{0.0};
  std::vector<uint32_t> pixels;

  /// False if all of this is so already.
  bool set(int new_width, int new_height, GLenum order, std::span<const uint32_t> new_pixels,
           glm::dvec2 corner, glm::dvec2 size) {
    const bool same_pixels =
        new_width == width && new_height == height &&
        std::equal(pixels.begin(), pixels.end(), new_pixels.begin(), new_pixels.end());
    const bool same_place = corner == corner_px && size == size_px;
    corner_px = corner;
    size_px = size;
    if (same_pixels) return !same_place;
    pixels.assign(new_pixels.begin(), new_pixels.end());
    if (name == 0) glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    if (new_width != width || new_height != height) {
      width = new_width;
      height = new_height;
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, order, GL_UNSIGNED_BYTE,
                   pixels.data());
    } else {
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, order, GL_UNSIGNED_BYTE,
                      pixels.data());
    }
    return true;
  }
};

/// What GLFW's callbacks have told since the last poll.
struct Window::Heard {
  bool uncovered = false;  ///< the display has lost what was shown
  double wheel = 0.0;
  std::vector<KeyPress> keys;
};

Result<std::unique_ptr<Window>> Window::open(const std::string& title, int width, int height) {
  if (glfwInit() != GLFW_TRUE) return no_window(glfw_reason());
  survive_display_loss();
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_API);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  GLFWwindow* made = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (!made) {
    const std::string reason = glfw_reason();
    glfwTerminate();
    return no_window(reason);
  }
  // A click that is shorter than a frame is seen, too.
  glfwSetInputMode(made, GLFW_STICKY_MOUSE_BUTTONS, GLFW_TRUE);
  glfwMakeContextCurrent(made);
  glfwSwapInterval(1);
  auto window = std::unique_ptr<Window>(new Window(made));
  GLint widest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &widest);
  // Any driver since 2004 has 2,048 and takes sizes that are no powers of two.
  if (widest < 2048) return no_window("its OpenGL can not show a picture of 2,048 pixels");
  return window;
}

Window::Window(GLFWwindow* window) : window_(window), heard_(std::make_unique<Heard>()) {
  glfwSetWindowUserPointer(window_, heard_.get());
  listen(window_);
}

Window::~Window() {
  if (display_is_lost()) return;
  for (const Texture& texture : textures_) glDeleteTextures(1, &texture.name);
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::listen(GLFWwindow* window) {
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* of) {
    static_cast<Heard*>(glfwGetWindowUserPointer(of))->uncovered = true;
  });
  glfwSetScrollCallback(window, [](GLFWwindow* of, double, double notches) {
    static_cast<Heard*>(glfwGetWindowUserPointer(of))->wheel += notches;
  });
  glfwSetKeyCallback(window, [](GLFWwindow* of, int key, int, int action, int) {
    const auto press = meaning_of(key);
    if (!press || action == GLFW_RELEASE) return;
    if (action == GLFW_REPEAT && !repeats(press->key)) return;
    static_cast<Heard*>(glfwGetWindowUserPointer(of))->keys.push_back(*press);
    if (press->key == KeyAction::kQuit) glfwSetWindowShouldClose(of, GLFW_TRUE);
  });
}

void Window::show(const Picture& picture, std::span<const Overlay> overlays) {
  if (display_is_lost()) return;
  const PictureSize size = size_px();
  if (size.width == 0 || size.height == 0) return;  // an icon
  const bool any = picture.width > 0 && picture.height > 0;
  picture_aspect_ = any ? double(picture.width) / picture.height : 0.0;
  // One texture of OpenGL's per thing shown; those of overlays that are gone are kept for later
  // ones.
  if (textures_.size() < 1 + overlays.size()) textures_.resize(1 + overlays.size());
  const PicturePlace place = place_of_picture({size.width, size.height}, picture_aspect_);
  bool changed = std::exchange(heard_->uncovered, false) || size != shown_size_ ||
                 1 + overlays.size() != shown_textures_;
  changed = textures_[0].set(picture.width, picture.height, GL_RGBA, picture.colours, place.corner,
                             place.size) ||
            changed;
  for (size_t o = 0; o < overlays.size(); ++o) {
    const charts::Bitmap& raster = *overlays[o].raster;
    changed = textures_[1 + o].set(raster.width, raster.height, GL_BGRA, raster.pixels,
                                   overlays[o].corner_px, {raster.width, raster.height}) ||
              changed;
  }
  if (!changed) return;
  shown_size_ = size;
  shown_textures_ = 1 + overlays.size();
  glViewport(0, 0, size.width, size.height);
  glMatrixMode(GL_PROJECTION);
  glLoadIdentity();
  glOrtho(0.0, size.width, size.height, 0.0, -1.0, 1.0);  // pixels, y downwards
  glMatrixMode(GL_MODELVIEW);
  glLoadIdentity();
  glClearColor(kMargin[0], kMargin[1], kMargin[2], 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
  glEnable(GL_TEXTURE_2D);
  glDisable(GL_BLEND);
  for (size_t t = 0; t < shown_textures_; ++t) {
    if (!textures_[t].pixels.empty()) draw_texture(textures_[t]);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);  // overlays have premultiplied alpha
  }
  glfwSwapBuffers(window_);
}

void Window::draw_texture(const Texture& texture) const {
  const glm::dvec2 corner = texture.corner_px, end = corner + texture.size_px;
  glBindTexture(GL_TEXTURE_2D, texture.name);
  glColor4f(1.0F, 1.0F, 1.0F, 1.0F);
  glBegin(GL_QUADS);
  glTexCoord2d(0.0, 0.0);
  glVertex2d(corner.x, corner.y);
  glTexCoord2d(1.0, 0.0);
  glVertex2d(end.x, corner.y);
  glTexCoord2d(1.0, 1.0);
  glVertex2d(end.x, end.y);
  glTexCoord2d(0.0, 1.0);
  glVertex2d(corner.x, end.y);
  glEnd();
}

Input Window::poll() {
  Input input;
  if (!display_is_lost()) glfwPollEvents();
  if (display_is_lost()) return input;
  input.wheel = std::exchange(heard_->wheel, 0.0);
  input.keys = std::exchange(heard_->keys, {});
  input.left = glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
  input.right = glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
  input.middle = glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_MIDDLE) == GLFW_PRESS;
  input.in_window = glfwGetWindowAttrib(window_, GLFW_HOVERED) == GLFW_TRUE;
  glm::dvec2 cursor;
  glfwGetCursorPos(window_, &cursor.x, &cursor.y);
  const glm::dvec2 size = size_in_units(window_);
  const PicturePlace place = place_of_picture(size, picture_aspect_);
  const glm::dvec2 share = (cursor - place.corner) / place.size;
  input.cursor = {2.0 * share.x - 1.0, 1.0 - 2.0 * share.y};
  const PictureSize pixels = size_px();
  input.cursor_px = cursor * glm::dvec2(pixels.width, pixels.height) / size;
  if (known_cursor_) {
    const glm::dvec2 by = (cursor - last_cursor_) / size.y;
    input.dragged = {by.x, -by.y};
    input.moved = cursor != last_cursor_;
  }
  last_cursor_ = cursor;
  known_cursor_ = true;
  return input;
}

bool Window::closed() const {
  return !display_is_lost() && glfwWindowShouldClose(window_) == GLFW_TRUE;
}

bool Window::lost() const {
  return display_is_lost();
}

PictureSize Window::size_px() const {
  PictureSize size;
  if (display_is_lost()) return size;
  glfwGetFramebufferSize(window_, &size.width, &size.height);
  return size;
}

double Window::scale() const {
  float across = 1.0F, down = 1.0F;
  if (display_is_lost()) return 1.0;
  glfwGetWindowContentScale(window_, &across, &down);
  return std::clamp(double(std::max(across, down)), 1.0, 3.0);
}

PicturePlace place_of_picture(glm::dvec2 window_size, double aspect) {
  if (!(aspect > 0.0)) return {{0.0, 0.0}, window_size};
  glm::dvec2 size(window_size.x, window_size.x / aspect);
  if (size.y > window_size.y) size = {window_size.y * aspect, window_size.y};
  return {0.5 * (window_size - size), size};
}

}  // namespace palpate::desktop
