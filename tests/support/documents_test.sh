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
# Every link of the pages for readers leads to a file, and to a heading where it names one.
python3 - <<'PYTHON' || failed=1
import re, sys
from pathlib import Path

def anchors(page):
    found = set()
    inside = False
    for line in page.read_text().splitlines():
        inside ^= line.startswith("```")
        if not inside and line.startswith("#"):
            title = re.sub(r"[`*]|\]\([^)]*\)|\[", "", line.lstrip("#").strip()).lower()
            found.add(re.sub(r"[^\w\- ]", "", title).replace(" ", "-"))
    return found

wrong = []
for page in [Path("README.md"), Path("CONTRIBUTING.md"), Path("CHANGELOG.md"), *sorted(Path("docs").rglob("*.md"))]:
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    for to in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", to):
            continue
        path, _, heading = to.partition("#")
        target = (page.parent / path) if path else page
        if not target.exists():
            wrong.append(f"{page} links to {to}, which is not there.")
        elif heading and target.suffix == ".md" and heading not in anchors(target):
            wrong.append(f"{page} links to {to}: there is no such heading.")
print("\n".join(wrong), end="\n" if wrong else "")
sys.exit(bool(wrong))
PYTHON
# `Class::function`, `Suite.Test`, `Suite.*`, `Test...`, `file.cpp`: the part without class and suite.
while read -r name; do
  grep -rqF --include='*.h' --include='*.cpp' -- "$name" module integration/devices tests || [[ -n $(find module tests -name "$name") ]] ||
    { echo "docs/force-limits.md names $name, which is not there."; failed=1; }
done < <(grep -oE '`[^`]+`' docs/force-limits.md | grep -v / | tr -d '`' | sed -E 's/\.\*$|\.\.\.$|\(\)$//; s/^[A-Z][A-Za-z]*\.//; s/.*:://' | sort -u)
exit $failed
