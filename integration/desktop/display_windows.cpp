#include "integration/desktop/display.h"

namespace palpate::desktop {

bool has_display() {
  return true;
}

// A program and its windows have one system there.
void survive_display_loss() {}

bool display_is_lost() noexcept {
  return false;
}

}  // namespace palpate::desktop
