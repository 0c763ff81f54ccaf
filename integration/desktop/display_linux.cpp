#include "integration/desktop/display.h"

#include <X11/Xlib.h>
#include <dlfcn.h>

#include <atomic>
#include <cstdlib>
#include <initializer_list>

namespace palpate::desktop {
namespace {

std::atomic<bool> is_lost{false};

int on_broken_connection(Display*) {
  is_lost = true;
  return 0;
}

void do_not_exit(Display*, void*) {
  is_lost = true;
}

}  // namespace

bool has_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"})
    if (const char* value = std::getenv(name); value && *value) return true;
  return false;
}

void survive_display_loss() {
  // Asked for by name: GLFW for Wayland has no such function.
  using GetDisplay = Display* (*)();
  const auto get_display = reinterpret_cast<GetDisplay>(dlsym(RTLD_DEFAULT, "glfwGetX11Display"));
  Display* display = get_display ? get_display() : nullptr;
  if (!display) return;
  XSetIOErrorHandler(on_broken_connection);
  XSetIOErrorExitHandler(display, do_not_exit, nullptr);
}

bool display_is_lost() noexcept {
  return is_lost;
}

}  // namespace palpate::desktop
