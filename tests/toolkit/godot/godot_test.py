#!/usr/bin/env python3
"""The extension for Godot in a real engine: built as its README says, loaded, felt and seen.
usage: godot_test.py SOURCE BUILD [NAME...]; NAME: only these tests. Exits with 77 where it can not run."""

import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
import hosts_test  # noqa: E402

source, build = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
here = Path(__file__).resolve().parent


def output(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


class Host:
    """An engine, and a project with the extension."""

    def __init__(self, folder):
        self.folder = folder
        root = Path(subprocess.run([here / "godot_root.sh"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip())
        libraries = root / "usr/lib/x86_64-linux-gnu"
        self.environment = {**os.environ, "HOME": str(folder / "home"), "VK_DRIVER_FILES": str(root / "lavapipe.json")}
        (folder / "home").mkdir()
        # The engine's own libraries first, then those of this machine, which palpate was built with.
        self.command = [libraries / "ld-linux-x86-64.so.2", "--library-path",
                        f"{libraries}:{libraries}/pulseaudio:{folder}/prefix/lib:/usr/lib/x86_64-linux-gnu", root / "usr/bin/godot"]
        self.project = folder / "project"
        self.build_extension()

    def build_extension(self):
        # CMake's list of installed files must not replace that of a user's own installation.
        script = self.folder / "install.cmake"
        script.write_text((build / "cmake_install.cmake").read_text().replace(f'file(WRITE "{build}/', f'file(WRITE "{self.folder}/'))
        for component in ("palpate_library", "palpate_development"):
            output("cmake", f"-DCMAKE_INSTALL_PREFIX={self.folder}/prefix", f"-DCMAKE_INSTALL_COMPONENT={component}", "-P", script)
        start = self.folder / "godot"
        start.write_text("#!/bin/sh\nexec " + " ".join(str(part) for part in self.command) + ' "$@"\n')
        start.chmod(0o755)
        made = self.folder / "extension"
        output("cmake", "-S", self.folder / "prefix/share/palpate/godot", "-B", made, f"-DCMAKE_PREFIX_PATH={self.folder}/prefix", f"-DGODOT={start}",
               env=self.environment)
        output("cmake", "--build", made)
        shutil.copytree(here / "project", self.project)
        output("cmake", "--install", made, "--prefix", self.project)
        # What the editor writes when it opens a project.
        (self.project / ".godot").mkdir()
        (self.project / ".godot/extension_list.cfg").write_text("res://addons/palpate/palpate.gdextension\n")

    def start(self, *arguments):
        return subprocess.Popen([str(part) for part in [*self.command, "--headless", "--path", self.project, *arguments]], env=self.environment)

    def keep(self, name):
        """A file; in the folder PALPATE_GODOT_KEEPS, to be looked at after the tests."""
        return Path(os.environ.get("PALPATE_GODOT_KEEPS") or self.folder).resolve() / name

    def run(self, *arguments, headless=True):
        """Runs the engine; the result that the script printed, and all text."""
        display = [] if headless else ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24"]
        options = ["--headless"] if headless else ["--rendering-driver", "vulkan", "--audio-driver", "Dummy", "--resolution", "384x384"]
        done = subprocess.run([str(part) for part in [*display, *self.command, *options, "--path", self.project, *arguments]], env=self.environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)
        assert done.returncode == 0, f"The engine ended with {done.returncode}:\n{done.stdout}"
        assert "ERROR" not in done.stdout, done.stdout
        results = [line[len("RESULT "):] for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        return (json.loads(results[0]) if results else None), done.stdout


def test_forces(host):
    """What is recorded by the program replays in the nodes, and the other way round, bit for bit."""
    of_program, of_nodes = host.folder / "program.ticks", host.folder / "nodes.ticks"
    output(build / "palpate", "feel", "shell", "--device", "simulated", "--headset", "off", "--black-box", "off", "--seconds", "3", "--record", of_program)
    said, text = host.run("--script", "forces.gd", "--", of_program, of_nodes)
    assert said["replay"]["different"] == 0 and said["replay"]["ticks"] > 1000, said
    assert not said["replay"]["is_cut_off"], said
    assert "recording" in said["wrong"]["error"], said
    assert said["most_n"] > 0.5 and said["is_touching"] and said["signals"][0] is True, said
    # The shell is pushed along palpate's -z: its force is along +z, which the scene turns to Godot's +x.
    x, y, z = said["along"]
    assert x > 5 * abs(y) and x > 5 * abs(z), said
    assert "starting" in said["causes"] and said["causes"][-1] == "", said
    replayed = output(build / "palpate", "feel", "shell", "--replay", of_nodes)
    assert "every output is the recorded one, bit by bit" in replayed, replayed


def test_pictures(host):
    """The engine's picture is the program's, and the engine's own surfaces hide what is behind them."""
    of_program = host.folder / "program.png"
    output(build / "palpate", "view", "heart", "--picture", of_program, "--no-slices", "--picture-size", "384", "--quiet")
    said, text = host.run("--script", "pictures.gd", "--", of_program, *map(host.keep, ("alone.png", "before.png", "behind.png")), "", "", "heart", headless=False)
    assert "failed" not in said and said["peak_snr"] > 40, said
    blue = 0x0000FF
    with_cube, alone = said["before"]
    assert with_cube == blue and alone != blue, said
    with_cube, alone = said["behind"]
    assert with_cube == alone, said


def test_real_heart(host):
    """The recording and the picture that the other hosts are tested with: the same forces and the same picture."""
    shared = source.parent / "shared/data"
    if not (shared / "heart_cine").exists():
        print(f"no recording of a real heart was replayed: there is none in {shared}")
        return
    heart = hosts_test.Heart(build / "palpate", shared, host.folder, 384)
    said, text = host.run("--script", "pictures.gd", "--", heart.picture, *map(host.keep, ("heart.png", "heart_before.png", "heart_behind.png")),
                          heart.recording, heart.fields, *heart.frames, headless=False)
    assert "failed" not in said and said["replay"]["ticks"] > 2000 and said["replay"]["different"] == 0, said
    assert said["peak_snr"] > 40, said
    print(f"{said['replay']['ticks']} ticks are the same; picture {said['peak_snr']:.1f} dB")


class Monado:
    """A simulated headset, whose head moves, with the pictures of both eyes beside each other in a window of its own screen."""

    def __init__(self, folder):
        found = subprocess.run([here.parents[1] / "xr" / "monado_root.sh"], stdout=subprocess.PIPE, text=True, check=True)
        self.root = Path(found.stdout.strip())
        self.folder = folder / "xdg"
        self.folder.mkdir(mode=0o700)
        read, write = os.pipe()
        self.screen = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1024x768x24"], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            self.display = ":" + told.readline().strip()
        libraries = self.root / "usr/lib/x86_64-linux-gnu"
        # Both programs need one driver, for the images that they share.
        self.environment = {"DISPLAY": self.display, "XDG_RUNTIME_DIR": str(self.folder), "XR_RUNTIME_JSON": str(self.root / "monado.json"),
                            "VK_ICD_FILENAMES": str(self.root / "lavapipe.json"), "VK_DRIVER_FILES": str(self.root / "lavapipe.json")}
        own = {"PATH": "/usr/bin:/bin", "HOME": str(self.folder), "VK_LOADER_LAYERS_DISABLE": "*", "XRT_NO_STDIN": "1", "SIMULATED_ENABLE": "1",
               "XRT_COMPOSITOR_FORCE_XCB": "1"}
        paths = ":".join(str(path) for path in (libraries, self.root / "usr/lib", libraries / "blas", libraries / "lapack", libraries / "pulseaudio"))
        self.service = subprocess.Popen([libraries / "ld-linux-x86-64.so.2", "--library-path", paths, self.root / "usr/bin/monado-service"],
                                        env={**own, **self.environment}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for(lambda: (self.folder / "monado_comp_ipc").exists(), "Monado starts")

    def end(self):
        for process in (self.service, self.screen):
            process.kill()
            process.wait()

    def counts(self):
        """Pixels of the heart, and bluest and greenest ones, in each eye's half of its window of 640 x 360."""
        whole = subprocess.run(["xwd", "-root", "-silent", "-display", self.display], capture_output=True, check=True).stdout
        header = struct.unpack(">25I", whole[:100])
        bytes_per_pixel, bytes_per_line = header[11] // 8, header[12]
        pixels = whole[header[0] + 12 * header[19]:]
        halves = []
        for first in (0, 320):
            heart = blue = green = 0
            for y in range(360):
                for x in range(first, first + 320):
                    at = y * bytes_per_line + x * bytes_per_pixel
                    b, g, r = pixels[at:at + 3]
                    heart += r > b + 25 and r > g + 10 and g > 30
                    blue += b > 200 and r + g < 100
                    green += g > 200 and r + b < 100
            halves.append({"heart": heart, "blue": blue, "green": green})
        return halves


def wait_for(holds, what, seconds=120):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.1)


def test_headset(host):
    """Both eyes of a moving head see the volume where the engine's own surfaces are."""
    monado = Monado(host.folder)
    shown, over = host.folder / "shown", host.folder / "over"
    overridden = host.project / "override.cfg"
    overridden.write_text("[xr]\nshaders/enabled=true\n")
    command = [*host.command, "--rendering-driver", "vulkan", "--audio-driver", "Dummy", "--position", "700,400", "--resolution", "64x64", "--xr-mode", "on",
               "--path", host.project, "--script", "headset.gd", "--", shown, over, "heart"]
    libraries = str(command[2]).replace(f"{host.folder}/prefix/lib:", f"{host.folder}/prefix/lib:{monado.root}/usr/lib/x86_64-linux-gnu:")
    command[2] = libraries
    engine = subprocess.Popen([str(part) for part in command], env={**host.environment, **monado.environment}, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    try:
        wait_for(lambda: shown.exists() or engine.poll() is not None, "the volume is shown")
        wait_for(lambda: engine.poll() is not None or all(half["heart"] > 500 for half in monado.counts()), "both eyes see the heart")
        seen = []
        for _ in range(8):
            seen.append(monado.counts())
            time.sleep(0.5)
        over.touch()
        said = engine.communicate(timeout=60)[0]
    finally:
        engine.kill()
        monado.end()
        overridden.unlink()
    assert engine.returncode == 0 and 'RESULT {}' in said, said
    for halves in seen:
        for half in halves:
            assert half["green"] == 0, f"what is inside the heart is seen: {seen}"
    assert all(max(halves[eye]["blue"] for halves in seen) > 20 for eye in (0, 1)), f"what is before the heart is hidden: {seen}"


def test_editor(host):
    """The editor shows options with their ranges, previews, and loads the library again while a preview is open."""
    said, text = host.run("--editor")
    assert said["rows"]["max_force_n"] == [1, "0.01,100.0,0.0001,suffix:N", 6 + 16 + 32], said
    assert said["rows"]["friction"] == [1, "0.0,10.0,0.0001", 6], said
    assert said["rows"]["hand"] == [2, "human,loose,firm,none", 6], said
    assert said["reloaded"] == 0 and said["kept"] == 2.5 and said["closed"] and said["is_open"], said


def test_cycles(host):
    """A thousand scenes come and go, a fifth of them while they still open: memory stays, and the engine ends with one that is open."""
    said, text = host.run("--script", "cycles.gd", "--", 1000, "none")
    assert said["opened"] == 800, said
    early, late = said["kb"][10], said["kb"][-1]
    assert late - early < 2000, said["kb"]
    # With pictures and a Vulkan device.
    said, text = host.run("--script", "cycles.gd", "--", 10, "", headless=False)
    assert said["opened"] == 8, said


def test_kill(host):
    """The engine is killed while a device pushes with 2.5 N: its motors are off within 20 ms."""
    service = host.folder / "haply_service"
    output("g++", "-std=c++20", "-O1", "-I", source, here / "haply_service.cpp", source / "tests/devices/emulated_haply.cpp", "-pthread", "-o", service)
    with subprocess.Popen([service], stdout=subprocess.PIPE, text=True) as device:
        engine = host.start("--script", "device.gd", "--", f"haply@127.0.0.1:{int(device.stdout.readline())}")
        force_n = device.stdout.readline()
        engine.kill()
        killed_ns = time.monotonic_ns()
        off_ns = device.stdout.readline()
        engine.wait()
    assert float(force_n) >= 2.5, "The device never pushed"
    after_ms = 1e-6 * (int(off_ns) - killed_ns)
    assert after_ms < 20, f"The motors went off {after_ms} ms after the end of the engine"
    print(f"killed at {float(force_n)} N, off after {after_ms:.1f} ms")


tests = {name[len("test_"):]: function for name, function in dict(globals()).items() if name.startswith("test_")}


def main():
    if os.environ.get("PALPATE_GODOT") != "1":
        print("SKIPPED: PALPATE_GODOT=1 runs the tests in Godot, which fetch it from Debian forky.")
        return 77
    found = subprocess.run([here / "godot_root.sh"], stdout=subprocess.PIPE)
    if found.returncode:
        return found.returncode
    with tempfile.TemporaryDirectory() as folder:
        host = Host(Path(folder))
        for name in sys.argv[3:] or tests:
            tests[name](host)
            print(f"{name}: passed", flush=True)
    return 0


sys.exit(main())
