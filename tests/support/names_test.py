"""The naming rules of .clang-tidy over the whole tree.

clang-tidy takes 10 minutes of a core for all files one by one, since each parses the same headers again. Here the .cpp
files of a folder are parsed as one: half of that. Where two of them have a helper of the same name the parser goes on
after the error, and what it passes over is not checked: 24 of 15,151 names of compute and module.

A file that was found right is not checked again until it, the rules or this script change: what a file declares stands in
its own text. The list of such files is kept beside the compiler's cache, so that it outlives the build folder.

usage: names_test.py SOURCE_DIR BUILD_DIR
"""

import concurrent.futures
import functools
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
# Filters for ITK and VTK, named as ITK and VTK name theirs.
FOREIGN = ("integration/toolkit/itk/", "integration/toolkit/vtk/")
# What is parsed as one includes the same large headers; the first that matches. X11 has macros that break other headers.
GROUPS = ["compute/", "module/", "integration/desktop/", "integration/toolkit/", "integration/", "tests/desktop/",
          "tests/lab/", "tests/", "docs/"]


def compiled_files(root, build):
    """{path: flags} of every .cpp file of the tree that the build compiles. Flags: include folders and macros."""
    with open(os.path.join(build, "compile_commands.json")) as file:
        commands = json.load(file)
    files = {}
    for command in commands:
        path = os.path.realpath(os.path.join(command["directory"], command["file"]))
        paths = [path]
        if "/Unity/" in path:
            # Files that are compiled together: one that includes them.
            with open(path) as unity:
                paths = [line.split('"')[1] for line in unity if line.startswith("#include")]
        flags, words = [], iter(shlex.split(command["command"]))
        for word in words:
            if word == "-isystem":
                flags.append((word, next(words)))
            elif word.startswith(("-I", "-D")):
                flags.append((word,))
        for path in paths:
            if path.startswith(root + "/") and not path.startswith(build + "/") and path.endswith(".cpp"):
                files.setdefault(path, []).extend(flags)
    return files


@functools.cache
def direct_headers(root, path):
    """The headers of the tree that a file includes."""
    with open(path, encoding="utf-8") as file:
        names = re.findall(r'^#include "([^"]+)"', file.read(), re.MULTILINE)
    found = (os.path.join(folder, name) for name in names for folder in (root, os.path.dirname(path)))
    return [header for header in found if os.path.exists(header)]


def all_headers(root, path):
    """Those, and the ones that they include."""
    seen, left = set(), [path]
    while left:
        more = set(direct_headers(root, left.pop())) - seen
        seen |= more
        left += more
    return seen


class Known:
    """The files that were found right: a line for each, of the rules' and the file's own text."""

    def __init__(self, root, build, version):
        # The compiler's cache is what a machine keeps from build to build.
        folder = build
        if shutil.which("ccache"):
            asked = subprocess.run(["ccache", "-k", "cache_dir"], capture_output=True, text=True)
            if asked.returncode == 0 and os.path.isdir(asked.stdout.strip()):
                folder = asked.stdout.strip()
        self.path = os.path.join(folder, "palpate_names")
        self.rules = hashlib.sha256(version.encode())
        for path in (os.path.join(root, ".clang-tidy"), __file__):
            with open(path, "rb") as file:
                self.rules.update(file.read())
        self.lines = set()
        if os.path.exists(self.path):
            with open(self.path, encoding="utf-8") as file:
                self.lines.update(file.read().split())

    def line_of(self, path):
        digest = self.rules.copy()
        with open(path, "rb") as file:
            digest.update(file.read())
        return digest.hexdigest()

    def add(self, paths):
        with open(self.path, "a", encoding="utf-8") as file:
            file.writelines(self.line_of(path) + "\n" for path in sorted(paths))


def check(root, paths, files):
    """What is wrong with the names in these files and the headers of ours that they include, a line each."""
    flags = dict.fromkeys(flag for path in paths for flag in files[path])
    with tempfile.NamedTemporaryFile("w", suffix=".cpp") as unity:
        unity.writelines(f'#include "{path}"\n' for path in paths)
        unity.flush()
        result = subprocess.run(
            ["clang-tidy", "--quiet", "--checks=-*,readability-identifier-naming", f"--config-file={root}/.clang-tidy",
             f"--header-filter=^{re.escape(root)}/(compute|module|integration|tests|shaders|docs)/", unity.name, "--",
             "-std=c++20", "-w", "-ferror-limit=0", *(word for flag in flags for word in flag)],
            capture_output=True, text=True)
    # A missing header hides its declarations; any exit status other than these two is a crash.
    located = {line.replace(root + "/", "") for line in result.stdout.splitlines() if line.startswith(root + "/")}
    wrong = {line for line in located if not line.startswith(FOREIGN)
             and ("[readability-identifier-naming]" in line or "file not found" in line)}
    return wrong if result.returncode in (0, 1) else wrong | {f"clang-tidy failed: {result.stderr}"}


def main():
    root, build = (os.path.realpath(folder) for folder in sys.argv[1:3])
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True).stdout \
        if shutil.which("clang-tidy") else ""
    # Of Debian 12's version: other versions have other rules.
    if " 14." not in version:
        print("SKIPPED: clang-tidy 14 is not installed")
        return SKIPPED
    known = Known(root, build, version)
    files = compiled_files(root, build)
    headers = {path: all_headers(root, path) for path in files}
    everything = set(files).union(*headers.values())
    new = {path for path in everything if known.line_of(path) not in known.lines}
    # A new header is checked through a file that includes it: the one that includes least beside it.
    chosen = new & set(files)
    for header in sorted(new - set(files)):
        if not any(header in headers[path] for path in chosen):
            chosen.add(min((path for path in files if header in headers[path]), key=lambda path: (len(headers[path]), path)))
    groups = {}
    for path in sorted(chosen):
        group = next(group for group in GROUPS if path.startswith(f"{root}/{group}"))
        groups.setdefault(group, []).append(path)
    # The largest first, so that no core waits for one that was started last.
    largest_first = sorted(groups.values(), key=len, reverse=True)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        wrong = set().union(*pool.map(lambda paths: check(root, paths, files), largest_first))
    for line in sorted(wrong):
        print(line)
    # Where clang-tidy did not come to the end, nothing was found right.
    if all("[readability-identifier-naming]" in line for line in wrong):
        known.add(new - {os.path.join(root, line.split(":")[0]) for line in wrong})
    print(f"{len(new)} of {len(everything)} files are new or changed.")
    if wrong:
        print(f"{len(wrong)} places are not as .clang-tidy says.")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
