#!/usr/bin/env bash
# Makes a folder with Monado and all that it needs from Debian trixie, or on a newer Debian from that one, see tests/support/foreign_root.sh. Prints
# the folder; prints the reason and exits with 77 if it can not be made.
# usage: monado_root.sh
# environment: PALPATE_MONADO_ROOT (where to).
set -euo pipefail

release=trixie
# The tests' own programs run with the folder's libraries, which must not be older than those that they were linked with.
case $(. /etc/os-release && echo "${VERSION_CODENAME:-}") in forky | sid) release=forky ;; esac
root=${PALPATE_MONADO_ROOT:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/palpate/monado-$release}
"$(dirname "$0")/../support/foreign_root.sh" "$root" "$release" usr/bin/monado-service \
  monado-service libopenxr1-monado mesa-vulkan-drivers libopenxr-loader1
# The manifest with which the loader finds the runtime, with an absolute path.
printf '{"file_format_version": "1.0.0", "runtime": {"library_path": "%s"}}\n' \
  "$root/usr/lib/x86_64-linux-gnu/libopenxr_monado.so" >"$root/monado.json.$$"
mv "$root/monado.json.$$" "$root/monado.json"
