#!/usr/bin/env bash
# Makes a folder with Godot 4 and all that it needs from Debian forky, see tests/support/foreign_root.sh. Prints the folder; prints the reason and exits
# with 77 if it can not be made.
# usage: godot_root.sh
# environment: PALPATE_GODOT_ROOT (where to).
set -euo pipefail

root=${PALPATE_GODOT_ROOT:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/palpate/godot-forky}
"$(dirname "$0")/../../support/foreign_root.sh" "$root" forky usr/bin/godot godot mesa-vulkan-drivers libvulkan1
