#!/usr/bin/env bash
# The documentation as a site: the pages of docs, README, CONTRIBUTING and CHANGELOG as they are, and reference pages that are made from the
# program, palpate.h and the Python module. A link that leads nowhere is an error.
# usage: build.sh BUILD    (a build folder with palpate and the Python module; the site is BUILD/site)
set -euo pipefail
build=$(realpath "$1")
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
source=$(realpath "$here/../..")
work=$build/site_work
rm -rf "$work" "$build/site"
mkdir -p "$work/pages/reference"

# Sphinx reads one folder: here it has the source tree's files and the made ones beside each other.
for name in README.md CONTRIBUTING.md CHANGELOG.md docs compute integration module shaders tests; do
  ln -s "$source/$name" "$work/pages/$name"
done

"$build/palpate" write-manual "$work/manual"
/usr/bin/python3 "$here/commands.py" "$work/manual/man1" "$work/pages/reference"
cat >"$work/pages/reference/python.md" <<'PAGE'
# Python module

Made from the module's own documentation.

```{eval-rst}
.. automodule:: palpate
   :members:
```
PAGE
{
  cat <<'PAGE'
# C interface

Made from [`palpate.h`](../integration/toolkit/palpate.h) and [`palpate_mode.h`](../integration/loading/palpate_mode.h). A mode in C has
[a page of its own](../docs/writing-a-mode.md).

```{doxygenfile} palpate.h
:sections: briefdescription detaileddescription
```
PAGE
  # The header's own sections, in its order.
  sed -nE 's|^/\* ---- (.*) ----.*|\1|p' "$source/integration/toolkit/palpate.h" | while read -r title; do
    printf '\n## %s\n\n```{doxygengroup} %s\n:content-only:\n:members:\n```\n' "${title^}" "$(sed -E 's/[^a-z]+/_/g' <<<"$title")"
  done
  printf '\n## Modes of your own\n\n```{doxygenfile} palpate_mode.h\n```\n'
} >"$work/pages/reference/c.md"

(cd "$work" && PALPATE_SOURCE="$source" PALPATE_FILTER="/usr/bin/python3 $here/c_comments.py" doxygen "$here/Doxyfile")

# Debian's Sphinx belongs to Debian's Python.
PALPATE_VERSION=$("$build/palpate" --version | cut -d' ' -f2) PALPATE_XML="$work/xml" PYTHONPATH="$build/python" \
  /usr/bin/python3 -m sphinx -q -W --keep-going -j auto -c "$here" -d "$work/doctrees" "$work/pages" "$build/site"
echo "Wrote     $build/site/index.html"
