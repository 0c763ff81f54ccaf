#!/usr/bin/env bash
# Every path that CONTRIBUTING.md, docs/architecture.md and docs/force-limits.md name exists, and so does everything else that the last one
# names: functions, tests, causes.
# usage: documents_test.sh ROOT
set -euo pipefail
cd "$1"
failed=0
for page in CONTRIBUTING.md docs/architecture.md docs/force-limits.md; do
  while read -r path; do
    [[ -e $path ]] || { echo "$page names $path, which is not there."; failed=1; }
  done < <(grep -oE '`[a-z]+/[A-Za-z0-9_./-]*`' $page | tr -d '`' | sort -u)
  while read -r path; do
    [[ -e $(dirname $page)/$path ]] || { echo "$page links to $path, which is not there."; failed=1; }
  done < <(grep -oE '\]\([^)h][^)]*\)' $page | sed 's/^](//; s/)$//' | sort -u)
done
# `Class::function`, `Suite.Test`, `Suite.*`, `Test...`, `file.cpp`: the part without class and suite.
while read -r name; do
  grep -rqF --include='*.h' --include='*.cpp' -- "$name" module integration/devices tests || [[ -n $(find module tests -name "$name") ]] ||
    { echo "docs/force-limits.md names $name, which is not there."; failed=1; }
done < <(grep -oE '`[^`]+`' docs/force-limits.md | grep -v / | tr -d '`' | sed -E 's/\.\*$|\.\.\.$|\(\)$//; s/^[A-Z][A-Za-z]*\.//; s/.*:://' | sort -u)
exit $failed
