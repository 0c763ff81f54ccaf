#!/usr/bin/env python3
"""One recording of a real heart in every host: each gives the program's forces bit for bit, and its picture to 40 dB.
usage: hosts_test.py PALPATE SHARED-DATA C-HOST [CSHARP-HOST MONO] [PYTHON MODULE-FOLDER]; a host that is not built is ''
Exits with 77 where the data are missing. Godot's own test takes the same recording."""

import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

SIZE = 256


def output(*command, **options) -> str:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, f"{command} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


class Heart:
    """Four frames of a beating heart, their motion, a recording of a hand that strokes it, and the program's picture of the first frame."""

    def __init__(self, palpate: Path, shared: Path, folder: Path, size: int):
        self.frames = [shared / "heart_cine" / f"frame_{k:02}.mha" for k in (0, 5, 10, 15)]
        self.fields, self.recording, self.picture = folder / "motion", folder / "heart.ticks", folder / "program.png"
        output(palpate, "motion", *self.frames, "--cyclic", "--preset", "fast", "--output", self.fields, "--quiet")
        output(palpate, "feel", *self.frames, "--fields", self.fields, "--device", "simulated", "--path", "stroke", "--seconds", "4", "--headset", "off",
               "--black-box", "off", "--quiet", "--record", self.recording)
        output(palpate, "view", *self.frames, "--fields", self.fields, "--picture", self.picture, "--picture-size", size, "--show-wall",
               "--no-slices", "--quiet")


def peak_snr_db(one: bytes, other: bytes) -> float:
    """Of two pictures with 8 bits per channel."""
    assert len(one) == len(other), f"{len(one)} and {len(other)} bytes"
    error = sum((a - b) ** 2 for a, b in zip(one, other)) / len(one)
    return 10.0 * math.log10(255.0 ** 2 / error) if error else math.inf


def read_ppm(file: Path) -> bytes:
    """R, G, B of each pixel, rows from the top."""
    return file.read_bytes()[-3 * SIZE * SIZE:]


def read_png(file: Path) -> bytes:
    """The same; of a file with 8 bits per channel and no interlacing."""
    whole, at, parts = file.read_bytes(), 8, {b"IDAT": b""}
    while at < len(whole):
        length, kind = struct.unpack(">I4s", whole[at:at + 8])
        parts[kind] = parts.get(kind, b"") + whole[at + 8:at + 8 + length]
        at += length + 12
    width, height, bits, colours, *_, interlaced = struct.unpack(">IIBBBBB", parts[b"IHDR"])
    assert (bits, interlaced) == (8, 0) and colours in (2, 6), (bits, interlaced, colours)
    channels = 3 if colours == 2 else 4
    lines, row = zlib.decompress(parts[b"IDAT"]), bytearray(width * channels)
    pixels = bytearray()
    for y in range(height):
        begin = y * (width * channels + 1)
        above, row, how = row, bytearray(lines[begin + 1:begin + 1 + width * channels]), lines[begin]
        for x, value in enumerate(row):
            left, up = (row[x - channels], above[x - channels]) if x >= channels else (0, 0)
            paeth = min((left, above[x], up), key=lambda near: abs(left + above[x] - up - near))
            row[x] = value + (0, left, above[x], (left + above[x]) // 2, paeth)[how] & 255
        for x in range(width):
            pixels += row[x * channels:x * channels + 3]
    return bytes(pixels)


def main() -> None:
    palpate, shared, c_host, cs_host, mono, python, module = (sys.argv[1:] + [""] * 7)[:7]
    if not (Path(shared) / "heart_cine" / "frame_00.mha").exists():
        print(f"SKIPPED: there is no beating heart in '{shared}'")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="hosts ") as made:
        folder = Path(made)
        heart = Heart(Path(palpate), Path(shared), folder, SIZE)
        # Below the volume stands the legend of its wall.
        reference = read_png(heart.picture)[:3 * SIZE * SIZE]
        told = json.loads(output(c_host, heart.fields, heart.recording, folder / "c.ppm", SIZE, *heart.frames))
        eye, turn, middle = (",".join(map(repr, told[key])) for key in ("eye_m", "turn", "middle_m"))
        hosts = {"C": (told, folder / "c.ppm")}
        if cs_host:
            hosts["C#"] = (json.loads(output(mono, cs_host, heart.fields, heart.recording, folder / "cs.ppm", SIZE, eye, turn, *heart.frames)),
                           folder / "cs.ppm")
        if python:
            hosts["Python"] = (json.loads(output(python, Path(__file__).with_name("replay_host.py"), heart.fields, heart.recording, folder / "py.ppm", SIZE,
                                                 eye, middle, *heart.frames, env={**os.environ, "PYTHONPATH": module})), folder / "py.ppm")
        for name, (said, picture) in hosts.items():
            agrees = peak_snr_db(reference, read_ppm(picture))
            print(f"{name}: {said['ticks']} ticks, {said['different']} of them different; picture {agrees:.1f} dB")
            assert said["ticks"] > 2000 and said["different"] == 0, said
            assert agrees >= 40.0, f"{name}'s picture"


if __name__ == "__main__":
    main()
