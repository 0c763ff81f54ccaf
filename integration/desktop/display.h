#pragma once

namespace palpate::desktop {

/// Whether there is a screen for a window.
bool has_display();

/// When the connection to the X server breaks (it crashed, or an ssh tunnel ended), Xlib prints a
/// sentence of its own and ends the process from within whatever was called. The force would end
/// without a ramp and a recording without its end. After this call the connection is only marked as
/// lost and calls return; nothing more may be asked of the display then, not even to close the
/// window. To be called after glfwInit(), from the thread of the window. Does nothing where the
/// window is not X11's.
void survive_display_loss();

/// True from the loss on. Any thread.
bool display_is_lost() noexcept;

}  // namespace palpate::desktop
