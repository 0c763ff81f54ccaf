#!/usr/bin/env python3
"""Tests of palpate-cohort with the real palpate, and with a Slurm of their own: one node, under the caller's name, on free ports.

usage: cohort_test.py local|slurm PALPATE-COHORT PALPATE SHARED-DATA SLURM_ROOT.SH
Exit status 77: skipped, and said why.
"""

import csv
import hashlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

WHICH, COHORT, PALPATE, SHARED, SLURM_ROOT = sys.argv[1:6]
HERE = Path(__file__).resolve().parent


def skip(why: str) -> None:
    print(f"SKIPPED: {why}")
    sys.exit(77)


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


def make_pairs(folder: Path, count: int, size: int) -> None:
    """So many pairs cut out of a real one, and their table; of more than 7, number 7 is damaged, of more than 23 that one too."""
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
    if count > 23:
        (folder / "fixed_23.mha").write_bytes(b"this is no image at all")
    (folder / "table.csv").write_text("\n".join(lines) + "\n")


def run(folder: Path, output: str, *options: str, environment: dict | None = None, table: str = "table.csv") -> subprocess.CompletedProcess:
    command = [sys.executable, COHORT, str(folder / table), "--output", str(folder / output), "--palpate", PALPATE, "--preset", "fast", *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def states(output: Path) -> dict[str, str]:
    with open(output / "cohort.csv", encoding="utf-8", newline="") as file:
        return {row["name"]: row["state"] for row in csv.DictReader(file)}


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
    command = [sys.executable, COHORT, str(folder / "table.csv"), "--output", str(folder / "out"), "--palpate", PALPATE, "--preset", "fast"]
    first = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    deadline = time.monotonic() + 300
    while len(written(folder / "out")) < 2 and time.monotonic() < deadline and first.poll() is None:
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    before = written(folder / "out")
    check(2 <= len(before) < 10, f"{len(before)} were done when it was killed")

    second = run(folder, "out", "--jobs", "2")
    check(second.returncode == 4, f"{second.returncode} {second.stdout} {second.stderr}")
    after = written(folder / "out")
    # The one that ran when it was killed may be done but not known to be.
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
    # What is mended is done, and what was removed; nothing else.
    shutil.rmtree(folder / "out" / "pair_00")
    header, voxels = read_mha(Path(SHARED) / "lung" / "pair_moving.mha")
    write_part(folder / "moving_07.mha", header, voxels, (20, 40, 30), 40)
    fourth = run(folder, "out", "--jobs", "2")
    again = {name for name, then in written(folder / "out").items() if then != after[name]}
    check(again == {"pair_00", "pair_07"}, f"done again: {again}; {fourth.stderr}")
    check(states(folder / "out")["pair_07"] != "unusable", "it can be used now")


def what_a_machine_loses_is_begun_again(folder: Path) -> None:
    make_pairs(folder, 2, 32)
    # A palpate that is killed the first time it is called for a pair.
    fake = folder / "palpate"
    fake.write_text(f'#!/bin/sh\ncase "$*" in *fixed_01*) if mkdir "{folder}/killed" 2>/dev/null; then kill -9 $$; fi ;; esac\nexec "{PALPATE}" "$@"\n')
    fake.chmod(0o755)
    done = run(folder, "out", "--no-pictures", "--palpate", str(fake))
    check(done.returncode in (0, 3, 4), f"{done.returncode} {done.stderr}")
    status = json.loads((folder / "out" / "pair_01" / "status.json").read_text())
    check(status["attempt"] == 2 and status["state"] != "lost", f"{status}")
    # One that never comes to its end is not tried for ever, and the others are done.
    fake.write_text(f'#!/bin/sh\ncase "$*" in *fixed_01*) kill -9 $$ ;; esac\nexec "{PALPATE}" "$@"\n')
    done = run(folder, "lost", "--no-pictures", "--retries", "1", "--palpate", str(fake))
    found = states(folder / "lost")
    check(done.returncode == 4 and found["pair_01"] == "lost" and found["pair_00"] != "lost", f"{found} {done.stderr}")
    done = run(folder, "lost", "--no-pictures", "--retry")
    check(states(folder / "lost")["pair_01"] != "lost", f"{done.stderr}")


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
            self.environment["LD_LIBRARY_PATH"] = f"{libraries}:{libraries / 'slurm-wlm'}"
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

    def start(self, name: str, *command: str) -> None:
        log = open(self.folder / f"{name}.log", "ab")
        self.processes[name] = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, start_new_session=True)

    def start_node(self) -> None:
        self.start("slurmd", "slurmd", "-D", *(["-d", self.stepd] if self.stepd else []))

    def kill_node(self) -> None:
        """As when its power goes: the daemon and all that it started, at once."""
        # The steps are sessions of their own; their processes carry this Slurm's spool or configuration in what they were given.
        self.processes["slurmd"].kill()
        self.processes["slurmd"].wait()
        for process in Path("/proc").iterdir():
            if not process.name.isdigit() or int(process.name) in (os.getpid(), *(p.pid for p in self.processes.values())):
                continue
            try:
                given = (process / "cmdline").read_bytes() + (process / "environ").read_bytes()
                if b"SLURM_JOB_ID=" in given and str(self.folder).encode() in given or given.startswith(b"slurmstepd"):
                    os.kill(int(process.name), signal.SIGKILL)
            except (OSError, ProcessLookupError):
                continue

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
            shown = subprocess.run(["sinfo", "-h", "-o", "%T"], env=self.environment, capture_output=True, text=True, check=False)
            if shown.stdout.strip() == "idle":
                return ""
            for name, process in self.processes.items():
                if process.poll() is not None:
                    return f"{name} does not run: " + self.last(name)
            time.sleep(0.2)
        return "its node does not come up: " + self.last("slurmd")

    def last(self, name: str) -> str:
        text = (self.folder / f"{name}.log").read_text(errors="replace").strip().splitlines()
        return text[-1] if text else "it said nothing"

    def stop(self) -> None:
        if "slurmd" in self.processes:
            self.kill_node()
        for process in self.processes.values():
            process.kill()
            process.wait()


