#!/usr/bin/env python3
"""Tests of palpate-cohort with the real palpate, and with a Slurm of their own: one node, under the caller's name, on free ports.

Every path of a test has a blank and a quote in it, some outputs have braces.

usage: cohort_test.py local|slurm PALPATE-COHORT PALPATE SHARED-DATA DEBIAN_ROOT.SH
       cohort_test.py package PALPATE-COHORT BUILD
Exit status 77: skipped, and said why.
"""

import contextlib
import csv
import ctypes
import fcntl
import hashlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import zlib
from pathlib import Path

# The source tree stays as it is.
sys.dont_write_bytecode = True
WHICH, COHORT, PALPATE, SHARED, DEBIAN_ROOT = (sys.argv[1:] + [""] * 2)[:5]
# The build folder, as palpate's folder.
BUILD = PALPATE
# From Linux's sys/prctl.h.
PR_SET_CHILD_SUBREAPER = 36


def skip(why: str) -> None:
    print(f"SKIPPED: {why}")
    sys.exit(77)


def fetched(what: str) -> Path:
    """The folder with what this machine lacks of Slurm or Snakemake."""
    root = subprocess.run([DEBIAN_ROOT, what], capture_output=True, text=True, check=False)
    if root.returncode:
        skip(root.stderr.strip().splitlines()[-1].removeprefix("SKIPPED: ") if root.stderr.strip() else f"{what} can not be fetched")
    return Path(root.stdout.strip())


def find_snakemake() -> None:
    """Sets the environment of this process so that its children find Snakemake where it is not installed."""
    root = fetched("snakemake")
    for name, folder in (("PATH", "usr/bin"), ("PYTHONPATH", "usr/lib/python3/dist-packages"), ("LD_LIBRARY_PATH", "usr/lib/x86_64-linux-gnu")):
        os.environ[name] = ":".join([str(root / folder), *filter(None, [os.environ.get(name)])])


def check(holds: bool, what: str) -> None:
    if not holds:
        raise AssertionError(what)


def read_mha(path: Path) -> tuple[dict, bytes]:
    """Header and voxels of a MetaImage file."""
    whole = path.read_bytes()
    end = whole.index(b"\n", whole.index(b"ElementDataFile"))
    header = dict(line.split(" = ", 1) for line in whole[:end].decode().replace("\r", "").splitlines())
    voxels = whole[end + 1:]
    return header, zlib.decompress(voxels) if header.get("CompressedData") == "True" else voxels


def write_part(path: Path, header: dict, voxels: bytes, low: tuple[int, int, int], size: int) -> None:
    """A cube of an image, as a file of its own."""
    nx, ny, _ = map(int, header["DimSize"].split())
    width = {"MET_SHORT": 2, "MET_USHORT": 2, "MET_FLOAT": 4, "MET_UCHAR": 1}[header["ElementType"]]
    rows = [voxels[((z * ny + y) * nx + low[0]) * width:][:size * width]
            for z in range(low[2], low[2] + size) for y in range(low[1], low[1] + size)]
    spacing = header.get("ElementSpacing", "1 1 1")
    path.write_bytes((f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = {size} {size} {size}\n"
                      f"ElementSpacing = {spacing}\nElementType = {header['ElementType']}\nElementDataFile = LOCAL\n").encode() + b"".join(rows))


def writes_pages(folder: Path) -> bool:
    """Whether palpate was built with a connection to the npm registry."""
    said = subprocess.run([PALPATE, "motion", str(folder / "fixed_00.mha"), str(folder / "moving_00.mha"), "--preset", "fast", "--quiet", "--output",
                           str(folder / "u.mha"), "--page", str(folder / "u.html")], capture_output=True, text=True, check=False)
    writes = "built without NiiVue" not in said.stderr
    if not writes:
        print("pages are not looked at: palpate was built without NiiVue", flush=True)
    return writes


def make_pairs(folder: Path, count: int, size: int) -> None:
    """So many pairs cut out of a real one, and their table; of more than 7, number 7 is damaged, of more than 9 that one too."""
    fixed, moving = (read_mha(Path(SHARED) / "lung" / f"pair_{which}.mha") for which in ("fixed", "moving"))
    nx, ny, nz = map(int, fixed[0]["DimSize"].split())
    lines = ["name,sequence"]
    for n in range(count):
        low = tuple(int((share * (n + 1)) % 1.0 * (room - size)) for share, room in ((0.618, nx), (0.324, ny), (0.755, nz)))
        for which, (header, voxels) in (("fixed", fixed), ("moving", moving)):
            write_part(folder / f"{which}_{n:02}.mha", header, voxels, low, size)
        lines.append(f"pair_{n:02},fixed_{n:02}.mha;moving_{n:02}.mha")
    if count > 7:
        cut = folder / "moving_07.mha"
        cut.write_bytes(cut.read_bytes()[:3000])
    if count > 9:
        (folder / "fixed_09.mha").write_bytes(b"this is no image at all")
    (folder / "table.csv").write_text("\n".join(lines) + "\n")


