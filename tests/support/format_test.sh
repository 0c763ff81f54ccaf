#!/usr/bin/env bash
# Prints the files that clang-format would change, and what to do. With Debian 12's version: others differ in details.
# usage: format_test.sh ROOT
set -euo pipefail
cd "$1"
command -v clang-format >/dev/null || { echo "SKIPPED: clang-format is not installed"; exit 77; }
[[ $(clang-format --version) == *" 14."* ]] || { echo "SKIPPED: this is another version: $(clang-format --version)"; exit 77; }
changed=$(find compute module integration shaders tests docs \( -name '*.cpp' -o -name '*.h' \) -print0 |
  xargs -0 -P "$(nproc)" -n 20 clang-format --dry-run 2>&1 | sed -n 's/^\([^:]*\):[0-9]*:.*warning.*/\1/p' | sort -u)
[[ -z $changed ]] || { echo "Not as .clang-format says; run clang-format -i on:"; echo "$changed"; exit 1; }
