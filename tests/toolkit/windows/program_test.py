#!/usr/bin/env python3
"""palpate.exe, cross-built by the preset `windows`, under Wine, beside this machine's palpate: what it says of files good and wrong, fields, pictures, a
recording bit for bit, a film, the page of a running scene, a run that Ctrl-C ends.
usage: program_test.py PALPATE SHARED-DATA WINDOWS
  WINDOWS  where palpate.exe is
Exits with 77 where there is no such program, Wine, MinGW, Xvfb, or data."""

import os
import pty
import re
import select
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import windows_test as windows_library
from windows_test import HERE, compare_fields, hosts, skip, wrong_files

MOST_S = 120


class Programs:
    """Both programs, which work in one folder."""

    def __init__(self, palpate: Path, folder: Path, environment: dict):
        self.commands = {"linux": [str(palpate)], "windows": ["wine", "palpate.exe"]}
        self.folder, self.environment = folder, environment

    def run(self, system: str, *words) -> subprocess.CompletedProcess:
        done = subprocess.run([*self.commands[system], *map(str, words)], cwd=self.folder, env=self.environment, capture_output=True, text=True,
                              encoding="utf-8", timeout=MOST_S, check=False)
        done.stdout, done.stderr = (text.replace("\r", "").replace("\\", "/") for text in (done.stdout, done.stderr))
        return done

    def say_the_same(self, *words) -> subprocess.CompletedProcess:
        linux, windows = self.run("linux", *words), self.run("windows", *words)
        assert (windows.returncode, windows.stdout, windows.stderr) == (linux.returncode, linux.stdout, linux.stderr), (words, linux, windows)
        return windows


def speaks_of_files(both: Programs, shared: Path) -> None:
    for name in ("lung/pair_fixed.mha", "heart_cine/lv_00.mha", "kit/tooth_affine/fixed.mha"):
        # Names of files may have any letters, one of them of two units in UTF-16.
        named = f"Lünge 心 𝔸 {Path(name).name}"
        shutil.copy(shared / name, both.folder / named)
        said = both.say_the_same("info", named)
        assert said.returncode == 0 and named in said.stdout, said
    # Shells of Windows leave this to programs; here the program is given it as it is.
    said = both.run("windows", "info", "heart_cine/frame_*.mha")
    assert said.returncode == 0 and said.stdout == both.run("linux", "info", *sorted((both.folder / "heart_cine").glob("frame_*.mha"))).stdout.replace(
        f"{both.folder}/", ""), said
    for name in wrong_files(both.folder, shared):
        said = both.say_the_same("info", name)
        assert said.returncode == 2 and said.stderr.count("\n") == 1, said
    both.say_the_same("motion", "empty.mha")
    both.say_the_same("feel", "heart", "--presst", "fast")
    said = both.run("windows", "devices")
    assert said.returncode == 0 and "simulated device" in said.stdout and "On Windows palpate drives no device on USB itself" in said.stdout, said


def finds_the_same_field(both: Programs) -> None:
    for system in both.commands:
        said = both.run(system, "motion", "lung/pair_fixed.mha", "lung/pair_moving.mha", "--preset", "fast", "--output", f"{system} ü.nrrd")
        assert said.returncode == 0 and "Verdict   ok" in said.stdout, said
    differ = compare_fields(both.folder / "linux ü.nrrd", both.folder / "windows ü.nrrd")
    print(f"the fields differ by {differ:.2g} voxel at most")
    assert differ <= windows_library.FIELDS_WITHIN_VOXEL


def feels_and_draws_the_same(both: Programs, heart: hosts.Heart) -> None:
    frames = [str(frame.relative_to(heart.frames[0].parents[1])) for frame in heart.frames]
    said = both.run("windows", "feel", *frames, "--fields", "motion", "--replay", "heart.ticks")
    assert said.returncode == 0, said
    print(said.stdout.strip().splitlines()[-1])
    said = both.run("windows", "view", *frames, "--fields", "motion", "--picture", "drawn.png", "--picture-size", hosts.SIZE, "--show-wall", "--no-slices",
                    "--quiet")
    assert said.returncode == 0, said
    # Below the volume stands the legend of its wall.
    agrees = hosts.peak_snr_db(*(hosts.read_png(file)[:3 * hosts.SIZE * hosts.SIZE] for file in (heart.picture, both.folder / "drawn.png")))
    print(f"the pictures agree to {agrees:.1f} dB")
    assert agrees >= 40.0
    said = both.run("windows", "feel", *frames, "--fields", "motion", "--device", "simulated", "--seconds", "3", "--headless", "Gefühlt")
    assert said.returncode == 0 and "touching" in said.stdout, said
    assert {"page.png", "view_1.png", "summary.txt"} <= {file.name for file in (both.folder / "Gefühlt").iterdir()}