def cohort(folder: Path, output: str, *options: str, table: str = "table.csv") -> list[str]:
    """The command, from a copy of the scripts beside the data: their folder has a path with blanks, too."""
    scripts = folder / "work flow"
    if not scripts.exists():
        shutil.copytree(Path(COHORT).parent, scripts)
    return [sys.executable, str(scripts / "palpate-cohort"), str(folder / table), "--output", str(folder / output), "--palpate", PALPATE,
            "--preset", "fast", *options]


def run(folder: Path, output: str, *options: str, environment: dict | None = None, table: str = "table.csv") -> subprocess.CompletedProcess:
    return subprocess.run(cohort(folder, output, *options, table=table), capture_output=True, text=True, check=False, env=environment)


def start(folder: Path, output: str, *options: str, environment: dict | None = None) -> subprocess.Popen:
    return subprocess.Popen(cohort(folder, output, *options), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)


def program(path: Path, text: str) -> str:
    """A shell script in the place of a program."""
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(0o755)
    return str(path)


def wait_for(holds, what: str, seconds: float = 120) -> None:
    deadline = time.monotonic() + seconds
    while not holds():
        check(time.monotonic() < deadline, what)
        time.sleep(0.1)


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False


def children(of: list[int]) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if int(stat.read_text().rsplit(")", 1)[1].split()[1]) in of:
                found.append(int(stat.parent.name))
    return found