def a_node_is_killed_in_the_middle(folder: Path) -> None:
    root = subprocess.run([SLURM_ROOT], capture_output=True, text=True, check=False)
    if root.returncode:
        skip(root.stderr.strip().splitlines()[-1].removeprefix("SKIPPED: ") if root.stderr.strip() else "Slurm can not be fetched")
    make_pairs(folder, 40, 32)
    local = run(folder, "local", "--jobs", "2", "--no-pictures")
    check(local.returncode == 4, f"{local.returncode} {local.stdout} {local.stderr}")
    (folder / "slurm").mkdir()
    slurm = Slurm(folder / "slurm", Path(root.stdout.strip()))
    try:
        why = slurm.start_all()
        if why:
            skip("Slurm can not run here: " + why)
        command = [sys.executable, COHORT, str(folder / "table.csv"), "--output", str(folder / "cluster"), "--palpate", PALPATE,
                   "--preset", "fast", "--no-pictures", "--slurm", "--jobs", "12", "--memory-mb", "100", "--retries", "3"]
        work = subprocess.Popen(command, env=slurm.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        deadline = time.monotonic() + 300
        while len(written(folder / "cluster")) < 6 and time.monotonic() < deadline and work.poll() is None:
            time.sleep(0.1)
        done = len(written(folder / "cluster"))
        check(6 <= done < 40 and work.poll() is None, f"{done} were done when the node was to be killed")
        slurm.kill_node()
        time.sleep(8)
        slurm.start_node()
        said = work.communicate(timeout=600)[0]
        check(work.returncode == 4, f"{work.returncode} {said}")
    finally:
        slurm.stop()
    here, there = states(folder / "local"), states(folder / "cluster")
    check(here == there, f"the same verdicts: {[n for n in here if here[n] != there.get(n)]}")
    check([name for name, state in here.items() if state == "unusable"] == ["pair_07", "pair_23"], f"{here}")
    check(len(fields(folder / "local")) == 38, f"{len(fields(folder / 'local'))} fields")
    check(fields(folder / "local") == fields(folder / "cluster"), "the same fields, bit by bit")


TESTS = {"local": (says_what_is_wrong_with_a_table, goes_on_where_it_stopped_and_repeats_nothing, what_a_machine_loses_is_begun_again),
         "slurm": (a_node_is_killed_in_the_middle,)}


def main() -> None:
    if not shutil.which("snakemake"):
        skip("snakemake is not installed")
    if not (Path(SHARED) / "lung" / "pair_fixed.mha").exists():
        skip(f"there is no lung pair in '{SHARED}'")
    for test in TESTS[WHICH]:
        begin = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="cohort-") as folder:
            test(Path(folder).resolve())
        print(f"{test.__name__.replace('_', ' ')}: passed in {time.monotonic() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
