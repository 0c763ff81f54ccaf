#!/usr/bin/env python3
"""Records what palpate produces, and says what differs between two records: for changes that must not change results.

usage: outputs.py record PALPATE FOLDER [--from OLD]   fields, forces, pictures and printed values into FOLDER
       outputs.py compare OLD NEW                      exit status 1 if anything differs, with a line for each

Needs ../shared/data. A run of `feel` depends on the clock, so the forces are those of recordings, replayed: OLD's with --from,
without it new ones. Compared bit by bit; of printed values all but those that depend on the clock and the place. Takes one to three minutes.
"""

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
PAIRS = {"lung": (DATA / "lung/pair_fixed.mha", DATA / "lung/pair_moving.mha"),
         **{name: (DATA / "kit" / name / "fixed.mha", DATA / "kit" / name / "moving.mha")
            for name in ("chestct_sliding", "headmr_waves", "spineus_bspline")}}
SCENES = {"heart": ["heart"], "shell": ["shell"], "molecule": ["molecule"], "cine": None}
PATHS = ("press", "stroke", "circle")
SECONDS = "6"
# Values that depend on the clock or on the place where the program ran.
CLOCK = re.compile(r"second|_s$|_ms$|_us$|time|date|path|input|output|file|version|memory")


def run(palpate: Path, *arguments, statuses=(0, 3, 4)) -> subprocess.CompletedProcess:
    done = subprocess.run([palpate, *map(str, arguments)], capture_output=True, text=True, check=False)
    if done.returncode not in statuses:
        sys.exit(f"outputs: palpate {' '.join(map(str, arguments))} ended with {done.returncode}: {done.stderr.strip()}")
    return done


def steady(value):
    """A JSON value without what depends on the clock."""
    if isinstance(value, dict):
        return {key: steady(inner) for key, inner in value.items() if not CLOCK.search(key)}
    return [steady(inner) for inner in value] if isinstance(value, list) else value


def steady_text(text: str, folder: Path) -> str:
    """Printed lines with places and durations replaced."""
    text = text.replace(str(folder), "FOLDER").replace(str(DATA), "DATA")
    return re.sub(r"\d+(\.\d+)? (ms|us|s)\b", "TIME", text)


def write_json(file: Path, text: str, folder: Path) -> None:
    file.write_text(steady_text(json.dumps(steady(json.loads(text)), indent=1, sort_keys=True), folder) + "\n")


def record(palpate: Path, folder: Path, old: Path | None) -> None:
    if not DATA.exists():
        sys.exit(f"outputs: there is no {DATA}")
    for name in ("fields", "forces", "pictures", "printed"):
        (folder / name).mkdir(parents=True)
    heart = folder / "fields" / "heart.seq.nrrd"
    run(palpate, "phantom", "-o", heart, "--size", 64, "--frames", 4)
    sequences = [("heart", [heart], ("fast", "balanced", "classic"))]
    sequences += [(name, list(pair), ("fast", "balanced", "best")) for name, pair in PAIRS.items()]
    for name, frames, presets in sequences:
        for preset in presets:
            field = folder / "fields" / f"{name}_{preset}{'' if name == 'heart' else '.mha'}"
            options = ["--model", "pairwise"] if preset == "classic" else ["--confidence"]
            done = run(palpate, "motion", *frames, "-o", field, "--preset", preset, "--coarse", *options, "--json")
            write_json(folder / "printed" / f"motion_{name}_{preset}.json", done.stdout, folder)
            print(f"{name}, {preset}", flush=True)
        write_json(folder / "printed" / f"info_{name}.json", run(palpate, "info", *frames, "--json").stdout, folder)
        if name != "heart":
            checked = run(palpate, "check", field, "--fixed", frames[0], "--moving", frames[1], "--json")
            write_json(folder / "printed" / f"check_{name}.json", checked.stdout, folder)
    cine = sorted((DATA / "heart_cine").glob("frame_*.mha"))
    motion = folder / "fields" / "cine"
    done = run(palpate, "motion", *cine, "-o", motion, "--preset", "fast", "--coarse", "--json")
    write_json(folder / "printed" / "motion_cine.json", done.stdout, folder)
    write_json(folder / "printed" / "check_cine.json", run(palpate, "check", motion, "--sequence", *cine, "--json").stdout, folder)
    for name, scene in SCENES.items():
        scene = scene or [*cine, "--fields", motion]
        (folder / "printed" / f"plan_{name}.txt").write_text(steady_text(run(palpate, "plan", *scene).stdout, folder))
        run(palpate, "view", *scene, "--picture", folder / "pictures" / f"{name}.png", "--frame", "1.5" if name != "molecule" else "0")
        run(palpate, "view", *scene, "--picture", folder / "pictures" / f"{name}_cut.png", "--cut-open", "--picture-size", 256)
        for path in PATHS:
            recording = folder / "forces" / f"{name}_{path}.recording"
            if old:
                shutil.copyfile(old / "forces" / recording.name, recording)
            else:
                run(palpate, "feel", *scene, "--device", "simulated", "--path", path, "--seconds", SECONDS, "--headset", "off",
                    "--record", recording, "--black-box", folder / "black_box", statuses=(0, 1, 3, 4))
            done = run(palpate, "feel", *scene, "--replay", recording, statuses=(0, 1))
            (folder / "printed" / f"replay_{name}_{path}.txt").write_text(steady_text(done.stdout + done.stderr, folder))
        print(f"{name}: forces, pictures", flush=True)
    for summary in (folder / "fields").rglob("summary.json"):
        write_json(summary, summary.read_text(), folder)


def files(folder: Path) -> dict[str, str]:
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
            for kind in ("fields", "forces", "pictures", "printed") for file in sorted((folder / kind).rglob("*")) if file.is_file()
            and file.suffix not in (".html",)}


def compare(old: Path, new: Path) -> int:
    was, now = files(old), files(new)
    differ = [name for name in sorted(was | now) if was.get(name) != now.get(name)]
    for name in differ:
        if name not in now or name not in was:
            print(f"{name}: only in {'the old' if name in was else 'the new'}")
            continue
        print(f"{name}: differs")
        if name.startswith("printed"):
            lines = list(zip((old / name).read_text().splitlines(), (new / name).read_text().splitlines()))
            for before, after in [pair for pair in lines if pair[0] != pair[1]][:5]:
                print(f"    - {before.strip()}\n    + {after.strip()}")
    print(f"{len(was | now) - len(differ)} of {len(was | now)} files are equal")
    return 1 if differ or not was else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    recorder = commands.add_parser("record")
    recorder.add_argument("palpate", type=Path)
    recorder.add_argument("folder", type=Path)
    recorder.add_argument("--from", dest="old", type=Path)
    comparer = commands.add_parser("compare")
    comparer.add_argument("old", type=Path)
    comparer.add_argument("new", type=Path)
    given = parser.parse_args()
    if given.command == "compare":
        sys.exit(compare(given.old, given.new))
    if given.folder.exists():
        sys.exit(f"outputs: {given.folder} is there already; name a new folder")
    record(given.palpate.resolve(), given.folder.resolve(), given.old.resolve() if given.old else None)


if __name__ == "__main__":
    main()