def kill_with_children(root: int) -> None:
    """As when the power of their machine goes: all at once. None is left out: stopped, they make no others meanwhile."""
    found = [root]
    while True:
        for pid in found:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGSTOP)
        more = set(children(found)) - set(found)
        if not more:
            break
        found += more
    for pid in found:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def rows(output: Path) -> dict[str, dict]:
    with open(output / "cohort.csv", encoding="utf-8", newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def states(output: Path) -> dict[str, str]:
    return {name: row["state"] for name, row in rows(output).items()}


def fields(output: Path) -> dict[str, str]:
    return {path.parts[-3]: hashlib.sha256(path.read_bytes()).hexdigest() for path in output.glob("*/motion/field.mha")}


def written(output: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in output.glob("*/status.json")}


# --- on this machine ---


def says_what_is_wrong_with_a_table(folder: Path) -> None:
    (folder / "a.mha").write_bytes(b"x")
    for text, words in (("", "has no column 'name'"), ("name,sequence\n", "names no sequence"),
                        ("name,sequence,colour\na,a.mha,red\n", "has a column 'colour', which nothing reads"),
                        ("name,sequence\na,a.mha\na,a.mha\n", "in lines 2 and 3"), ("name,sequence\n../a,a.mha\n", "becomes a folder"),
                        ("name,sequence\na,no_*.mha\n", "no file is called 'no_*.mha'"), ("name,sequence\na\n", "another number of columns"),
                        ("name,sequence,preset\na,a.mha,slow\n", "there is no preset 'slow'"),
                        ("name\tsequence\tcyclic\na\ta.mha\tperhaps\n", "say yes or no")):
        (folder / "wrong.csv").write_text(text)
        done = run(folder, "wrong", table="wrong.csv")
        check(done.returncode == 2 and words in done.stderr, f"{text!r}: {done.returncode} {done.stderr}")
        check(done.stderr.count("\n") == 1, f"one sentence: {done.stderr}")
    check(run(folder, "wrong", table="none.csv").returncode == 2, "no table")
    check(not (folder / "wrong").exists(), "nothing is written before the table is understood")


def goes_on_where_it_stopped_and_repeats_nothing(folder: Path) -> None:
    make_pairs(folder, 8, 40)
    (folder / "sequence").mkdir()
    for n in (0, 1, 2):
        shutil.copy(folder / f"fixed_{n:02}.mha", folder / "sequence" / f"frame_{n}.mha")
    for n in range(3):  # other parts of the lung are no sequence; the same part moved is
        header, voxels = read_mha(Path(SHARED) / "lung" / ("pair_moving.mha" if n == 1 else "pair_fixed.mha"))
        write_part(folder / "sequence" / f"frame_{n}.mha", header, voxels, (30, 50, 40), 40)
    with open(folder / "table.csv", "a", encoding="utf-8") as table:
        table.write("breath,sequence/frame_*.mha\nmissing,nowhere.mha;fixed_01.mha\n")

    # Killed in the middle, with all its children.
    first = start(folder, "out")
    deadline = time.monotonic() + 300
    while len(written(folder / "out")) < 2 and time.monotonic() < deadline and first.poll() is None:
        time.sleep(0.05)
    kill_with_children(first.pid)
    first.communicate()
    before = written(folder / "out")
    check(2 <= len(before) < 10, f"{len(before)} were done when it was killed")

    second = run(folder, "out", "--jobs", "2")
    check(second.returncode == 4, f"{second.returncode} {second.stdout} {second.stderr}")
    after = written(folder / "out")
    # The job that ran at that time may be finished without a record of it.
    repeated = [name for name, then in before.items() if after[name] != then]
    check(len(repeated) <= 1, f"what was done is not done again: {repeated}")
    found = states(folder / "out")
    check(len(found) == 10, f"{found}")
    check(found["pair_07"] == found["missing"] == "unusable", f"{found}")
    check(all(state in ("ok", "suspect", "failed") for name, state in found.items() if name not in ("pair_07", "missing")), f"{found}")
    check("2 can not be used: pair_07, missing" in second.stdout, second.stdout)
    page = (folder / "out" / "cohort.html").read_text()
    check(all(f"<b>{name}</b>" in page for name in found), "the page shows each")
    check("is too short" in page and "pair_07/log.txt" in page, "and says what is wrong")
    for name in found:
        has = (folder / "out" / name / "picture.png").exists()
        check(has == (name not in ("pair_07", "missing")), f"{name}: picture {has}")
    check((folder / "out" / "breath" / "motion" / "sequence_motion.nrrd").exists(), "a sequence has one motion")

    third = run(folder, "out", "--jobs", "2")
    check(third.returncode == 4 and written(folder / "out") == after, "a third run does nothing")
    # Jobs whose fault was corrected run again, and those whose result was removed; no others.
    shutil.rmtree(folder / "out" / "pair_00")
    header, voxels = read_mha(Path(SHARED) / "lung" / "pair_moving.mha")
    write_part(folder / "moving_07.mha", header, voxels, (20, 40, 30), 40)
    fourth = run(folder, "out", "--jobs", "2")
    again = {name for name, then in written(folder / "out").items() if then != after[name]}
    check(again == {"pair_00", "pair_07"}, f"done again: {again}; {fourth.stderr}")
    check(states(folder / "out")["pair_07"] != "unusable", "it can be used now")


def what_a_machine_loses_is_begun_again(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    # A palpate that is killed in its first call for a pair.
    fake = program(folder / "palpate", f'case "$*" in *fixed_01*) if mkdir "{folder}/killed" 2>/dev/null; then kill -9 $$; fi ;; esac\n'
                   f'exec "{PALPATE}" "$@"\n')
    pages = writes_pages(folder)
    done = run(folder, "out", "--no-pictures", *["--pages"] * pages, "--palpate", fake)
    check(done.returncode in (0, 3, 4), f"{done.returncode} {done.stderr}")
    if pages:
        check('href="pair_01/page.html"' in (folder / "out" / "cohort.html").read_text(), "the page links to that of the pair")
        check("<main>" in (folder / "out" / "pair_01" / "page.html").read_text(), "which is there")
    status = json.loads((folder / "out" / "pair_01" / "status.json").read_text())
    check(status["attempt"] == 2 and status["state"] != "lost", f"{status}")
    # A job that never ends is not tried for ever, and the others are done.
    program(Path(fake), f'case "$*" in *fixed_01*) kill -9 $$ ;; esac\nexec "{PALPATE}" "$@"\n')
    done = run(folder, "lost", "--no-pictures", "--retries", "1", "--palpate", fake)
    found = rows(folder / "lost")
    check(done.returncode == 4 and found["pair_01"]["state"] == "lost" and found["pair_00"]["state"] != "lost", f"{found} {done.stderr}")
    check(found["pair_01"]["reasons"].count("palpate was killed by signal 9 (Killed)") == 2, f"{found['pair_01']}")
    done = run(folder, "lost", "--no-pictures", "--retry")
    check(states(folder / "lost")["pair_01"] != "lost", f"{done.stderr}")


def a_job_that_is_killed_as_a_whole_is_in_the_table(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    done = run(folder, "out {1}", "--no-pictures")
    check(done.returncode in (0, 3, 4), f"{done.returncode} {done.stderr}")
    # The script that would report how palpate ended is killed too; while work goes on, the earlier table is kept.
    fake = program(folder / "palpate", f'[ -e "{folder}/out {{1}}/cohort.csv" ] || touch "{folder}/no table"\nkill -9 $PPID\n')
    shutil.copy(folder / "moving_00.mha", folder / "moving_01.mha")
    done = run(folder, "out {1}", "--no-pictures", "--retries", "1", "--palpate", fake)
    check(not (folder / "no table").exists(), "the earlier table stays until there is a new one")
    lost = rows(folder / "out {1}")["pair_01"]
    check(done.returncode == 4 and lost["state"] == "lost" and lost["attempt"] == "2", f"{done.returncode} {lost} {done.stdout} {done.stderr}")
    check(all(f"Attempt {n} on {socket.gethostname()}: its process ended with exit status 137, signal 9 (Killed)." in lost["reasons"]
              for n in (1, 2)), f"{lost}")
    check("<b>pair_01</b>" in (folder / "out {1}" / "cohort.html").read_text(), "the page shows it")
    # That was its result, until its line changes.
    before = written(folder / "out {1}")
    check(run(folder, "out {1}", "--no-pictures").returncode == 4 and written(folder / "out {1}") == before, "it is not begun again by itself")
    table = folder / "table.csv"
    table.write_text(table.read_text().replace("sequence", "sequence,cyclic").replace("00.mha\n", "00.mha,no\n").replace("01.mha\n", "01.mha,yes\n"))
    done = run(folder, "out {1}", "--no-pictures")
    check(states(folder / "out {1}")["pair_01"] != "lost", f"{done.stdout} {done.stderr}")
    check(written(folder / "out {1}")["pair_00"] == before["pair_00"], "the other one is not")


def a_signal_ends_all_of_it(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    # Runs for a long time; the test can find the process.
    fake = program(folder / "palpate", f'echo $$ >"{folder}/new"; mv "{folder}/new" "{folder}/pid"\nexec sleep 600\n')
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        work = start(folder, "out", "--palpate", fake)
        wait_for((folder / "pid").exists, "palpate begins")
        palpate = int((folder / "pid").read_text())
        (folder / "pid").unlink()
        check(runs(palpate), "palpate runs")
        work.send_signal(number)
        said = work.communicate(timeout=120)[0]
        check(work.returncode == 128 + number and f"stopped by signal {number}" in said, f"{work.returncode} {said}")
        check(not runs(palpate), "palpate has ended")
        found = rows(folder / "out")
        check(found["pair_00"]["state"] == found["pair_01"]["state"] == "left", f"{found}")
    done = run(folder, "out", "--no-pictures")
    check(done.returncode in (0, 3, 4) and "left" not in states(folder / "out").values(), f"{done.returncode} {done.stderr}")


def only_one_works_in_a_folder(folder: Path) -> None:
    make_pairs(folder, 1, 32)
    # A Snakemake that takes long to end its jobs.
    (folder / "bin").mkdir()
    program(folder / "bin" / "snakemake", f'trap "touch \\"{folder}/asked\\"" INT\necho $$ >"{folder}/new"; mv "{folder}/new" "{folder}/pid"\n'
            f'until [ -e "{folder}/go" ]; do sleep 0.1; done\nexit 1\n')
    environment = dict(os.environ, PATH=f"{folder / 'bin'}:{os.environ['PATH']}")
    for number, code in ((signal.SIGTERM, 143), (signal.SIGKILL, -9)):
        work = start(folder, "out", environment=environment)
        wait_for((folder / "pid").exists, "Snakemake begins")
        snakemake = int((folder / "pid").read_text())
        (folder / "pid").unlink()
        work.send_signal(number)
        if number == signal.SIGTERM:
            wait_for((folder / "asked").exists, "the signal is passed on")
            check(work.poll() is None, "it waits for Snakemake")
        else:
            work.communicate()
        second = run(folder, "out")
        check(second.returncode == 2 and "works in" in second.stderr and runs(snakemake), f"{second.returncode} {second.stderr}")
        (folder / "go").touch()
        work.communicate(timeout=60)
        check(work.returncode == code, f"{work.returncode}")
        wait_for(lambda: not runs(snakemake), "Snakemake ends")
        (folder / "go").unlink()
    # A process of the run before that takes a moment longer.
    late = open(folder / "out" / ".lock", "w", encoding="utf-8")
    fcntl.flock(late, fcntl.LOCK_EX)
    threading.Timer(1.0, late.close).start()
    done = run(folder, "out", "--no-pictures")
    check(done.returncode in (0, 3, 4), f"then the folder is free: {done.returncode} {done.stderr}")


def runs_on_what_else_snakemake_drives(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    # A cluster whose submit command runs the job at once.
    submit = program(folder / "submit", f'echo "$1" >>"{folder}/submitted"\nsh "$1" >&2\n')
    done = run(folder, "out {1}", "--no-pictures", "--", "--jobs", "1", "--cluster", f'"{submit}"')
    found = states(folder / "out {1}")
    check(done.returncode in (0, 3, 4) and set(found.values()) <= {"ok", "suspect", "failed"}, f"{done.returncode} {found} {done.stderr}")
    check((folder / "submitted").read_text().count("\n") == 2, "each was a job of the cluster")


def says_what_there_is_to_do_and_does_nothing(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    before = sorted(folder.iterdir())
    done = run(folder, "out", "--dry-run")
    check(done.returncode == 0 and re.search(r"^sequence +2\b", done.stdout, re.M), f"{done.returncode} {done.stdout} {done.stderr}")
    check(sorted(folder.iterdir()) in (before, sorted([*before, folder / "work flow"])), "no folder is made")
    (folder / "moving_01.mha").write_bytes(b"this is no image at all")
    check(run(folder, "out", "--no-pictures").returncode == 4, "one can not be used")
    before = {path: path.stat().st_mtime_ns for path in (folder / "out").rglob("*") if ".snakemake" not in path.parts and path.is_file()}
    for options, words in (((), "Nothing to be done"), (("--retry",), r"^sequence +1\b")):
        done = run(folder, "out", "--no-pictures", "--dry-run", *options)
        check(done.returncode == 0 and re.search(words, done.stdout + done.stderr, re.M), f"{options}: {done.returncode} {done.stdout} {done.stderr}")
    after = {path: path.stat().st_mtime_ns for path in (folder / "out").rglob("*") if ".snakemake" not in path.parts and path.is_file()}
    check(before == after, "nothing of it changes")


def says_which_paths_it_can_not_have(folder: Path) -> None:
    make_pairs(folder, 1, 32)
    (folder / "braces.csv").write_text("name,sequence\na,fixed_{0}.mha;moving_00.mha\n")
    done = run(folder, "out", table="braces.csv")
    check(done.returncode == 2 and "rename it" in done.stderr and done.stderr.count("\n") == 1, f"{done.returncode} {done.stderr}")
    (folder / "two.csv").write_text("name,sequence\na,fixed_$.mha;moving_00.mha\n")
    for output, table in (('a "b"', "table.csv"), ("a $b", "table.csv"), ("a \\ b", "table.csv"), ("out", "two.csv")):
        done = run(folder, output, "--", "--cluster", "true", table=table)
        check(done.returncode == 2 and "rename it" in done.stderr and done.stderr.count("\n") == 1, f"{done.returncode} {done.stderr}")
        check(not (folder / output).exists(), "nothing is written before")


def a_slurm_that_does_not_answer_is_not_one_without_jobs(folder: Path) -> None:
    make_pairs(folder, 1, 32)
    programs = folder / "programs"
    programs.mkdir()
    program(programs / "sbatch", "exit 1\n")
    program(programs / "squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2\nexit 1\n")
    done = run(folder, "out", "--slurm", environment=dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}"))
    check(done.returncode == 2 and "Unable to contact" in done.stderr and done.stderr.count("\n") == 1, f"{done.returncode} {done.stderr}")
    check(not (folder / "out" / "snakemake.log").exists(), "no job is begun")


# --- as a package ---


def is_in_a_package(_: Path) -> None:
    components = [line for line in (Path(BUILD) / "CPackConfig.cmake").read_text().splitlines() if "CPACK_COMPONENTS_ALL " in line]
    check(len(components) == 1 and "palpate_cohort" in re.split('[;"]', components[0]), f"{components}")


def has_a_page_and_completions(folder: Path) -> None:
    subprocess.run([sys.executable, str(Path(COHORT).parent / "write_manual.py"), "1.2.3", str(folder)], check=True)
    if shutil.which("groff"):
        page = subprocess.run(["groff", "-man", "-Tutf8", "-ww", str(folder / "man1/palpate-cohort.1")], capture_output=True, text=True, check=True)
        check(page.stderr == "" and "SNAKEMAKE OPTIONS" in page.stdout, page.stderr)
    for words, expected in ((["--pre"], ["--preset"]), (["--preset", "b"], ["balanced", "best"]), (["--preset", "=", "cl"], ["classic"]),
                            (["--jobs", ""], []), (["-o", "ma"], ["man1"])):
        told = subprocess.run(["bash", "--norc", "-c", 'source bash/palpate-cohort; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
                               '_palpate_cohort; printf "%s\\n" "${COMPREPLY[@]}"', "bash", "palpate-cohort", *words],
                              cwd=folder, capture_output=True, text=True, check=True)
        check(told.stdout.split() == expected, f"{words}: {told.stdout} {told.stderr}")
    if shutil.which("zsh"):
        subprocess.run(["zsh", "-n", str(folder / "zsh/_palpate-cohort")], check=True)


def has_a_page_that_fits_a_phone(folder: Path) -> None:
    """The table's page in chromium: nothing is cut off or beside the window, and a narrow one names each number."""
    if not shutil.which("chromium"):
        return
    sys.path.insert(0, str(Path(COHORT).parent))
    import cohort_report
    numbers = {"frames": 20, "size": "512 x 512 x 400", "motion_mean_mm": 3.14, "motion_max_mm": 21.7, "correlation_before": 0.412,
               "correlation_after": 0.871, "motion_left_voxels": 0.31, "folded_voxels": 0, "least_determinant": 0.21, "seconds": 1234.5}
    name = "patient-0001-without-any-blank-in-a-very-long-name-of-a-scanner"
    (folder / name).mkdir()
    head = (900).to_bytes(4, "big") + (300).to_bytes(4, "big") + b"\x08\x00\x00\x00\x00"
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(bytes(301 * 900))), (b"IEND", b""))
    (folder / name / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        len(what).to_bytes(4, "big") + kind + what + zlib.crc32(kind + what).to_bytes(4, "big") for kind, what in parts))
    rows = [{"name": name, "state": "suspect", "picture": True, "page": True,
             "reasons": ["12 % of the structure has a low confidence: a person should look at the fields."], **numbers},
            {"name": "lost", "state": "lost", "reasons": ["Attempt 1 on node-17: killed, or its machine failed."]}]
    (folder / "page.html").write_text(cohort_report.page(rows).replace("</body>", """<script>addEventListener("load", () => {
      const cell = document.querySelector("td[data-of]"), seen = getComputedStyle(cell, "::before").content;
      const wide = [...document.querySelectorAll("td, th, img, li, p, h1")].filter((e) => e.getBoundingClientRect().right > innerWidth + 0.5).length;
      parent.postMessage([document.documentElement.scrollWidth - innerWidth, wide, seen].join(" | "), "*"); })</script></body>"""))
    for width, named in ((400, True), (1280, False)):
        (folder / "around.html").write_text('<!doctype html><html><body style="margin:0"><script>addEventListener("message", (m) => { '
                                            'document.getElementById("said").textContent = m.data; });</script>'
                                            f'<iframe src="page.html" style="border:0;width:{width}px;height:900px"></iframe>'
                                            '<p id="said"></p></body></html>')
        seen = subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=5000",
                               f"--user-data-dir={folder / 'profile'}", "--window-size=1400,1000", "--dump-dom", f"file://{folder / 'around.html'}"],
                              capture_output=True, text=True, check=True).stdout
        said = re.search(r'<p id="said">([^<]*)</p>', seen)
        check(said is not None and said[1].count(" | ") == 2, f"chromium printed {seen!r}")
        overflow, wide, label = said[1].split(" | ")
        check(float(overflow) <= 0 and int(wide) == 0, f"at {width} pixels: {said[1]}")
        check(("frames" in label) == named, f"at {width} pixels: {said[1]}")


# --- on Slurm ---


class Slurm:
    """A Slurm of one node with two cores: MUNGE, controller and node daemon as processes of this test."""

    def __init__(self, folder: Path, root: Path):
        self.folder, self.processes = folder, {}
        libraries = root / "usr/lib/x86_64-linux-gnu"
        bins = [str(root / "usr/sbin"), str(root / "usr/bin")]
        self.environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"),
                                PATH=":".join(bins + [os.environ["PATH"], "/usr/sbin", "/sbin"]))
        if libraries.exists():
            self.environment["LD_LIBRARY_PATH"] = ":".join([str(libraries), str(libraries / "slurm-wlm"),
                                                            *filter(None, [os.environ.get("LD_LIBRARY_PATH")])])
        plugins = libraries / "slurm-wlm"
        plugins = plugins if plugins.exists() else Path("/usr/lib/x86_64-linux-gnu/slurm-wlm")
        self.stepd = shutil.which("slurmstepd", path=self.environment["PATH"])
        user = subprocess.run(["id", "-un"], capture_output=True, text=True, check=True).stdout.strip()
        host = socket.gethostname().split(".")[0]
        sockets = [socket.socket() for _ in range(2)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        ports = [one.getsockname()[1] for one in sockets]
        for one in sockets:
            one.close()
        for name in ("state", "spool"):
            (folder / name).mkdir()
        (folder / "munge.key").write_bytes(os.urandom(128))
        (folder / "munge.key").chmod(0o400)
        (folder / "slurm.conf").write_text(f"""
ClusterName=palpate
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
PluginDir={plugins}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdTimeout=5
KillWait=2
ReturnToService=2
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")

    def start(self, name: str, *command: str, before=None) -> None:
        with open(self.folder / f"{name}.log", "ab") as log:
            self.processes[name] = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, start_new_session=True,
                                                    preexec_fn=before)

    def start_node(self) -> None:
        self.start("slurmd", "slurmd", "-D", *(["-d", self.stepd] if self.stepd else []), before=adopt_orphans)

    def kill_node(self) -> None:
        """As when its power goes: the daemon and all that it started, at once."""
        kill_with_children(self.processes["slurmd"].pid)
        self.processes["slurmd"].wait()

    def start_all(self) -> str:
        """Empty, or why it does not run."""
        self.start("munged", "munged", "--foreground", "--force", f"--socket={self.folder}/munge.socket",
                   f"--key-file={self.folder}/munge.key", f"--pid-file={self.folder}/munged.pid", f"--seed-file={self.folder}/munge.seed",
                   f"--log-file={self.folder}/munged.own.log")
        deadline = time.monotonic() + 30
        while not (self.folder / "munge.socket").exists():
            if time.monotonic() > deadline or self.processes["munged"].poll() is not None:
                return "munged does not run: " + self.last("munged")
            time.sleep(0.1)
        self.start("slurmctld", "slurmctld", "-D")
        self.start_node()
        while time.monotonic() < deadline + 30:
            if self.node_state() == "idle":
                return ""
            for name, process in self.processes.items():
                if process.poll() is not None:
                    return f"{name} does not run: " + self.last(name)
            time.sleep(0.2)
        return "its node does not come up: " + self.last("slurmd")

    def node_state(self) -> str:
        return subprocess.run(["sinfo", "-h", "-o", "%T"], env=self.environment, capture_output=True, text=True, check=False).stdout.strip()

    def last(self, name: str) -> str:
        text = (self.folder / f"{name}.log").read_text(errors="replace").strip().splitlines()
        return text[-1] if text else "it said nothing"

    def stop(self) -> None:
        if "slurmd" in self.processes:
            self.kill_node()
        for process in self.processes.values():
            process.kill()
            process.wait()


@contextlib.contextmanager
def running_slurm():
    root = fetched("slurm")
    # slurm.conf can not contain a path with blanks.
    with tempfile.TemporaryDirectory(prefix="slurm-") as folder:
        slurm = Slurm(Path(folder).resolve(), root)
        try:
            why = slurm.start_all()
            if why:
                skip("Slurm can not run here: " + why)
            yield slurm
        finally:
            slurm.stop()


def slurm_says_how_a_job_was_killed(folder: Path) -> None:
    make_pairs(folder, 3, 32)
    # Cancelled, as when a time limit ends a job: the job has time to write a message. Then killed from the batch script down: only Slurm has a record
    # of this.
    fake = program(folder / "palpate", f"""case "$*" in
*fixed_01*)
  pid=$PPID all=
  until [ "$(cat /proc/$pid/comm)" = slurmstepd ]; do
    all="$pid $all"
    pid=$(sed -n 's/^PPid:[^0-9]*//p' /proc/$pid/status)
    [ $pid -gt 1 ] || exit 99
  done
  kill -9 $all ;;
*fixed_02*) scancel $SLURM_JOB_ID; sleep 600 ;;
esac
exec "{PALPATE}" "$@"
""")
    with running_slurm() as slurm:
        options = ("--no-pictures", "--slurm", "--jobs", "2", "--memory-mb", "100", "--retries", "1")
        done = run(folder, "out {1}", "--palpate", fake, *options, environment=slurm.environment)
        found = rows(folder / "out {1}")
        check(done.returncode == 4 and found["pair_00"]["state"] != "lost", f"{done.returncode} {done.stdout} {done.stderr} {found}")
        # Slurm sends the signal to palpate and to the process that waits for it, in any order: "stopped by" or "palpate was killed by".
        for name, words in (("pair_01", "Slurm says FAILED (signal 9) of job"),
                            ("pair_02", "ed by signal 15 (Terminated); Slurm says CANCELLED (signal 15) of job")):
            reasons = found[name]["reasons"]
            check(found[name]["state"] == "lost" and all(f"Attempt {n} on" in reasons for n in (1, 2)), f"{found[name]}")
            check(reasons.count(words) == 2, f"{found[name]}")
        # A job that Slurm does not accept does not count as lost by a machine.
        done = run(folder, "refused", *options, "--slurm-options", "--partition nowhere", environment=slurm.environment)
        found = states(folder / "refused")
        check(done.returncode == 1 and set(found.values()) == {"left"} and len(found) == 3, f"{done.returncode} {done.stdout} {done.stderr} {found}")


def a_signal_cancels_the_jobs(folder: Path) -> None:
    make_pairs(folder, 3, 32)
    fake = program(folder / "palpate", f'touch "{folder}/begun"\nexec sleep 600\n')

    def jobs() -> list[str]:
        told = subprocess.run(["squeue", "-h", "-o", "%j"], env=slurm.environment, capture_output=True, text=True, check=True)
        return sorted(told.stdout.split())

    with running_slurm() as slurm:
        work = start(folder, "out", "--palpate", fake, "--slurm", "--jobs", "3", "--memory-mb", "100", environment=slurm.environment)
        wait_for((folder / "begun").exists, "a job begins")
        wait_for(lambda: jobs() == ["palpate-pair_00", "palpate-pair_01", "palpate-pair_02"], f"jobs have the names of sequences: {jobs()}")
        work.terminate()
        said = work.communicate(timeout=120)[0]
        check(work.returncode == 143 and "3 not done yet" in said, f"{work.returncode} {said}")
        wait_for(lambda: not jobs(), f"no job is left: {jobs()}")
        # A cancelled run does not count as an attempt: a sequence that fails has no attempt left.
        done = run(folder, "out", "--no-pictures", "--slurm", "--jobs", "3", "--memory-mb", "100", "--retries", "0", environment=slurm.environment)
        found = rows(folder / "out")
        check(done.returncode in (0, 3, 4) and all(row["attempt"] == "1" for row in found.values()),
              f"{done.returncode} {found} {done.stdout} {done.stderr}")


def jobs_that_nobody_waits_for_are_not_doubled(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    fake = program(folder / "palpate", f'touch "{folder}/begun"\nexec sleep 600\n')
    options = ("--no-pictures", "--slurm", "--jobs", "2", "--memory-mb", "100")
    with running_slurm() as slurm:
        work = start(folder, "out", "--palpate", fake, *options, environment=slurm.environment)
        wait_for((folder / "begun").exists, "a job begins")

        def queued() -> list[str]:
            told = subprocess.run(["squeue", "-h", "--sort=i", "-t", "PENDING,RUNNING", "-o", "%i"], env=slurm.environment,
                                  capture_output=True, text=True, check=True)
            return told.stdout.split()

        wait_for(lambda: len(queued()) == 2, "both are jobs")
        # As when the machine on which Snakemake runs loses power, but not the nodes.
        kill_with_children(work.pid)
        work.communicate()
        before = queued()
        done = run(folder, "out", *options, environment=slurm.environment)
        check(done.returncode == 2 and "still has 2 jobs of an earlier run" in done.stderr and " ".join(before) in done.stderr,
              f"{done.returncode} {done.stdout} {done.stderr}")
        check(done.stderr.count("\n") == 1 and queued() == before, f"one sentence, and no job more: {done.stderr} {queued()}")
        subprocess.run(["scancel", *before], env=slurm.environment, check=True)
        wait_for(lambda: not queued(), "they are cancelled")
        done = run(folder, "out", *options, environment=slurm.environment)
        check(done.returncode in (0, 3, 4) and "left" not in states(folder / "out").values(), f"{done.returncode} {done.stdout} {done.stderr}")


def a_node_is_killed_in_the_middle(folder: Path) -> None:
    make_pairs(folder, 12, 32)
    with running_slurm() as slurm:
        work = start(folder, "cluster", "--no-pictures", "--slurm", "--jobs", "6", "--memory-mb", "100", "--retries", "3",
                     environment=slurm.environment)
        deadline = time.monotonic() + 300
        while len(written(folder / "cluster")) < 3 and time.monotonic() < deadline and work.poll() is None:
            time.sleep(0.1)
        done = len(written(folder / "cluster"))
        check(3 <= done < 12 and work.poll() is None, f"{done} were done when the node was to be killed")
        slurm.kill_node()
        wait_for(lambda: slurm.node_state().startswith("down"), "Slurm notices that its node is gone")
        slurm.start_node()
        said = work.communicate(timeout=600)[0]
        check(work.returncode == 4, f"{work.returncode} {said}")
    local = run(folder, "local", "--jobs", "2", "--no-pictures")
    check(local.returncode == 4, f"{local.returncode} {local.stdout} {local.stderr}")
    here, there = states(folder / "local"), states(folder / "cluster")
    check(here == there, f"the same verdicts: {[n for n in here if here[n] != there.get(n)]}")
    check([name for name, state in here.items() if state == "unusable"] == ["pair_07", "pair_09"], f"{here}")
    check(len(fields(folder / "local")) == 10, f"{len(fields(folder / 'local'))} fields")
    check(fields(folder / "local") == fields(folder / "cluster"), "the same fields, bit by bit")


TESTS = {"package": (is_in_a_package, has_a_page_and_completions, has_a_page_that_fits_a_phone),
         "local": (says_what_is_wrong_with_a_table, goes_on_where_it_stopped_and_repeats_nothing, what_a_machine_loses_is_begun_again,
                   a_job_that_is_killed_as_a_whole_is_in_the_table, a_signal_ends_all_of_it, only_one_works_in_a_folder,
                   runs_on_what_else_snakemake_drives, says_what_there_is_to_do_and_does_nothing, says_which_paths_it_can_not_have,
                   a_slurm_that_does_not_answer_is_not_one_without_jobs),
         "slurm": (slurm_says_how_a_job_was_killed, a_signal_cancels_the_jobs, jobs_that_nobody_waits_for_are_not_doubled,
                   a_node_is_killed_in_the_middle)}


def adopt_orphans() -> None:
    """What a child of this process leaves behind stays below it (a "child subreaper"), and is found there."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def main() -> None:
    adopt_orphans()
    if WHICH != "package" and not shutil.which("snakemake"):
        find_snakemake()
    if WHICH != "package" and not (Path(SHARED) / "lung" / "pair_fixed.mha").exists():
        skip(f"there is no lung pair in '{SHARED}'")
    for test in TESTS[WHICH]:
        begin = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="cohort it's ") as folder:
            try:
                test(Path(folder).resolve())
            finally:
                for pid in children([os.getpid()]):
                    kill_with_children(pid)
        print(f"{test.__name__.replace('_', ' ')}: passed in {time.monotonic() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
