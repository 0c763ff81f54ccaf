"""Says for Snakemake whether a job of Slurm runs, ended well or failed: from the controller, so that no accounting is needed.

How a job failed is noted for the table: where all of a job was killed (time limit, memory, cancelled) only Slurm knows.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

# What a job that the controller has on its list may come to yet. REQUEUED: its node went away, and it begins again elsewhere.
RUNNING = {"CONFIGURING", "COMPLETING", "PENDING", "PREEMPTED", "REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "RESIZING", "RESV_DEL_HOLD",
           "RUNNING", "SIGNALING", "SPECIAL_EXIT", "STAGE_OUT", "STOPPED", "SUSPENDED"}



def failed(name: str, state: str, code: str) -> str:
    # A job has the name of its sequence, and Snakemake runs this in the folder of the output.
    folder = Path(name.removeprefix("palpate-"))
    if (folder / "..").resolve() == Path.cwd() and folder.is_dir():
        status, number = (code or "0:0").split(":")
        said = state + (f" (signal {number})" if number != "0" else f" (exit status {status})" if status != "0" else "")
        with open(folder / "attempts.jsonl", "a", encoding="utf-8") as file:
            file.write(json.dumps({"slurm": said, "job": job}) + "\n")
    return "failed"


job = sys.argv[1]
shown = subprocess.run(["scontrol", "-o", "show", "job", job], capture_output=True, text=True, check=False)
field = dict(re.findall(r"(?:^| )(JobName|JobState|ExitCode)=(\S+)", shown.stdout))
if "JobState" in field:
    state = field["JobState"]
    print("success" if state == "COMPLETED" else "running" if state in RUNNING else
          failed(field.get("JobName", ""), state, field.get("ExitCode", "")))
elif "Invalid job id" in shown.stderr:
    # The controller forgets jobs some minutes after their end; then only the accounting knows, where there is one.
    told = subprocess.run(["sacct", "-X", "-n", "-P", "-o", "State,ExitCode,JobName", "-j", job], capture_output=True, text=True,
                          check=False)
    state, code, name = told.stdout.split("\n")[0].split("|", 2) if "|" in told.stdout else ("forgotten", "", "")
    print("success" if state == "COMPLETED" else failed(name, state, code))
else:
    # The controller does not answer: it may be restarting, and Snakemake asks again.
    print("running")
