#!/usr/bin/env python3
"""palpate.dll, cross-built by the preset `windows`, under Wine: forces of a recording bit for bit, its picture, fields of real pairs, and the sentences for
wrong files are those of this machine's libpalpate.so. The plugin for Unity draws in its fake host, where GoogleTest's sources were there.
usage: windows_test.py PALPATE SHARED-DATA BUILD WINDOWS
  BUILD    where libpalpate.so is
  WINDOWS  where palpate.dll and libpalpate.dll.a are
Exits with 77 where there is no such library, Wine, MinGW, Xvfb, or data. What Windows itself does, this test does not know: no real time, no force
device and no headset are under Wine."""

import contextlib
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(HERE.parent / "hosts"))
import hosts_test as hosts  # noqa: E402

COMPILER = "x86_64-w64-mingw32-gcc-posix"
FIELDS_WITHIN_VOXEL = 0.02


def skip(why: str) -> None:
    print(f"SKIPPED: {why}")
    sys.exit(77)


def field_of(file: Path) -> tuple:
    """The floats of an NRRD with detached or attached raw data, and the smallest spacing, mm."""
    head, _, body = file.read_bytes().partition(b"\n\n")
    fields = dict(line.split(b": ", 1) for line in head.splitlines() if b": " in line)
    assert fields[b"encoding"] == b"raw" and fields[b"type"] == b"float", fields
    directions = fields[b"space directions"].replace(b"none", b"").decode().split(") (")
    spacing = min(sum(float(x) ** 2 for x in way.strip("() ").split(",")) ** 0.5 for way in directions)
    return struct.unpack(f"<{len(body) // 4}f", body), spacing


def compare_fields(one: Path, other: Path) -> float:
    """The largest difference, in voxels."""
    (a, spacing), (b, _) = field_of(one), field_of(other)
    assert len(a) == len(b) and len(a) > 3000, (len(a), len(b))
    return max(sum((a[k + c] - b[k + c]) ** 2 for c in range(3)) ** 0.5 for k in range(0, len(a), 3)) / spacing


@contextlib.contextmanager
def wine(windows: Path):
    """The environment in which Wine runs programs. Wine's Vulkan comes with its windows, so there is a screen."""
    for tool in ("wine", "Xvfb", COMPILER):
        if not shutil.which(tool):
            skip(f"{tool} is needed")
    read_end, write_end = os.pipe()
    with subprocess.Popen(["Xvfb", "-displayfd", str(write_end), "-screen", "0", "1280x800x24"], pass_fds=[write_end], stderr=subprocess.DEVNULL) as screen:
        try:
            os.close(write_end)
            with os.fdopen(read_end) as told:
                display = f":{told.readline().strip()}"
            # Names of files are UTF-8 to Wine, too.
            environment = {**os.environ, "DISPLAY": display, "WINEPREFIX": str(windows / "wine"), "WINEDEBUG": "-all", "LC_ALL": "C.UTF-8"}
            # The first program makes the folder, and says so.
            hosts.output("wine", "cmd", "/c", "exit", env=environment)
            yield environment
        finally:
            screen.terminate()


class Hosts:
    """The two programs in C, for this machine and for Windows; both are given paths relative to one folder."""

    def __init__(self, build: Path, windows: Path, folder: Path, environment: dict):
        self.folder = folder
        self.environment = {**environment, "LD_LIBRARY_PATH": str(build)}
        shutil.copy(windows / "palpate.dll", folder)
        include = f"-I{ROOT / 'integration/toolkit'}"
        for name, source in (("replay_host", HERE.parent / "hosts/replay_host.c"), ("motion_host", HERE / "motion_host.c")):
            hosts.output("cc", "-std=c99", "-O2", include, "-o", folder / name, source, f"-L{build}", "-lpalpate", "-lm")
            hosts.output(COMPILER, "-std=c99", "-O2", include, "-static", "-o", folder / f"{name}.exe", source, windows / "libpalpate.dll.a")

    def run(self, name: str, *arguments, makes: str = "") -> tuple:
        """What both say. A file that both make is afterwards called "linux NAME" and "windows NAME"."""
        told = []
        for system, command in (("linux", [f"./{name}"]), ("windows", ["wine", f"{name}.exe"])):
            told.append(hosts.output(*command, *arguments, cwd=self.folder, env=self.environment).replace("\r", ""))
            if makes:
                (self.folder / makes).rename(self.folder / f"{system} {makes}")
        return tuple(told)


