#!/usr/bin/env python3
"""The wheel: what is inside, which glibc it needs, no path of the machine that built it, licences, and a program that starts.
usage: wheel_test.py SOURCE BUILD. Exits with 77 where patchelf is missing."""

import hashlib
import base64
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

source, build = map(Path, sys.argv[1:])
if not all(map(shutil.which, ("patchelf", "dpkg", "objdump"))):
    print("SKIPPED: the wheel needs patchelf, dpkg and objdump (Debian: patchelf binutils).")
    sys.exit(77)


def output(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


with tempfile.TemporaryDirectory() as folder:
    wheel = Path(output(sys.executable, source / "integration/toolkit/python/wheel.py", build, folder).strip())
    tagged = re.fullmatch(r"palpate-[\d.]+-(cp3\d+)-\1-manylinux_2_(\d+)_x86_64\.whl", wheel.name)
    assert tagged, wheel.name
    assert wheel.stat().st_size < 40e6, f"{wheel.stat().st_size} bytes are more than 40 MB"
    tree = Path(folder) / "tree"
    archive = zipfile.ZipFile(wheel)
    archive.extractall(tree)
    names = archive.namelist()
    for wanted in ("palpate/__init__.py", "palpate/__init__.pyi", "palpate/__main__.py", "palpate/testing.py", "palpate/py.typed", "palpate/bin/palpate",
                   "palpate_paraview.py", "palpate/lib/libpalpate.so.0", "palpate/include/palpate.h"):
        assert wanted in names, f"{wanted} is missing"

    # The record names every file with its digest.
    record = next(name for name in names if name.endswith("/RECORD"))
    rows = {row.split(",")[0]: row.split(",")[1] for row in archive.read(record).decode().splitlines()}
    assert sorted(rows) == sorted(names)
    for name, digest in rows.items():
        if name != record:
            own = base64.urlsafe_b64encode(hashlib.sha256(archive.read(name)).digest()).rstrip(b"=").decode()
            assert digest == "sha256=" + own, name

    binaries = [tree / name for name in names if archive.read(name)[:4] == b"\x7fELF"]
    inside = {path.name for path in binaries}
    outside = set()
    for path in binaries:
        head = output("objdump", "-p", path)
        outside |= set(re.findall(r"NEEDED\s+(\S+)", head)) - inside
        paths = re.findall(r"(?:RUNPATH|RPATH)\s+(\S+)", head)
        assert all(part.startswith("$ORIGIN") for part in paths), f"{path.name} looks for libraries in {paths}"
        versions = [int(minor) for minor in re.findall(r"GLIBC_2\.(\d+)", output("objdump", "-T", path))]
        assert not versions or max(versions) <= int(tagged[2]), f"{path.name} needs glibc 2.{max(versions)}"
        for place in (source.resolve(), build.resolve(), Path.home()):
            assert place == Path("/") or (str(place) + "/").encode() not in path.read_bytes(), f"{path.name} contains {place}"
    # What every Linux of the tag has, and the Vulkan loader.
    system = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "ld-linux-x86-64.so.2", "libstdc++.so.6", "libgcc_s.so.1",
              "libvulkan.so.1"}
    assert outside <= system, f"the wheel lacks {sorted(outside - system)}"

    licences = [tree / name for name in names if "/licenses/" in name]
    # Named after the packages: Debian 13 has libgdcm3.0t64.
    for wanted in ("palpate", "libusb-1.0-0", "libcairo2", "libgdcm3.0"):
        assert any(re.fullmatch(re.escape(wanted) + r"(t64)?\.txt", path.name) for path in licences), wanted
    assert all(path.stat().st_size > 100 for path in licences)

    # pip gives files their modes from the archive; zipfile does not.
    program = tree / "palpate/bin/palpate"
    assert archive.getinfo("palpate/bin/palpate").external_attr >> 16 & 0o111
    program.chmod(0o755)
    version = output(program, "--version")
    assert output(sys.executable, tree / "palpate/__main__.py", "--version") == version
    assert wheel.name.split("-")[1] == version.split()[1]
print(f"{wheel.name}: {len(names)} files")
