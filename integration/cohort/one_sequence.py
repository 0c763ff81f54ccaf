"""One sequence of a cohort: runs palpate, draws a picture, and writes NAME/status.json when both are there.

Ends with 0 where palpate gave an answer, also that it can not use the files; with 1 where a machine may do better another time.
What is known of attempts without an answer stands in NAME/attempts.jsonl until one has an answer.
"""

import argparse
import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

# palpate's exit status, and what it means for a sequence.
STATES = {0: "ok", 2: "unusable", 3: "suspect", 4: "failed"}


def run(command: list[str], log: Path, environment: dict) -> subprocess.CompletedProcess:
    with open(log, "a", encoding="utf-8") as file:
        # Before it runs: if all is killed, the log says what was running.
        file.write("$ " + shlex.join(command) + "\n")
        file.flush()
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        file.write(done.stderr + f"(exit status {done.returncode})\n")
    return done


def note(folder: Path, **what) -> None:
    with open(folder / "attempts.jsonl", "a", encoding="utf-8") as file:
        file.write(json.dumps(what) + "\n")


def sentence(done: subprocess.CompletedProcess) -> str:
    """palpate's own words for what was wrong: its last line."""
    if done.returncode < 0:
        number = -done.returncode
        return f"palpate was killed by signal {number} ({signal.strsignal(number)})"
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    return lines[-1].removeprefix("palpate: ") if lines else f"palpate ended with exit status {done.returncode} and said nothing"


def numbers_of(summary: dict) -> dict:
    """What the table shows of palpate's summary; of a sequence the worst frame."""
    if summary["model"] == "sequence":
        parts = [part for part in summary["evidence"]["frames"]]
        reference = summary["evidence"]["reference_frame"]
        parts = [part for part in parts if part["frame"] != reference] or parts
        seconds = summary["sequence"]["seconds"]
    else:
        parts = summary["pairs"]
        seconds = sum(part.get("seconds", part["cost"]["solve_seconds"]) for part in parts)
    folds = [part["evidence"]["folds"] for part in parts if "folds" in part["evidence"]]
    match = [part["evidence"]["match"] for part in parts if "match" in part["evidence"]]
    reasons = summary.get("verdict", {}).get("reasons", [])
    return {"model": summary["model"], "frames": summary["frame_count"], "size": "x".join(map(str, summary["grid"]["size"])),
            "spacing_mm": "x".join(f"{s:.4g}" for s in summary["grid"]["spacing_mm"]), "device": summary["device"],
            "motion_mean_mm": max(part["motion_mm"]["mean"] for part in parts),
            "motion_max_mm": max(part["motion_mm"]["max"] for part in parts),
            "folded_voxels": sum(f["folded"] for f in folds) if folds else None,
            "least_determinant": min(f["min_determinant"] for f in folds) if folds else None,
            "correlation_before": min(m["correlation_before"] for m in match) if match else None,
            "correlation_after": min(m["correlation_after"] for m in match) if match else None,
            "motion_left_voxels": max(m["motion_left_voxels"] for m in match) if match else None,
            "solve_seconds": seconds, "reasons": reasons}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("config")
    parser.add_argument("name")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--attempt", type=int, default=1)
    options = parser.parse_args()
    config = json.loads(Path(options.config).read_text())
    one, palpate = config["sequences"][options.name], config["palpate"]
    folder = Path(options.name)
    folder.mkdir(exist_ok=True)
    log = folder / "log.txt"
    for old in ("motion", "picture.png", "page.html", "status.json"):
        path = folder / old
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    log.unlink(missing_ok=True)
    note(folder, attempt=options.attempt, host=socket.gethostname(), job=os.environ.get("SLURM_JOB_ID"))

    def stop(number: int, _) -> None:
        # A time limit, a job that is cancelled, or all is to stop. subprocess.run() ends palpate, too.
        note(folder, ended=f"stopped by signal {number} ({signal.strsignal(number)})")
        sys.exit(128 + number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    # The CPU driver of Vulkan takes all cores otherwise.
    environment = dict(os.environ, LP_NUM_THREADS=str(options.threads))

    is_pair = len(one["files"]) == 2 and one["model"] != "sequence"
    # A pair has one field, a sequence a folder of them; either stands in 'motion'.
    (folder / "motion").mkdir()
    result = folder / "motion" / "field.mha" if is_pair else folder / "motion"
    command = [palpate, "motion", *one["files"], "--output", str(result), "--preset", one["preset"], "--json", "--quiet"]
    command += ["--mask", one["mask"]] if one["mask"] else []
    command += ["--cyclic"] if one["cyclic"] else []
    command += ["--model", one["model"]] if one["model"] else []
    command += ["--pictures"] if is_pair and config["pictures"] else []
    page = folder / "page.html"
    command += ["--page", str(page)] if config["pages"] else []
    begin = time.monotonic()
    done = run(command, log, environment)
    status = {"name": options.name, "files": one["files"], "preset": one["preset"], "host": socket.gethostname(), "attempt": options.attempt}
    if done.returncode not in STATES:
        # A device that failed, or the end of the process by a signal: perhaps only here and now.
        note(folder, ended=sentence(done))
        print(f"{options.name}: {sentence(done)}", file=sys.stderr)
        return 1
    status["state"] = STATES[done.returncode]
    if status["state"] == "unusable":
        status["reasons"] = [sentence(done)]
    else:
        status.update(numbers_of(json.loads(done.stdout)))
        picture = folder / "picture.png"
        if is_pair and config["pictures"]:
            (folder / "motion" / "field.png").rename(picture)
        elif config["pictures"]:
            frame = str(status["frames"] // 2)
            view = [palpate, "view", *one["files"], "--fields", str(result), "--frame", frame, "--picture", str(picture),
                    "--picture-size", "512", "--quiet"] + ([] if one["cyclic"] else ["--not-cyclic"])
            drawn = run(view, log, environment)
            if drawn.returncode:
                status["reasons"] = status["reasons"] + ["No picture: " + sentence(drawn)]
        if picture.exists():
            status["picture"] = str(picture)
        if page.exists():
            status["page"] = str(page)
    if not any((folder / "motion").iterdir()):
        (folder / "motion").rmdir()
    status["seconds"] = time.monotonic() - begin
    # As a whole or not at all: what stands there is done.
    (folder / "status.new").write_text(json.dumps(status, indent=1))
    (folder / "status.new").rename(folder / "status.json")
    (folder / "attempts.jsonl").unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