def wrong_files(folder: Path, shared: Path) -> list:
    whole = (shared / "heart_cine/frame_00.mha").read_bytes()
    made = {"empty.mha": b"", "cut off.mha": whole[:len(whole) // 2], "no header.nrrd": b"\x00\x01\x02 nothing", "words.nii": b"words" * 200,
            "sizes.mha": whole.replace(b"DimSize = ", b"DimSize = 9", 1), "damaged.nii.gz": b"\x1f\x8b\x08\x00" + b"damage" * 100}
    for name, content in made.items():
        (folder / name).write_bytes(content)
    return [*made, "is not there.mha", "no folder/frame.mha"]


def main() -> None:
    palpate, shared, build, windows = (Path(path).resolve() for path in sys.argv[1:5])
    if not (windows / "palpate.dll").exists():
        skip(f"{windows} has no palpate.dll: cmake/windows/dependencies.sh, then cmake --preset windows and cmake --build --preset windows")
    if not (shared / "lung/pair_fixed.mha").exists():
        skip(f"there is no lung in '{shared}'")
    with wine(windows) as environment, tempfile.TemporaryDirectory(prefix="windows ") as made:
        folder = Path(made)
        both = Hosts(build, windows, folder, environment)
        for name in ("lung", "heart_cine", "liver", "kit"):
            (folder / name).symlink_to(shared / name)

        heart = hosts.Heart(palpate, shared, folder, hosts.SIZE)
        frames = [frame.relative_to(shared) for frame in heart.frames]
        for name, said in zip(("Linux", "Windows"), both.run("replay_host", "motion", "heart.ticks", "drawn.ppm", hosts.SIZE, *frames, makes="drawn.ppm")):
            said = json.loads(said)
            print(f"{name}: {said['ticks']} ticks, {said['different']} of them different")
            assert said["ticks"] > 2000 and said["different"] == 0, said
        reference = hosts.read_png(heart.picture)[:3 * hosts.SIZE * hosts.SIZE]
        agrees = hosts.peak_snr_db(reference, hosts.read_ppm(folder / "windows drawn.ppm"))
        print(f"Windows' picture agrees with the program's to {agrees:.1f} dB")
        assert agrees >= 40.0

        for preset, pair in (("fast", frames[:2]), ("balanced", ["lung/pair_fixed.mha", "lung/pair_moving.mha"]),
                             ("balanced", ["kit/tooth_affine/fixed.mha", "kit/tooth_affine/moving.mha"]), ("balanced", ["liver/19/fixed.mha", "liver/19/moving_1.mha"])):
            said = both.run("motion_host", preset, "field.nrrd", *pair, makes="field.nrrd")
            differ = compare_fields(folder / "linux field.nrrd", folder / "windows field.nrrd")
            seconds = [json.loads(one)["seconds"] for one in said]
            print(f"{pair[0]}, {preset}: the fields differ by {differ:.2g} voxel at most; {seconds[0]:.1f} s, under Wine {seconds[1]:.1f} s")
            assert differ <= FIELDS_WITHIN_VOXEL

        if (windows / "unity_plugin_test.exe").exists():
            told = hosts.output("wine", "unity_plugin_test.exe", cwd=windows, env=environment)
            assert "[  PASSED  ] 2 tests." in told, told
            print("the plugin for Unity passes its test")

        linux, told = both.run("motion_host", *wrong_files(folder, shared))
        print(told)
        assert told.replace("\\", "/") == linux and linux.count("\n") == 8 and "read\n" not in linux, (linux, told)


if __name__ == "__main__":
    main()