def writes_a_film(both: Programs) -> None:
    make = ("view", "heart", "--picture-size", 64, "--film")
    said = both.run("windows", *make, "film.webm")
    assert said.returncode == 2 and "needs the program ffmpeg, which is not here" in said.stderr, said
    hosts.output(windows_library.COMPILER, "-O2", "-static", "-o", both.folder / "ffmpeg.exe", HERE / "ffmpeg.c")
    said = both.run("windows", *make, "film.webm")
    assert said.returncode == 0, said
    seconds, rate = re.search(r"([\d.]+) s, (\d+) pictures a second", said.stdout).groups()
    assert int((both.folder / "film.webm").read_text()) == round(float(seconds) * int(rate)) * 4 * 64 * 64, said
    said = both.run("windows", *make, "refused.webm")
    assert said.returncode == 2 and said.stderr == "palpate: ffmpeg could not write the film: It knows no such codec.\n", said
    assert not (both.folder / "refused.webm").exists()


class InATerminal:
    """palpate.exe in a terminal, so that Ctrl-C can be pressed."""

    def __init__(self, both: Programs, *words):
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(both.folder)
            os.execvpe("wine", ["wine", "palpate.exe", *map(str, words)], both.environment)
        self.said = ""

    def hear(self, word: str) -> str:
        """Waits until it has said the word; "": until its end. Wine's terminal writes the codes of a screen between the letters."""
        end = time.monotonic() + MOST_S
        while time.monotonic() < end and not (word and word in self.said):
            if not select.select([self.terminal], [], [], 0.2)[0]:
                continue
            try:
                block = os.read(self.terminal, 4096)
            except OSError:
                block = b""
            if not block:
                break
            # One that moves the cursor stands for a space.
            self.said += re.sub(r"\x1b\[[0-9;?]*([A-Za-z])", lambda code: " " if code[1] in "CH" else "", block.decode("utf-8", "replace"))
        assert not word or word in self.said, self.said
        return self.said

    def press_ctrl_c(self) -> int:
        os.write(self.terminal, b"\x03")
        self.hear("")
        os.kill(self.pid, signal.SIGKILL)  # one that has ended keeps its exit code
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def ends_in_order_when_it_is_interrupted(both: Programs) -> None:
    run = InATerminal(both, "feel", "heart", "--headset", "off", "--device", "simulated", "--path", "press", "--seconds", "100", "--csv", "ticks.csv")
    run.hear("0.1 s")
    time.sleep(4.0)
    code = run.press_ctrl_c()
    assert code == 0, (code, run.said)
    ticks = (both.folder / "ticks.csv").read_text().splitlines()
    names, last = (line.split(",") for line in (next(line for line in ticks if not line.startswith("#")), ticks[-1]))
    force = [float(last[names.index(name)]) for name in names if re.fullmatch(r"force_[xyz](_n)?|f[xyz]_n", name)]
    assert len(ticks) > 1000 and len(force) == 3 and force == [0.0, 0.0, 0.0], (names, last)


def serves_a_page(both: Programs) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    # Through a pipe: a terminal leaves out letters that stand on its screen already.
    with subprocess.Popen([*both.commands["windows"], "serve", "heart", "--web", str(port)], cwd=both.folder, env=both.environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as run:
        try:
            address = next(found[0] for found in (re.search(r"https://127\.0\.0\.1:\d+/[0-9a-f]+/", line) for line in run.stdout) if found)
            context = ssl.create_default_context()
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            with urllib.request.urlopen(address, timeout=30, context=context) as page:
                assert b"<html" in page.read()
        finally:
            run.kill()



def main() -> None:
    palpate, shared, windows = (Path(path).resolve() for path in sys.argv[1:4])
    if not (windows / "palpate.exe").exists():
        skip(f"{windows} has no palpate.exe: cmake/windows/dependencies.sh, then cmake --preset windows and cmake --build --preset windows")
    if not (shared / "lung/pair_fixed.mha").exists():
        skip(f"there is no lung in '{shared}'")
    with windows_library.wine(windows) as environment, tempfile.TemporaryDirectory(prefix="windows ") as made:
        folder = Path(made)
        shutil.copy(windows / "palpate.exe", folder)
        for name in ("lung", "heart_cine"):
            (folder / name).symlink_to(shared / name)
        both = Programs(palpate, folder, environment)
        speaks_of_files(both, shared)
        finds_the_same_field(both)
        heart = hosts.Heart(palpate, shared, folder, hosts.SIZE)
        feels_and_draws_the_same(both, heart)
        writes_a_film(both)
        ends_in_order_when_it_is_interrupted(both)
        serves_a_page(both)


if __name__ == "__main__":
    main()
