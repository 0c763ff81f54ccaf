#!/usr/bin/env bash
# Every path that docs/architecture.md names exists.
# usage: documents_test.sh ROOT
set -euo pipefail
cd "$1"
failed=0
while read -r path; do
  [[ -e $path ]] || { echo "docs/architecture.md names $path, which is not there."; failed=1; }
done < <(grep -oE '`[a-z]+/[A-Za-z0-9_./-]*`' docs/architecture.md | tr -d '`' | sort -u)
while read -r path; do
  [[ -e docs/$path ]] || { echo "docs/architecture.md links to $path, which is not there."; failed=1; }
done < <(grep -oE '\]\([^)h][^)]*\)' docs/architecture.md | sed 's/^](//; s/)$//' | sort -u)
exit $failed
